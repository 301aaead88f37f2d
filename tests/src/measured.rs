//! Measured records in `../shared` beside the checkout, each with the model that is believed of it and what is known to be missing.
//!
//! The records are not part of the repository. `real/README.md` there says where each comes from, and what its authors document.

use std::path::{Path, PathBuf};

use ct_signals::{Channel, Columns, ReadOptions, Record, read_csv};
use missing_effect::{Diagnosis, Problem, Verdict};
use plants::{Known, Plant};

/// Seconds in a day.
const DAY: f64 = 86_400.0;
/// Held-out error that the cascaded tanks have to reach \[V\]: a neural state space model's.
const TANKS_HELD_OUT: f64 = 0.33;

/// Source of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// Control loops of a plant, labelled as sticking.
    StickingValve,
    /// Control loops of a plant, labelled as not sticking.
    FreeValve,
    /// A groundwater head under rain less evaporation.
    Groundwater,
    /// A heater and its temperature.
    Heater,
    /// The cascaded tanks benchmark.
    Tanks,
}

impl Source {
    /// All sources.
    pub const ALL: [Self; 5] = [
        Self::StickingValve,
        Self::FreeValve,
        Self::Groundwater,
        Self::Heater,
        Self::Tanks,
    ];

    /// In words, with what is known to be missing.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::StickingValve => "valve loops that stick: stiction",
            Self::FreeValve => "valve loops that do not: no stiction",
            Self::Groundwater => "groundwater: a drain above a level",
            Self::Heater => "heaters: a lag of the sensor",
            Self::Tanks => "cascaded tanks: overflow and dead zone",
        }
    }
}

/// Comparison of a result with the known facts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// The missing effect is in a named group; for a valve without stiction: no stiction is named.
    Right,
    /// A part of it, or what a person would accept as near to it.
    Partly,
    /// No effect is named.
    Silent,
    /// Another effect is named.
    Wrong,
}

impl Mark {
    /// Printed name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Partly => "partly",
            Self::Silent => "silent",
            Self::Wrong => "wrong",
        }
    }
}

/// A measured record with its believed model.
#[derive(Debug, Clone)]
pub struct Case {
    /// Folder, file and, of several outputs, which.
    pub name: String,
    /// Source of the record.
    pub source: Source,
    /// The believed model and the records.
    pub problem: Problem,
}

/// Something of the catalogue is named.
#[must_use]
pub fn named(found: &Diagnosis) -> bool {
    matches!(
        found.verdict,
        Verdict::Effect | Verdict::Undecided | Verdict::Partial
    )
}

/// An effect is in a group that is named.
#[must_use]
pub fn in_a_group(found: &Diagnosis, effect: &str) -> bool {
    named(found) && found.groups.iter().flatten().any(|member| member == effect)
}

/// The command is said to answer to the noise.
#[must_use]
pub fn claims_feedback(found: &Diagnosis) -> bool {
    let claims = |known: &missing_effect::ControlLoop| known.feedback_p.is_some();
    found.control_loop.as_ref().is_some_and(claims)
}

impl Case {
    /// Compares a result with the known facts about the record.
    ///
    /// - A drain above a level is partly right where feedback is claimed too: no weather answers to a groundwater head.
    /// - Of a heater a lag of the pump is as right as one of the sensor (one heater's power is not measured); a dead time or a side
    ///   tank, which stores heat, is near.
    /// - Of the tanks, one of the two effects, or both with a larger held-out error, is partly right.
    #[must_use]
    pub fn mark(&self, found: &Diagnosis) -> Mark {
        let has = |effect| in_a_group(found, effect);
        let (right, partly) = match self.source {
            Source::StickingValve => (has("stiction_backlash"), false),
            Source::FreeValve => {
                return if has("stiction_backlash") {
                    Mark::Wrong
                } else {
                    Mark::Right
                };
            }
            Source::Groundwater => {
                let drain = has("leak_at_height");
                (drain && !claims_feedback(found), drain)
            }
            Source::Heater => (
                has("sensor_lag") || has("pump_lag"),
                has("transport_delay") || has("coupled_tank"),
            ),
            Source::Tanks => {
                let (rim, zone) = (has("overflow"), has("pump_deadzone"));
                let held_out = found.steps.last().and_then(|step| step.rmse_test);
                let near = held_out.is_some_and(|error| error <= TANKS_HELD_OUT);
                (rim && zone && near, rim || zone)
            }
        };
        match (named(found), right, partly) {
            (false, ..) => Mark::Silent,
            (true, true, _) => Mark::Right,
            (true, false, true) => Mark::Partly,
            (true, false, false) => Mark::Wrong,
        }
    }
}

/// The folder of the measured records; `None` where it does not lie beside the checkout.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    folder.join("real").exists().then_some(folder)
}

/// Every measured record whose name contains `filter`, or why it was rejected.
#[must_use]
pub fn cases(filter: &str) -> Vec<(String, Result<Case, String>)> {
    let Some(shared) = folder() else {
        return Vec::new();
    };
    let mut all: Vec<(String, Make)> = Vec::new();
    let valves = shared.join("real/valve_loops");
    let files = csv_files(&valves);
    for (at, file) in files.iter().enumerate() {
        // The next file of the same loop takes no part in the fit.
        let of_loop: Vec<usize> = (0..files.len())
            .filter(|&other| loop_of(&files[other]) == loop_of(file))
            .collect();
        let next = of_loop.iter().find(|&&other| other > at);
        let test = next.or(of_loop.first()).filter(|&&other| other != at);
        let (path, test) = (
            valves.join(file),
            test.map(|&other| valves.join(&files[other])),
        );
        let source = if file.starts_with("S_") {
            Source::StickingValve
        } else {
            Source::FreeValve
        };
        all.push((
            format!("valve_loops/{file}"),
            Box::new(move || {
                Ok((
                    source,
                    valve(&path)?,
                    test.iter().filter_map(|p| valve(p).ok()).collect(),
                ))
            }),
        ));
    }
    let water = shared.join("real/groundwater_threshold");
    all.push((
        "groundwater_threshold".to_string(),
        Box::new(move || {
            let read = |file| groundwater(&water.join(file));
            Ok((
                Source::Groundwater,
                read("fit.csv")?,
                vec![read("test.csv")?],
            ))
        }),
    ));
    let board = shared.join("real/tclab");
    for (file, test, outputs) in HEATERS {
        for &output in *outputs {
            let board = board.clone();
            all.push((
                format!("tclab/{file} T{output}"),
                Box::new(move || {
                    let read = |file: &str| heater(&board.join(format!("{file}.csv")), output);
                    let test = test.map(read).transpose()?;
                    Ok((Source::Heater, read(file)?, test.into_iter().collect()))
                }),
            ));
        }
    }
    let tanks = shared.join("data/cascaded_tanks");
    all.push((
        "cascaded_tanks".to_string(),
        Box::new(move || {
            let read = |file| csv(&tanks.join(file), &Columns::default());
            Ok((
                Source::Tanks,
                read("estimation.csv")?,
                vec![read("test.csv")?],
            ))
        }),
    ));
    all.retain(|(name, _)| name.contains(filter));
    all.into_iter()
        .map(|(name, make)| {
            let case = make().map(|(source, record, test)| Case {
                name: name.clone(),
                source,
                problem: problem(source, record, test),
            });
            (name, case)
        })
        .collect()
}

/// The only record of that name.
///
/// # Errors
/// Where there is none, there are several, or it is refused.
pub fn case(name: &str) -> Result<Case, String> {
    let mut found = cases(name);
    match (found.pop(), found.is_empty()) {
        (Some((_, case)), true) => case,
        (Some(_), false) => Err(format!("several records are named {name}")),
        (None, _) => Err(format!("there is no record {name}")),
    }
}

/// Reads a record and those that are held out.
type Make = Box<dyn Fn() -> Result<(Source, Record, Vec<Record>), String>>;

/// Runs of the board: the file, that of another run under the same conditions, and the heaters that move in it. Both files of
/// random steps and both of the validation runs are pairs.
const HEATERS: &[(&str, Option<&str>, &[usize])] = &[
    ("single_heater_600s", None, &[1]),
    (
        "open_loop_cace_validation_1h",
        Some("open_loop_cace_validation_2h"),
        &[1],
    ),
    ("open_loop_cace_validation_2h", None, &[1, 2]),
    ("open_loop_mimo_599s", None, &[1, 2]),
    ("open_loop_mhe_run", None, &[1, 2]),
    (
        "open_loop_random_steps_a",
        Some("open_loop_random_steps_b"),
        &[1, 2],
    ),
    (
        "open_loop_random_steps_b",
        Some("open_loop_random_steps_a"),
        &[1, 2],
    ),
];

#[allow(clippy::expect_used)]
fn problem(source: Source, record: Record, test: Vec<Record>) -> Problem {
    let plant = if source == Source::Tanks {
        Plant::CascadedTanks
    } else {
        Plant::SingleTankLinear
    };
    let problem = Problem::builder(plant, Known::default(), [record]);
    problem.test(test).build().expect("records of the plant")
}

fn csv_files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".csv"))
        .collect();
    files.sort();
    files
}

/// The loop of a file `S_<loop>_<date>_<number>.csv`.
fn loop_of(file: &str) -> Option<&str> {
    file.rsplitn(3, '_').last()
}

fn csv(path: &Path, columns: &Columns) -> Result<Record, String> {
    let reading = read_csv(path, columns, &ReadOptions::default());
    reading
        .map(|reading| reading.record)
        .map_err(|why| why.to_string())
}

fn valve(path: &Path) -> Result<Record, String> {
    csv(
        path,
        &Columns {
            time: Some("t_s".to_string()),
            inputs: vec!["op_pct".to_string()],
            outputs: vec!["pv".to_string()],
            references: vec!["sp".to_string()],
            ..Columns::default()
        },
    )
}

fn heater(path: &Path, number: usize) -> Result<Record, String> {
    csv(
        path,
        &Columns {
            time: Some("t_s".to_string()),
            inputs: vec![format!("Q{number}_pct")],
            outputs: vec![format!("T{number}_C")],
            ..Columns::default()
        },
    )
}

/// Rain less evaporation, and the head; days on which the head was not observed are left out.
fn groundwater(path: &Path) -> Result<Record, String> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|why| format!("{name}: {why}"))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |wanted: &str| {
        let at = header.iter().position(|own| *own == wanted);
        at.ok_or(format!("{name}: no column {wanted}"))
    };
    let (day, rain, evaporation, head) = (
        column("t_d")?,
        column("P_m")?,
        column("E_m")?,
        column("h_m")?,
    );
    let (mut time, mut input, mut output) = (Vec::new(), Vec::new(), Vec::new());
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |at: usize| cells.get(at).copied().unwrap_or_default().trim();
        if cell(head).is_empty() {
            continue;
        }
        let number = |at: usize| {
            let value = cell(at).parse::<f64>();
            value.map_err(|why| format!("{name}: {line}: {why}"))
        };
        time.push(number(day)? * DAY);
        input.push(number(rain)? - number(evaporation)?);
        output.push(number(head)?);
    }
    let record = Record {
        name,
        time,
        inputs: vec![Channel::new("P - E", "m", input)],
        outputs: vec![Channel::new("h", "m", output)],
        ..Record::default()
    };
    record.validate().map_err(|why| why.to_string())?;
    Ok(record)
}
