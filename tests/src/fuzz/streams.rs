//! Rows that come to the monitor.

use super::Ended;
use super::process::Folder;
use super::source::Source;

/// The model that watches.
pub(super) fn model(source: &mut Source) -> String {
    let columns = [
        "",
        "",
        "[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\noutput = \"y [cm]\"\n",
    ];
    let plants = [
        "plant = \"single-tank\"\n[known]\narea = 154.0\n",
        "plant = \"first-order\"\n",
    ];
    source.pick(&plants).to_string() + source.pick(&columns)
}

/// Rows of a tank, from the time `begin` \[s\] on, with a header or without.
pub(super) fn rows(source: &mut Source, count: usize, begin: f64) -> Vec<String> {
    let (mut u, mut level) = (5.0, 16.0_f64);
    let mut lines = Vec::with_capacity(count);
    for k in 0..count {
        if k % 40 == 0 {
            u = source.uniform(3.5, 6.5);
        }
        let t = begin + 2.0 * k as f64;
        lines.push(format!("{t},{u:.3},{:.3}", level + 0.05 * source.normal()));
        level += 2.0 * (10.0 * u - 12.5 * level.max(0.0).sqrt()) / 154.0;
    }
    lines
}

/// Headers of a stream.
const HEADERS: [&str; 5] = [
    "t [s],u [V],y [cm]",
    "t,u,y",
    "t [ms],u [V],y [mm]",
    "y [cm],u [V],t [s]",
    "a,b,c",
];

/// A stream: rows, of which some are lost, repeated, of another shape, or no rows.
fn text(source: &mut Source) -> Vec<u8> {
    let count = source.below(400);
    let mut lines = rows(source, count, 0.0);
    if source.chance(0.9) {
        let header = if source.chance(0.8) {
            HEADERS[0]
        } else {
            source.pick(&HEADERS)
        };
        lines.insert(0, header.to_string());
    }
    for _ in 0..source.below(12) {
        let at = source.below(lines.len());
        match source.below(9) {
            0 if at < lines.len() => drop(lines.remove(at)),
            1 => lines.insert(at, source.pick(&HEADERS).to_string()),
            2 => lines.insert(at, source.word()),
            3 => lines.insert(at, source.name()),
            4 => lines.insert(
                at,
                format!(
                    "{},{},{}",
                    source.number(),
                    source.number(),
                    source.number()
                ),
            ),
            5 => {
                let begin = source.uniform(-1e3, 1e6);
                let more = 1 + source.below(20);
                let rows = rows(source, more, begin);
                lines.splice(at..at, rows).for_each(drop);
            }
            // The readings of a run of rows are lost.
            6 => {
                let word = source.word();
                let most = source.below(60);
                for line in lines.iter_mut().skip(at).take(most) {
                    let cells: Vec<&str> = line.split(',').collect();
                    *line = [
                        cells.first().unwrap_or(&""),
                        cells.get(1).unwrap_or(&""),
                        word.as_str(),
                    ]
                    .join(",");
                }
            }
            7 => lines.insert(at, ",".repeat(source.below(70_000))),
            _ => {}
        }
    }
    let ends = ["\n", "\n", "\r\n", "\r"];
    let mut text = lines.join(source.pick(&ends)).into_bytes();
    if source.chance(0.8) {
        text.push(b'\n');
    }
    if source.chance(0.4) {
        source.damaged(&text, ',')
    } else {
        text
    }
}

/// A run on a stream.
pub(super) fn case(source: &mut Source) -> Ended {
    let folder = Folder::new();
    folder.write("model.toml", model(source));
    folder.write("rows.csv", text(source));
    let mut words = "monitor --model model.toml --learn 100".to_string();
    if source.chance(0.3) {
        words += " --estimates --interval 20";
    }
    if source.chance(0.3) {
        words += " --state state.json";
    }
    folder.run(&words, Some("rows.csv"), &["state.json"])
}
