//! The records of the models in `examples/models`: what each model gives with parameters that its text does not have, and noise.
//!
//! They are made by the project's own simulator from fixed seeds, so that anybody can make the same bytes again:
//! `cargo run -p ctid-examples --bin make_records`.

mod recipes;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::noise;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use self::recipes::{Column, RECIPES, Recipe};
use crate::tour_records::Result;

/// Folder of the models.
#[must_use]
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models")
}

/// A record of a model.
#[derive(Debug)]
pub struct ModelRecord {
    /// Name of the model: its files are `name.mo`, `name.toml` and `name.csv`.
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

    /// The record in the units of the file's columns.
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

/// All models with their inputs.
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
