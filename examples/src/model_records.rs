//! The records of the models in `examples/models`: what each model gives with parameters that its text does not have, and noise.
//!
//! They are made by the project's own simulator from fixed seeds, so that anybody can make the same bytes again:
//! `cargo run -p ctid-examples --bin make_records`.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{excitation, noise};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::tour_records::Result;

/// A column of a record.
#[derive(Debug)]
struct Column {
    /// Its head.
    head: &'static str,
    /// How many of its units are one of the model's.
    per_unit: f64,
    /// Digits behind the point.
    digits: usize,
}

/// How the record of a model is made.
#[derive(Debug)]
struct Recipe {
    name: &'static str,
    /// Head of the time's column, and interval \[its unit\].
    time: (&'static str, f64),
    rows: usize,
    /// Parameters and initial states whose values are not those of the text.
    truth: &'static [(&'static str, f64)],
    /// Inputs in the order of the model, ...
    inputs: &'static [Column],
    /// ... and their samples \[the column's unit\].
    drive: fn(usize, &mut ChaCha8Rng) -> Result<Vec<Vec<f64>>>,
    /// Whether inputs run in straight lines between rows, and are not held.
    lines: bool,
    /// Outputs in the order of the model, each with the standard deviation of its noise \[the column's unit\].
    outputs: &'static [(Column, f64)],
}

const fn column(head: &'static str, digits: usize) -> Column {
    Column {
        head,
        per_unit: 1.0,
        digits,
    }
}

/// A measured disturbance that goes up and down slowly.
fn slow(rows: usize, mean: f64, swing: f64, period: f64) -> Vec<f64> {
    let at = |k: usize| mean + swing * (2.0 * PI * k as f64 / period).sin();
    (0..rows).map(at).collect()
}

const RECIPES: [Recipe; 8] = [
    Recipe {
        name: "heated-block",
        time: ("t [s]", 5.0),
        rows: 500,
        truth: &[("C", 52.0), ("k", 0.17), ("g", 0.12), ("T", 23.0)],
        inputs: &[column("heater [%]", 1), column("room [degC]", 2)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 20..=80, 0.0, 100.0, rng)?,
                slow(n, 21.0, 1.5, 340.0),
            ])
        },
        lines: false,
        outputs: &[(column("block [degC]", 3), 0.1)],
    },
    Recipe {
        name: "coupled-heaters",
        time: ("t [s]", 4.0),
        rows: 600,
        truth: &[
            ("g1", 0.0145),
            ("g2", 0.0075),
            ("UA", 0.007),
            ("k", 0.018),
            ("eA", 0.0012),
            ("tau", 17.0),
            ("T1", 22.0),
            ("T2", 21.0),
            ("S1", 22.0),
            ("S2", 21.0),
        ],
        inputs: &[
            column("heater 1 [%]", 1),
            column("heater 2 [%]", 1),
            column("room [degC]", 2),
        ],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 30..=90, 0.0, 80.0, rng)?,
                excitation::steps(n, 40..=100, 0.0, 80.0, rng)?,
                slow(n, 21.0, 0.8, 500.0),
            ])
        },
        lines: false,
        outputs: &[
            (column("T1 [degC]", 2), 0.15),
            (column("T2 [degC]", 2), 0.25),
        ],
    },
    Recipe {
        name: "dc-motor",
        time: ("t [s]", 0.002),
        rows: 1000,
        truth: &[
            ("R", 1.38),
            ("L", 0.0031),
            ("K", 0.062),
            ("J", 0.00011),
            ("b", 0.00007),
            ("c", 0.009),
        ],
        inputs: &[column("u [V]", 1)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 15..=70, -12.0, 12.0, rng)?]),
        lines: false,
        outputs: &[(column("i [A]", 3), 0.04), (column("w [1/s]", 2), 0.8)],
    },
    Recipe {
        name: "mass-spring",
        time: ("t [s]", 0.04),
        rows: 800,
        truth: &[
            ("m", 1.2),
            ("k", 43.0),
            ("k3", 9000.0),
            ("d", 0.45),
            ("x", 0.02),
            ("v", -0.1),
        ],
        inputs: &[column("F [N]", 2)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 10..=60, -4.0, 4.0, rng)?]),
        lines: false,
        outputs: &[(
            Column {
                head: "x [mm]",
                per_unit: 1e3,
                digits: 2,
            },
            1.0,
        )],
    },
    Recipe {
        name: "house",
        time: ("t [h]", 0.5),
        rows: 672,
        truth: &[
            ("Ci", 2.6),
            ("Cw", 24.0),
            ("Ri", 0.9),
            ("Ro", 6.5),
            ("A", 3.1),
            ("Ti", 19.0),
            ("Tw", 16.0),
        ],
        inputs: &[
            column("heating [kW]", 2),
            Column {
                head: "sun [W/m2]",
                per_unit: 1e3,
                digits: 0,
            },
            column("outside [degC]", 1),
        ],
        drive: |n, rng| {
            let clouds = excitation::steps(n, 6..=40, 0.1, 1.0, rng)?;
            let weather = excitation::steps(n, 40..=120, -4.0, 6.0, rng)?;
            let hour = |k: usize| 0.5 * k as f64 % 24.0;
            let sun = |k: usize| (PI * (hour(k) - 7.0) / 10.0).sin().max(0.0);
            let night = |k: usize| -3.0 * (2.0 * PI * (hour(k) - 9.0) / 24.0).cos();
            Ok(vec![
                excitation::steps(n, 4..=30, 0.0, 5.0, rng)?,
                (0..n).map(|k| 550.0 * clouds[k] * sun(k)).collect(),
                (0..n).map(|k| weather[k] + night(k)).collect(),
            ])
        },
        lines: true,
        outputs: &[(column("rooms [degC]", 2), 0.08)],
    },
    Recipe {
        name: "bioreactor",
        time: ("t [h]", 0.25),
        rows: 600,
        truth: &[
            ("mu_max", 0.53),
            ("Ks", 1.2),
            ("Y", 0.5),
            ("kd", 0.03),
            ("X", 1.0),
            ("S", 6.0),
        ],
        inputs: &[column("D [1/h]", 3), column("Sf [g/l]", 1)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 20..=70, 0.05, 0.42, rng)?,
                excitation::steps(n, 60..=150, 6.0, 12.0, rng)?,
            ])
        },
        lines: false,
        outputs: &[(column("X [g/l]", 3), 0.05), (column("S [g/l]", 3), 0.1)],
    },
    Recipe {
        name: "battery",
        time: ("t [s]", 10.0),
        rows: 900,
        truth: &[
            ("E0", 3.32),
            ("E1", 0.78),
            ("E2", 0.45),
            ("R0", 0.046),
            ("R1", 0.031),
            ("C1", 2300.0),
        ],
        inputs: &[column("i [A]", 2)],
        drive: |n, rng| Ok(vec![excitation::steps(n, 6..=40, -0.9, 2.6, rng)?]),
        lines: false,
        outputs: &[(column("v [V]", 4), 0.002)],
    },
    Recipe {
        name: "quadruple-tank",
        time: ("t [s]", 5.0),
        rows: 700,
        truth: &[
            ("k1", 3.33),
            ("k2", 3.35),
            ("g1", 0.7),
            ("g2", 0.45),
            ("a1", 0.071),
            ("a2", 0.057),
            ("a3", 0.08),
            ("a4", 0.045),
            ("h1", 12.0),
            ("h2", 13.0),
            ("h3", 2.0),
            ("h4", 1.5),
        ],
        inputs: &[column("u1 [V]", 2), column("u2 [V]", 2)],
        drive: |n, rng| {
            Ok(vec![
                excitation::steps(n, 15..=60, 1.0, 4.5, rng)?,
                excitation::steps(n, 15..=60, 1.0, 4.5, rng)?,
            ])
        },
        lines: false,
        outputs: &[(column("h1 [cm]", 3), 0.08), (column("h2 [cm]", 3), 0.08)],
    },
];

/// Where the models are.
#[must_use]
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models")
}

/// A record of a model.
#[derive(Debug)]
pub struct ModelRecord {
    /// Of the model: its files are `name.mo`, `name.toml` and `name.csv`.
    pub name: &'static str,
    /// The record.
    pub csv: String,
    /// Standard deviation of each output's noise \[unit of the model\].
    pub noise: Vec<(String, f64)>,
    /// The parameters that made it.
    pub parameters: Vec<(String, f64)>,
    /// Their values in the text, in the same order.
    pub guesses: Vec<f64>,
}

/// The records of all models.
///
/// # Errors
/// Where a text cannot be read or has other names than the settings here, or cannot be simulated with them.
pub fn make() -> Result<Vec<ModelRecord>> {
    RECIPES.iter().zip(1..).map(record).collect()
}

/// A model with the parameters that make its record, and how it is driven.
#[derive(Debug)]
pub struct DrivenModel {
    /// Of the model: its files are `name.mo`, `name.toml` and `name.csv`.
    pub name: &'static str,
    /// The model as its text has it, but for the values of its parameters.
    pub spec: ModelSpec,
    /// The values of the text, in the order of the parameters.
    pub guesses: Vec<f64>,
    /// Initial states.
    pub initial: Vec<f64>,
    /// Rows of the record.
    pub rows: usize,
    /// Between two rows \[unit of the model's time\].
    pub interval: f64,
    /// Seconds in one unit of the model's time, and how that is written.
    pub time_unit: (f64, &'static str),
    /// Whether inputs run in straight lines between rows, and are not held.
    pub lines: bool,
    /// Standard deviation of each output's noise \[unit of the model\].
    pub noise: Vec<f64>,
    recipe: &'static Recipe,
}

impl DrivenModel {
    /// Samples of every input, as many digits as a file has \[unit of the model\].
    ///
    /// # Errors
    /// Where the settings of the excitation cannot be.
    pub fn inputs(&self, rows: usize, rng: &mut ChaCha8Rng) -> Result<Vec<Vec<f64>>> {
        let columns = self.columns(rows, rng)?;
        let of = |(samples, column): (Vec<f64>, &Column)| {
            samples.into_iter().map(|u| u / column.per_unit).collect()
        };
        Ok(columns
            .into_iter()
            .zip(self.recipe.inputs)
            .map(of)
            .collect())
    }

    /// The same in the units of the file's columns.
    fn columns(&self, rows: usize, rng: &mut ChaCha8Rng) -> Result<Vec<Vec<f64>>> {
        let mut inputs = (self.recipe.drive)(rows, rng)?;
        for (samples, column) in inputs.iter_mut().zip(self.recipe.inputs) {
            let scale = 10_f64.powi(column.digits as i32);
            for sample in samples {
                *sample = (*sample * scale).round() / scale;
            }
        }
        Ok(inputs)
    }
}

/// All models with what drives them.
///
/// # Errors
/// Where a text cannot be read or has other names than the settings here.
pub fn driven_models() -> Result<Vec<DrivenModel>> {
    RECIPES.iter().map(driven).collect()
}

fn driven(recipe: &'static Recipe) -> Result<DrivenModel> {
    let text = std::fs::read_to_string(folder().join(recipe.name).with_extension("mo"))?;
    let mut spec = ModelSpec::parse(&text)?;
    let guesses = spec
        .parameters
        .iter()
        .map(|parameter| parameter.value)
        .collect();
    let mut states = recipe.truth.to_vec();
    for parameter in &mut spec.parameters {
        let of_it = |(name, _): &(&str, f64)| *name == parameter.about.name;
        if let Some(i) = states.iter().position(of_it) {
            parameter.value = states.remove(i).1;
        }
    }
    let model = Model::new(spec);
    let mut initial = model.starts(&model.parameters());
    let spec = model.spec();
    for (name, value) in states {
        let i = spec.states.iter().position(|s| s.about.name == name);
        initial[i.ok_or_else(|| format!("{}: no {name}", recipe.name))?] = value;
    }
    Ok(DrivenModel {
        name: recipe.name,
        guesses,
        initial,
        rows: recipe.rows,
        interval: recipe.time.1,
        time_unit: if recipe.time.0.ends_with("[h]") {
            (3600.0, "h")
        } else {
            (1.0, "s")
        },
        lines: recipe.lines,
        noise: recipe
            .outputs
            .iter()
            .map(|(column, sigma)| sigma / column.per_unit)
            .collect(),
        spec: spec.clone(),
        recipe,
    })
}

fn record((recipe, seed): (&'static Recipe, u64)) -> Result<ModelRecord> {
    let driven = driven(recipe)?;
    let model = Model::new(driven.spec.clone());
    let spec = model.spec();
    let parameters = model.parameters();

    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // The simulator gets the inputs as the file will have them.
    let inputs = driven.columns(recipe.rows, &mut rng)?;
    let noise: Vec<Vec<f64>> = recipe
        .outputs
        .iter()
        .map(|(_, sigma)| noise::white(recipe.rows, *sigma, &mut rng))
        .collect();
    let at = |k: usize| -> Vec<f64> {
        let columns = inputs.iter().zip(recipe.inputs);
        columns.map(|(u, column)| u[k] / column.per_unit).collect()
    };

    let (head, interval) = recipe.time;
    let heads = recipe.inputs.iter().map(|column| column.head);
    let heads = heads.chain(recipe.outputs.iter().map(|(column, _)| column.head));
    let mut csv = heads.fold(head.to_string(), |line, head| line + "," + head) + "\n";
    let mut simulation = Simulation::new(&model, &parameters, &driven.initial, 0.0);
    let mut read = vec![0.0; spec.outputs.len()];
    for k in 0..recipe.rows {
        // A sum of intervals would drift away from what is written.
        let time = |k: usize| (k as f64 * interval * 1e6).round() / 1e6;
        simulation.read(&at(k), &mut read);
        write!(csv, "{}", time(k))?;
        for (u, column) in inputs.iter().zip(recipe.inputs) {
            write!(csv, ",{:.*}", column.digits, u[k])?;
        }
        for ((y, (column, _)), noise) in read.iter().zip(recipe.outputs).zip(&noise) {
            write!(csv, ",{:.*}", column.digits, y * column.per_unit + noise[k])?;
        }
        csv.push('\n');
        if k + 1 < recipe.rows {
            let to = at(if recipe.lines { k + 1 } else { k });
            simulation.advance(&at(k), &to, time(k + 1))?;
        }
    }
    let outputs = spec.outputs.iter().zip(&driven.noise);
    let noise = outputs.map(|(output, sigma)| {
        let name = spec.about(output.variable).name.clone();
        (name, *sigma)
    });
    let parameters = spec.parameters.iter();
    Ok(ModelRecord {
        name: recipe.name,
        csv,
        noise: noise.collect(),
        parameters: parameters
            .map(|parameter| (parameter.about.name.clone(), parameter.value))
            .collect(),
        guesses: driven.guesses,
    })
}
