//! `ctid simulate`, `ctid export` and `ctid identify` with users' own models, from the program's outside.

mod export;
mod linear;

use std::fmt::Write;

use crate::common::{Place, Random};

const BLOCK: &str = r#"model HeatedBlock "a block with a heater, in a room"
  parameter Real C(unit="J/K", min=0) = 50 "heat capacity";
  parameter Real k(unit="W/K", min=0) = 0.1 "loss to the room";
  parameter Real g(unit="W", min=0) = 0.02 "heater, per percent";
  input Real u(unit="%");
  input Real Ta(unit="degC") "room";
  output Real y(unit="degC") = T;
  output Real loss(unit="W") = k*(T - Ta);
  Real T(unit="degC", start=20) "block";
equation
  C*der(T) = g*u - loss;
end HeatedBlock;
"#;

const FILE: &str = r#"model = "block.mo"
[columns]
time = "t [s]"
u = "heater [%]"
Ta = "room [degC]"
y = "block [degC]"
loss = "loss [W]"
[known]
C = 52.0
"#;

/// `k`, `g`, and where the block begins.
const TRUTH: (f64, f64, f64) = (0.13, 0.05, 25.0);

/// Rows of time, heater, room, block and loss, by the closed form of its steps; `noise` is of the reading of the block.
fn record(rows: usize, seed: u64, noise: f64, begin: f64) -> Vec<[f64; 5]> {
    let mut random = Random(seed);
    let mut draw = || random.next() as f64 / u64::MAX as f64;
    let (k, g, _) = TRUTH;
    let decay = (-k * 10.0 / 52.0).exp();
    let (mut t, mut u, mut all) = (begin, 0.0, Vec::new());
    for row in 0..rows {
        if row % 25 == 0 {
            u = 100.0 * draw();
        }
        let room = 20.0 + 2.0 * (row as f64 / 30.0).sin();
        // The sum of six uniform numbers is nearly normal.
        let mut v = || noise * ((0..6).map(|_| draw()).sum::<f64>() - 3.0) * 2.0_f64.sqrt();
        let loss = k * (t - room);
        all.push([10.0 * row as f64, u, room, t + v(), loss + 0.1 * v()]);
        t = decay * t + (1.0 - decay) * (room + g * u / k);
    }
    all
}

/// As CSV, the first `readings` rows with readings of the outputs; without these columns if there are none.
fn csv(rows: &[[f64; 5]], readings: usize) -> String {
    let head = "t [s],heater [%],room [degC]";
    let mut text = match readings {
        0 => format!("{head}\n"),
        _ => format!("{head},block [degC],loss [W]\n"),
    };
    for (k, [t, u, room, y, loss]) in rows.iter().enumerate() {
        write!(text, "{t},{u},{room}").unwrap();
        match readings {
            0 => {}
            readings if k < readings => write!(text, ",{y},{loss}").unwrap(),
            _ => text += ",,",
        }
        text.push('\n');
    }
    text
}

fn place() -> Place {
    let place = Place::empty();
    place.write("block.mo", BLOCK);
    place.write("m.toml", FILE);
    place.write("a.csv", csv(&record(300, 1, 0.05, TRUTH.2), 300));
    place.write("b.csv", csv(&record(200, 2, 0.05, 22.0), 200));
    place.write("in.csv", csv(&record(150, 3, 0.05, 20.0), 0));
    place.write("begun.csv", csv(&record(150, 3, 0.05, 31.0), 7));
    place
}

/// Header and rows of a file.
fn table(text: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut rows = text
        .lines()
        .map(|line| line.split(',').map(str::to_string).collect());
    (rows.next().unwrap(), rows.collect())
}

fn column(text: &str, name: &str) -> Vec<f64> {
    let (head, rows) = table(text);
    let at = head.iter().position(|own| own == name);
    assert!(at.is_some(), "{name} is not in {head:?}");
    let at = at.unwrap();
    let number = |row: &Vec<String>| row[at].parse().unwrap_or(f64::NAN);
    rows.iter().map(number).collect()
}

#[test]
fn new_inputs_are_simulated_with_a_band() {
    let place = place();
    let said = place.succeeds("simulate m.toml in.csv --fit a.csv b.csv --out y.csv --readings");
    assert!(
        said.contains("fitted to a.csv, b.csv") && said.contains("from the model text"),
        "{said}"
    );
    let text = place.read("y.csv");
    let (head, rows) = table(&text);
    let own = ["", " lower", " upper", " reading lower", " reading upper"];
    let mut expected = vec!["t [s]".to_string()];
    expected.extend(own.map(|what| format!("block{what} [degC]")));
    expected.extend(own.map(|what| format!("loss{what} [W]")));
    assert_eq!((head, rows.len()), (expected, 150));
    let clean = record(150, 3, 0.0, 20.0);
    let [mean, low, high] = own[..3].try_into().unwrap();
    let of = |what: &str| column(&text, &format!("block{what} [degC]"));
    let (mean, low, high) = (of(mean), of(low), of(high));
    for (k, row) in clean.iter().enumerate() {
        assert!(low[k] <= mean[k] && mean[k] <= high[k]);
        assert!(
            (mean[k] - row[3]).abs() < 0.03,
            "row {k}: {} {}",
            mean[k],
            row[3]
        );
        assert!(high[k] - low[k] < 0.06, "row {k}");
    }
    // A reading varies with its noise.
    let wide = column(&text, "block reading upper [degC]")[70] - mean[70];
    assert!((0.08..0.13).contains(&wide), "{wide}");
    // If the first state is known exactly, its band has zero width.
    assert_eq!(low[0], high[0]);
    // The same as JSON.
    place.succeeds("simulate m.toml in.csv --fit a.csv b.csv --out y2.csv --json y.json");
    let json = place.json("y.json");
    assert_eq!(json["outputs"][0]["mean"][149].as_f64(), Some(mean[149]));
    let half = json["outputs"][0]["band"]["output"][149].as_f64().unwrap();
    assert!((half - (high[149] - mean[149])).abs() < 1e-12);
    assert_eq!(
        (&json["states_from"], &json["written_by"]),
        (&"text".into(), &"ctid".into())
    );
}

#[test]
fn initial_states_follow_the_first_readings() {
    let place = place();
    let said = place.succeeds("simulate m.toml begun.csv --fit a.csv --out y.csv");
    assert!(said.contains("fitted to the first readings"), "{said}");
    let text = place.read("y.csv");
    let (mean, low, high) = (
        column(&text, "block [degC]"),
        column(&text, "block lower [degC]"),
        column(&text, "block upper [degC]"),
    );
    let clean = record(150, 3, 0.0, 31.0);
    assert!(
        (mean[0] - 31.0).abs() < 0.1 && high[0] - low[0] > 0.01,
        "{}",
        mean[0]
    );
    assert!((mean[149] - clean[149][3]).abs() < 0.05);
    // The initial state is forgotten, and so is its error.
    assert!(high[149] - low[149] < 0.5 * (high[0] - low[0]));
    // More readings, a narrower band.
    place.write("begun.csv", csv(&record(150, 3, 0.05, 31.0), 40));
    place.succeeds("simulate m.toml begun.csv --fit a.csv --out more.csv --initial 40");
    let more = place.read("more.csv");
    let width = column(&more, "block upper [degC]")[0] - column(&more, "block lower [degC]")[0];
    assert!(width < 0.7 * (high[0] - low[0]), "{width}");
}

#[test]
fn without_a_fit_the_values_of_the_text_are_used() {
    let place = place();
    let said = place.succeeds("simulate m.toml in.csv --out y.csv");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("no band without --fit"), "{said}");
    let (head, _) = table(&place.read("y.csv"));
    assert_eq!(head, ["t [s]", "block [degC]", "loss [W]"]);
    // One step by the analytic solution: C from [known], k and g of the text.
    let first = record(2, 3, 0.0, 20.0)[0];
    let decay = (-0.1 * 10.0 / 52.0_f64).exp();
    let expected = decay * 20.0 + (1.0 - decay) * (first[2] + 0.02 * first[1] / 0.1);
    let own = column(&place.read("y.csv"), "block [degC]")[1];
    assert!((own - expected).abs() < 1e-9, "{own} {expected}");
}

#[test]
fn dates_are_written_as_dates() {
    let place = place();
    let rows = record(60, 3, 0.0, 20.0);
    let mut text = "when,heater [%],room [degC]\n".to_string();
    for [t, u, room, ..] in &rows {
        let t = *t as u64;
        writeln!(text, "2026-10-25 00:{:02}:{:02},{u},{room}", t / 60, t % 60).unwrap();
    }
    place.write("in.csv", text);
    let file = FILE.replace(
        "time = \"t [s]\"",
        "time = \"when\"\ntime_zone = \"Europe/Berlin\"",
    );
    place.write("m.toml", file);
    place.succeeds("simulate m.toml in.csv --out y.csv");
    let (head, rows) = table(&place.read("y.csv"));
    assert_eq!(head[0], "when");
    assert_eq!(rows[0][0], "2026-10-25 00:00+02:00");
    assert_eq!(rows[7][0], "2026-10-25 00:01:10+02:00");
}

#[test]
fn what_cannot_be_simulated_is_refused_in_one_line() {
    let place = place();
    place.write("there.csv", "my own notes\n");
    place.refuses(
        "simulate m.toml in.csv --out there.csv",
        &["there.csv", "the file exists already"],
    );
    place.refuses(
        "simulate m.toml in.csv --out in.csv",
        &["in.csv", "one of the inputs"],
    );
    let text = place.read("in.csv");
    let without = text
        .lines()
        .map(|line| line.rsplit_once(',').unwrap().0.to_string() + "\n");
    place.write("cut.csv", without.collect::<String>());
    place.refuses(
        "simulate m.toml cut.csv --out y.csv",
        &[
            "cut.csv, row 1",
            "no column \"room [degC]\"",
            "set Ta = \"...\" under [columns]",
        ],
    );
    let lines: Vec<&str> = text.lines().collect();
    place.write("gap.csv", [&lines[..40], &lines[46..]].concat().join("\n"));
    place.refuses(
        "simulate m.toml gap.csv --out y.csv",
        &[
            "gap.csv: 6 rows are missing, the first after 380 s",
            "--from and --to",
        ],
    );
    let mut cells: Vec<String> = lines.iter().map(ToString::to_string).collect();
    cells[12] = "110,,20".to_string();
    place.write("hole.csv", cells.join("\n"));
    place.refuses(
        "simulate m.toml hole.csv --out y.csv",
        &["hole.csv: column \"heater [%]\": 1 of 150 samples are missing, the first at 110 s"],
    );
    place.refuses(
        "simulate m.toml in.csv --fit in.csv --out y.csv",
        &["in.csv", "block [degC]"],
    );
    place.refuses("simulate m.toml in.csv --out y.csv --readings", &["--fit"]);
    place.refuses(
        "simulate m.toml in.csv --out y.csv --initial 0",
        &["whole number above zero"],
    );
    // A model that diverges.
    place.write(
        "block.mo",
        BLOCK.replace("= g*u - loss", "= g*u - loss + T*T"),
    );
    place.refuses(
        "simulate m.toml in.csv --out y.csv",
        &[
            "in.csv: the simulation of HeatedBlock cannot continue after",
            "grows without bound",
        ],
    );
}

#[test]
fn a_plant_is_simulated_too() {
    let place = Place::new();
    place.refuses(
        "simulate tour.toml tour-test.csv --out y.csv",
        &["--fit DATA.csv"],
    );
    place.succeeds("add overflow --model tour.toml");
    place.succeeds("simulate tour.toml tour-test.csv --fit tour.csv --out y.csv");
    let (text, measured) = (place.read("y.csv"), place.read("tour-test.csv"));
    let (mean, y) = (column(&text, "y [cm]"), column(&measured, "y [cm]"));
    let low = column(&text, "y lower [cm]");
    assert_eq!(mean.len(), y.len());
    let squares: f64 = mean.iter().zip(&y).map(|(m, y)| (m - y).powi(2)).sum();
    let rms = (squares / y.len() as f64).sqrt();
    assert!(rms < 0.06, "{rms}");
    assert!(
        low.iter()
            .zip(&mean)
            .all(|(low, mean)| mean - low < 0.2 && low <= mean)
    );
    // Without readings the simulation begins at rest.
    let inputs = measured
        .lines()
        .map(|line| line.rsplit_once(',').unwrap().0.to_string() + "\n");
    place.write("in.csv", inputs.collect::<String>());
    let said = place.succeeds("simulate tour.toml in.csv --fit tour.csv --out rest.csv");
    assert!(said.contains("at rest under the first inputs"), "{said}");
    let at_rest = column(&place.read("rest.csv"), "y [cm]");
    assert!((at_rest[0] - at_rest[1]).abs() < 1e-6 * at_rest[0]);
    let (own, other) = (at_rest.last().unwrap(), mean.last().unwrap());
    assert!((own - other).abs() < 0.01, "{own} {other}");
}
