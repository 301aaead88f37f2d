//! Records as people have them: with missing readings and rows, in several files, with dates, in other units. What is found has to be what
//! is found in the same record as a simulator writes it.

#![allow(clippy::unwrap_used)]

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use ct_signals::ReadOptions;
use ctid::input::Files;
use missing_effect::{Diagnosis, Options, Verdict, diagnose};
use plants::{Command, EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Rows of the bundled record: time, command and reading as they are written.
fn bundled() -> Vec<[String; 3]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/records/tour.csv");
    let text = fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let cells: Vec<String> = line.split(',').map(str::to_string).collect();
        cells.try_into().unwrap()
    };
    text.lines().skip(1).map(row).collect()
}

fn text(header: &str, rows: &[[String; 3]]) -> String {
    let rows = rows.iter().map(|row| row.join(",") + "\n");
    format!("{header}\n{}", rows.collect::<String>())
}

fn diagnosed(files: &[(&str, String)], model: &str) -> Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let files = Files {
        data: files.iter().map(|(name, text)| write(name, text)).collect(),
        test: Vec::new(),
        model: write("tank.toml", model),
        options: ReadOptions::default(),
    };
    let problem = files.read().unwrap().problem;
    diagnose(&problem, &Options::default(), &|_| {}).unwrap()
}

/// Name, value and standard error of the parameters that are not initial states.
fn parameters(diagnosis: &Diagnosis) -> Vec<(String, f64, f64)> {
    let last = diagnosis.steps.last().unwrap();
    let own = last.parameters.iter().filter(|p| !p.name.contains("(0)"));
    own.map(|p| (p.name.clone(), p.value, p.std_error.unwrap()))
        .collect()
}

#[track_caller]
fn same(found: &Diagnosis, whole: &Diagnosis, form: &str) {
    assert_eq!(found.verdict, whole.verdict, "{form}");
    assert_eq!(found.groups, whole.groups, "{form}");
    for (a, b) in parameters(found).iter().zip(parameters(whole)) {
        assert_eq!(a.0, b.0);
        assert!((a.1 - b.1).abs() < b.2, "{form}: {a:?}, whole {b:?}");
    }
}

const MODEL: &str = "plant = \"single-tank\"\n[columns]\ninput = \"u [V]\"\noutput = \"y [cm]\"\n[known]\narea = 154.0\n";

#[test]
fn the_same_record_in_other_forms_has_the_same_verdict() {
    let rows = bundled();
    let whole = diagnosed(&[("whole.csv", text("t [s],u [V],y [cm]", &rows))], MODEL);
    assert_eq!(whole.effects, ["overflow"]);

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut holes = rows.clone();
    for row in &mut holes {
        if rng.random_bool(0.3) {
            row[2] = "Bad".to_string();
        }
    }
    let found = diagnosed(&[("holes.csv", text("t [s],u [V],y [cm]", &holes))], MODEL);
    same(&found, &whole, "30 % of the readings missing");

    let block = [&rows[..400], &rows[410..]].concat();
    let found = diagnosed(&[("block.csv", text("t [s],u [V],y [cm]", &block))], MODEL);
    same(&found, &whole, "ten rows missing");
    let gaps = found.gaps.unwrap().gaps;
    assert_eq!((gaps.rows, gaps.places), (10, 1));
    // The result has one record nevertheless.
    assert_eq!(found.records.len(), 1);
    let last = found.steps.last().unwrap();
    assert_eq!(last.simulated[0].len(), found.records[0].time.len());

    let part = |k: usize| text("t [s],u [V],y [cm]", &rows[300 * k..300 * (k + 1)]);
    let found = diagnosed(
        &[("a.csv", part(0)), ("b.csv", part(1)), ("c.csv", part(2))],
        MODEL,
    );
    same(&found, &whole, "three files");

    let dated: Vec<[String; 3]> = rows
        .iter()
        .map(|[t, u, y]| {
            let seconds = t.parse::<f64>().unwrap() as usize;
            let (hour, minute, second) = (12 + seconds / 3600, seconds / 60 % 60, seconds % 60);
            [
                format!("2026-05-01 {hour}:{minute:02}:{second:02}"),
                u.clone(),
                y.clone(),
            ]
        })
        .collect();
    let found = diagnosed(&[("dated.csv", text("t,u [V],y [cm]", &dated))], MODEL);
    same(&found, &whole, "dates");

    let minutes: Vec<[String; 3]> = rows
        .iter()
        .map(|[t, u, y]| {
            [
                (t.parse::<f64>().unwrap() / 60.0).to_string(),
                u.clone(),
                y.clone(),
            ]
        })
        .collect();
    let found = diagnosed(
        &[("minutes.csv", text("t [min],u [V],y [cm]", &minutes))],
        MODEL,
    );
    same(&found, &whole, "minutes");

    let metres: Vec<[String; 3]> = rows
        .iter()
        .map(|[t, u, y]| {
            [
                t.clone(),
                u.clone(),
                (y.parse::<f64>().unwrap() / 100.0).to_string(),
            ]
        })
        .collect();
    let found = diagnosed(&[("metres.csv", text("t [s],u [V],y [m]", &metres))], MODEL);
    same(&found, &whole, "metres");
}

/// A vessel whose outlet clogs, over 26 h, a row a minute: its content in litres, the inlet valve in percent.
fn clogging(change: f64, seed: u64) -> Vec<(f64, f64)> {
    const ROWS: usize = 1560;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scales = Scales::from_ranges((20.0, 60.0), (100.0, 900.0), 60.0, 60.0 * ROWS as f64);
    let drift = EffectInfo::find("valve_drift").unwrap();
    let structure = Structure::new(Plant::SingleTank, Known::default(), scales)
        .with(Placed {
            effect: drift,
            vessel: 0,
        })
        .unwrap();
    let theta = [0.015, 0.04, change];
    let mut simulator = Simulator::new(&structure, &theta, &[220.0], 40.0).unwrap();
    let (mut valve, mut left) = (40.0, 0);
    (0..ROWS)
        .map(|_| {
            if left == 0 {
                valve = 5.0 * f64::from(rng.random_range(4..=12));
                left = rng.random_range(40..=120);
            }
            left -= 1;
            let noise: f64 = rng.sample(StandardNormal);
            let content = simulator.read(0) + 0.8 * noise;
            simulator.advance(Command::held(valve), 60.0);
            (valve, content)
        })
        .collect()
}

/// In the format of a historian: semicolons, decimal commas, ISO stamps, and 18 rows missing in 7 places.
fn exported(rows: &[(f64, f64)]) -> String {
    let gaps = [
        (100, 3),
        (333, 1),
        (500, 4),
        (777, 2),
        (900, 5),
        (1200, 1),
        (1400, 2),
    ];
    let mut text = "Zeit;Ventil [%];Inhalt [l]\n".to_string();
    for (k, (valve, content)) in rows.iter().enumerate() {
        if gaps
            .iter()
            .any(|&(from, count)| (from..from + count).contains(&k))
        {
            continue;
        }
        let (day, minutes) = (2 + (360 + k) / 1440, (360 + k) % 1440);
        let cells = format!("{valve:.1};{content:.2}").replace('.', ",");
        writeln!(
            text,
            "2026-03-{day:02}T{:02}:{:02}:00;{cells}",
            minutes / 60,
            minutes % 60
        )
        .unwrap();
    }
    text
}

#[test]
fn a_clogging_valve_is_found_in_a_historians_export() {
    let model = "plant = \"single-tank\"\n[columns]\ntime = \"Zeit\"\ninput = \"Ventil [%]\"\noutput = \"Inhalt [l]\"\n";
    let whole = exported(&clogging(-0.35, 1));
    let found = diagnosed(&[("plant.csv", whole.clone())], model);
    assert_eq!(
        (found.verdict, &found.effects[..]),
        (Verdict::Effect, &["valve_drift".to_string()][..])
    );
    let change = &parameters(&found)[2];
    assert!((change.1 + 0.35).abs() < 4.0 * change.2, "{change:?}");
    let gaps = found.gaps.unwrap().gaps;
    assert_eq!((gaps.rows, gaps.places, gaps.held + gaps.cut), (18, 7, 7));

    // In two files the drift runs on; each by itself would begin its own.
    let lines: Vec<&str> = whole.lines().collect();
    let (head, rest) = lines.split_first().unwrap();
    let part = |rows: &[&str]| format!("{head}\n{}\n", rows.join("\n"));
    let (first, second) = rest.split_at(700);
    let found = diagnosed(
        &[("monday.csv", part(first)), ("tuesday.csv", part(second))],
        model,
    );
    assert_eq!(found.effects, ["valve_drift"]);
    let change = &parameters(&found)[2];
    assert!((change.1 + 0.35).abs() < 4.0 * change.2, "{change:?}");

    // The model of a vessel without clogging is adequate.
    let found = diagnosed(&[("sound.csv", exported(&clogging(0.0, 2)))], model);
    assert_eq!(found.verdict, Verdict::Adequate, "{:?}", found.effects);
}

#[test]
fn files_in_the_wrong_order_are_refused_in_one_line() {
    let whole = exported(&clogging(0.0, 3));
    let lines: Vec<&str> = whole.lines().collect();
    let (head, rest) = lines.split_first().unwrap();
    let part = |rows: &[&str]| format!("{head}\n{}\n", rows.join("\n"));
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("first.csv"), part(&rest[..700])).unwrap();
    fs::write(path("second.csv"), part(&rest[700..])).unwrap();
    let model = "plant = \"single-tank\"\n[columns]\ntime = \"Zeit\"\ninput = \"Ventil\"\noutput = \"Inhalt\"\n";
    fs::write(path("tank.toml"), model).unwrap();
    let files = Files {
        data: vec![path("second.csv"), path("first.csv")],
        test: Vec::new(),
        model: path("tank.toml"),
        options: ReadOptions::default(),
    };
    let message = files.read().unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    for words in [
        "first.csv",
        "2026-03-02 06:00",
        "second.csv ends",
        "order of their dates",
    ] {
        assert!(message.contains(words), "no {words:?} in: {message}");
    }
}
