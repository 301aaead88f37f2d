//! A record for the report.

use ct_signals::Record;
use serde::{Deserialize, Serialize};

/// A record for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// Name.
    pub name: String,
    /// Whether the record was held out: not used for fits or selection.
    pub held_out: bool,
    /// Sampling instants \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub time: Vec<f64>,
    /// The inputs that the model runs on; of a plant the command first.
    pub inputs: Vec<ShownInput>,
    /// Readings, a series for each output.
    pub outputs: Vec<Vec<f64>>,
}

/// An input of a record for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownInput {
    /// Name of the signal: `input`, `input 2`, or its own name.
    pub name: String,
    /// Unit of the signal; empty if unknown.
    pub unit: String,
    /// Samples of the signal \[unit\].
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub values: Vec<f64>,
}

impl Shown {
    /// A record; `held_out`: not used for fits or selection.
    #[must_use]
    pub fn of(record: &Record, held_out: bool) -> Self {
        Self {
            name: record.name.clone(),
            held_out,
            time: record.time.clone(),
            inputs: record
                .inputs
                .iter()
                .enumerate()
                .map(|(k, input)| ShownInput {
                    name: if record.inputs.len() > 1 {
                        format!("input {}", k + 1)
                    } else {
                        "input".to_string()
                    },
                    unit: input.unit.clone(),
                    values: input.values.clone(),
                })
                .collect(),
            outputs: record.outputs.iter().map(|y| y.values.clone()).collect(),
        }
    }

    /// Number of present readings of all outputs.
    #[must_use]
    pub fn samples(&self) -> usize {
        let readings = self.outputs.iter().flatten();
        readings.filter(|y| !y.is_nan()).count()
    }
}
