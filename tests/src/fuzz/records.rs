//! Records: what a logger writes, with everything that a logger may do to it.

use super::Ended;
use super::models;
use super::process::Folder;
use super::source::Source;

/// Format of a file's numbers.
struct Style {
    separator: char,
    decimal_comma: bool,
    line_end: &'static str,
    digits: usize,
}

impl Style {
    fn draw(source: &mut Source) -> Self {
        let separator = [',', ',', ',', ',', ';', ';', '\t', ' '][source.below(8)];
        Self {
            separator,
            decimal_comma: separator != ',' && source.chance(0.4),
            line_end: ["\n", "\n", "\n", "\r\n", "\r", "\n\n"][source.below(6)],
            digits: 2 + source.below(8),
        }
    }

    fn number(&self, value: f64) -> String {
        let text = if value.abs() < 1e7 && value.abs() > 1e-4 || value == 0.0 {
            format!("{value:.*}", self.digits)
        } else {
            format!("{value:e}")
        };
        if self.decimal_comma {
            text.replace('.', ",")
        } else {
            text
        }
    }
}

/// Times of the samples.
fn times(source: &mut Source, rows: usize) -> Vec<f64> {
    let step = if source.chance(0.8) {
        2.0
    } else {
        source.scale(1e-9, 1e9)
    };
    let begin = if source.chance(0.8) {
        0.0
    } else {
        source.uniform(-1e10, 1e10)
    };
    let jitter = if source.chance(0.8) {
        0.0
    } else {
        source.uniform(0.0, 0.5)
    };
    let mut times: Vec<f64> = (0..rows)
        .map(|k| begin + step * (k as f64 + jitter * source.uniform(-1.0, 1.0)))
        .collect();
    match source.below(40) {
        0 => times.reverse(),
        // A gap.
        1 => {
            let at = source.below(rows);
            times.iter_mut().skip(at).for_each(|t| *t += 100.0 * step);
        }
        2 => {
            let at = source.below(rows.saturating_sub(1));
            if let [a, b] = times[at..].get(..2).unwrap_or_default() {
                times[at + 1] = a + 0.0 * b;
            }
        }
        _ => {}
    }
    times
}

/// The command and what a process of one or two time constants, or none, answers.
fn signals(source: &mut Source, rows: usize) -> [Vec<f64>; 2] {
    let (mut u, mut level, mut first) = (5.0, 16.0, 16.0);
    let share = source.scale(0.01, 1.0);
    let noise = if source.chance(0.2) {
        0.0
    } else {
        source.scale(1e-3, 3.0)
    };
    let hold = 1 + source.below(30);
    let curved = source.chance(0.5);
    let (mut command, mut answer) = (Vec::new(), Vec::new());
    for k in 0..rows {
        if k % hold == 0 {
            u = source.uniform(3.0, 7.0);
        }
        command.push(u);
        answer.push(level + noise * source.normal());
        let rest = if curved { 0.64 * u * u } else { 3.2 * u };
        first += share * (rest - first);
        level += share * (first - level);
    }
    [command, answer]
}

/// Distortions of a signal by a sensor, a converter or a person.
fn distorted(source: &mut Source, values: &mut [f64]) {
    let factor = [-1.0, 1e-9, 1e9, 1e150, 1e-300, 0.0][source.below(6)];
    let at = source.below(values.len());
    match source.below(20) {
        0 => values.iter_mut().for_each(|v| *v *= factor),
        1 => values.iter_mut().for_each(|v| *v += 1e6),
        2 => values.iter_mut().for_each(|v| *v = v.round()),
        3 => values.iter_mut().for_each(|v| *v = v.clamp(10.0, 16.0)),
        4 => values.iter_mut().skip(at).for_each(|v| *v = 7.0),
        5 => {
            let edge = source.number().parse().unwrap_or(0.0);
            if let Some(value) = values.get_mut(at) {
                *value = edge;
            }
        }
        _ => {}
    }
}

/// The names of the columns.
fn header(source: &mut Source, columns: usize) -> Vec<String> {
    let usual = [
        ["t [s]", "u [V]", "y [cm]"],
        ["t", "u", "y"],
        ["time (min)", "u [%]", "y [mm]"],
        ["t_ms", "u_mV", "y_m"],
    ];
    let names = usual[source.below(usual.len())];
    let mut names: Vec<String> = names.iter().map(|name| (*name).to_string()).collect();
    while names.len() < columns {
        let name = source.name();
        names.push(if name.is_empty() || source.chance(0.5) {
            format!("x{}", names.len())
        } else {
            name
        });
    }
    if source.chance(0.05) {
        let at = source.below(columns);
        names[at] = source.name();
    }
    if source.chance(0.05) {
        let rotation = source.below(columns);
        names.rotate_left(rotation);
    }
    names
}

/// A record as a file.
pub(super) fn text(source: &mut Source) -> Vec<u8> {
    let style = Style::draw(source);
    let rows = if source.chance(0.05) {
        source.below(4)
    } else {
        20 + source.below(60)
    };
    let mut columns = vec![times(source, rows)];
    columns.extend(signals(source, rows));
    for column in &mut columns[1..] {
        distorted(source, column);
    }
    for _ in 0..source.below(3) {
        columns.push((0..rows).map(|_| source.normal()).collect());
    }
    let separator = style.separator.to_string();
    let mut lines = Vec::new();
    if !source.chance(0.03) {
        lines.push(header(source, columns.len()).join(&separator));
    }
    if source.chance(0.05) {
        lines.insert(0, format!("# {}", source.name()));
    }
    for k in 0..rows {
        let cells: Vec<String> = columns
            .iter()
            .map(|column| style.number(column[k]))
            .collect();
        lines.push(cells.join(&separator));
    }
    let mut text = lines.join(style.line_end).into_bytes();
    match source.below(30) {
        0 => text.splice(0..0, *b"\xef\xbb\xbf").for_each(drop),
        1 => text = text.iter().flat_map(|&byte| [byte, 0]).collect(),
        2 => text.extend_from_slice(style.line_end.as_bytes()),
        3 => text = Vec::new(),
        _ => {}
    }
    if source.chance(0.3) {
        source.damaged(&text, style.separator)
    } else {
        text
    }
}

/// Arguments of a command with a record.
pub(super) fn command(source: &mut Source) -> String {
    let with_model = "data.csv --model model.toml";
    match source.below(12) {
        0 => format!(
            "diagnose {with_model} --effort quick --max-effects 1 --json out.json --report out.html"
        ),
        1 | 2 => {
            let methods = [
                "ct-rls",
                "stabilized-oe",
                "ls",
                "iv",
                "fcloe",
                "recursive-fcloe",
                "srivc",
                "rivc",
                "rivc",
            ];
            let method = source.pick(&methods);
            let model = [
                "",
                "--model model.toml",
                "--columns t,u,y",
                "--columns t,u+r,y",
            ][source.below(4)];
            let mut words = format!("identify data.csv {model} --method {method} --json out.json");
            if source.chance(0.3) {
                words += [" --order 2,1", " --order 4,4", " --order 3,0"][source.below(3)];
            }
            if method.ends_with("rivc") {
                match source.below(4) {
                    0 => words += " --delay auto",
                    1 => words += &format!(" --delay {}", source.number()),
                    2 => words += &format!(" --delay 0..{}", source.number()),
                    _ => {}
                }
                if source.chance(0.3) {
                    words += " --integrator";
                }
                if source.chance(0.2) {
                    words += " other.csv";
                }
            }
            words
        }
        3 => {
            let mut words = format!(
                "design {with_model} --effort quick --between overflow leak_at_height --out out.csv --json out.json"
            );
            for option in ["--duration", "--slew"] {
                if source.chance(0.3) {
                    words += &format!(" {option} {}", source.number());
                }
            }
            if source.chance(0.3) {
                words += &format!(" --range {} {}", source.number(), source.number());
            }
            words
        }
        4 => format!("compare {with_model} --test other.csv --json out.json"),
        5 => "compare data.csv other.csv --model model.toml --loop measured --json out.json"
            .to_string(),
        _ => format!("compare {with_model} --json out.json --report out.html"),
    }
}

/// Files that the commands write.
pub(super) const OUTPUTS: [&str; 3] = ["out.json", "out.html", "out.csv"];

/// A run on a record.
pub(super) fn case(source: &mut Source) -> Ended {
    let folder = Folder::with_threads(1 + source.below(2));
    folder.write("data.csv", text(source));
    folder.write("other.csv", models::record(source));
    folder.write("model.toml", models::plain(source));
    folder.run(&command(source), None, &OUTPUTS)
}
