//! `ctid simulate`: simulation of a model for inputs without measured outputs.
//!
//! | what | where |
//! |---|---|
//! | a user's own model | `own_model/simulate.rs` |
//! | one of the plants | `plant.rs` |
//! | the inputs, read and checked | `inputs.rs` |
//! | what a person reads | `text.rs` |
//!
//! `ctid export` shares its time column and its fits: `curves.rs`, `plant_export.rs`, `plant_text.rs`, `own_model/export.rs`.

mod curves;
mod inputs;
mod plant;
mod plant_export;
mod plant_text;
mod text;
mod time_column;

use greybox::FitUncertainty;
use serde::Serialize;

pub(crate) use self::curves::{Curves, FittedRecord};
pub(crate) use self::inputs::{
    Inputs, ReadInputs, begins_with_readings, of_first_readings, read_inputs,
};
pub use self::plant::of_plant;
pub(crate) use self::plant::simulate as simulate_plant;
pub(crate) use self::plant_export::export as export_plant;
pub use self::plant_export::text_of_plant;
pub(crate) use self::text::said;
pub use self::time_column::TimeColumn;
use crate::csv_text::{cell, csv_text, header};
use crate::output::Found;

/// Coverage of the band.
pub(crate) const LEVEL: f64 = 0.95;
/// Number of first readings of each output for the fit of initial states, as for a held-out record.
pub(crate) const FIRST_READINGS: usize = 5;

/// Half the widths of the bands of an output \[its unit\].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// Standard error of the model's output from the uncertainty of parameters and initial states, row by row.
    pub output: Vec<f64>,
    /// Standard error of a reading: the model's output and the noise.
    pub reading: Vec<f64>,
}

/// A simulated output.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedOutput {
    /// Column of the measured signal, without its unit.
    pub name: String,
    /// Unit; empty if not known.
    pub unit: String,
    /// Row by row.
    pub mean: Vec<f64>,
    /// Band; only if the model was fitted and the records determine its parameters.
    pub band: Option<Band>,
    /// Measured values, NaN if missing.
    #[serde(skip)]
    pub measured: Vec<f64>,
}

/// Source of an initial state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StateSource {
    /// Fitted to the first readings.
    Readings,
    /// The model's text.
    Text,
    /// Steady state of the plant under the first inputs.
    Rest,
}

/// Result of `ctid simulate`.
#[derive(Debug, Serialize)]
pub struct Simulated {
    /// Version of this layout.
    pub schema: u32,
    /// The model.
    pub model: String,
    /// The effects in a model as text.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<String>,
    /// The record of its inputs.
    pub inputs: String,
    /// The records of the fit; empty if the values come from the text.
    pub fitted_to: Vec<String>,
    /// The parameters' names, values and standard errors.
    pub parameters: Vec<(String, f64, Option<f64>)>,
    /// The initial states' names and values.
    pub states: Vec<(String, f64)>,
    /// Source of the initial states.
    pub states_from: StateSource,
    /// Coverage of each band.
    pub level: f64,
    /// The outputs, in the order of the model.
    pub outputs: Vec<SimulatedOutput>,
    /// Warnings about the use of the simulation.
    pub warnings: Vec<String>,
    /// Length of the record \[s\].
    #[serde(skip)]
    pub length: f64,
    /// Time of each row.
    pub time: TimeColumn,
    /// Whether the bands of readings are written too.
    #[serde(skip)]
    pub readings: bool,
}

impl Band {
    /// Band of one output, from the standard errors of its mean.
    pub fn of(errors: &[f64], known: &FitUncertainty, output: usize, level: f64) -> Self {
        let quantile = known.quantile(level);
        let noise = known.reading[output];
        Self {
            output: errors.iter().map(|error| quantile * error).collect(),
            reading: errors
                .iter()
                .map(|error| quantile * error.hypot(noise))
                .collect(),
        }
    }
}

impl Found for Simulated {
    fn record(&self) -> Option<String> {
        let mut head = vec![self.time.header.clone()];
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for output in &self.outputs {
            let mut column = |name: &str, values: Vec<f64>| {
                let name = format!("{}{name}", output.name);
                head.push(header(&name, &output.unit));
                columns.push(values);
            };
            column("", output.mean.clone());
            let Some(band) = &output.band else {
                continue;
            };
            let around = |half: &[f64], sign: f64| {
                let both = output.mean.iter().zip(half);
                both.map(|(mean, half)| mean + sign * half).collect()
            };
            column(" lower", around(&band.output, -1.0));
            column(" upper", around(&band.output, 1.0));
            if self.readings {
                column(" reading lower", around(&band.reading, -1.0));
                column(" reading upper", around(&band.reading, 1.0));
            }
        }
        let rows = self.time.cells.iter().enumerate().map(|(k, time)| {
            let values = columns.iter().map(|column| cell(column[k]));
            std::iter::once(time.clone()).chain(values).collect()
        });
        Some(csv_text(std::iter::once(head).chain(rows)))
    }
}
