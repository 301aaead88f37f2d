//! A record: what was measured in one experiment, and what happens between its samples.

use serde::{Deserialize, Serialize};
use statrs::statistics::{Data, OrderStatistics};

use crate::{Error, csv_file::constant};

/// The fewest rows that a record needs, whatever the model.
pub const MIN_ROWS: usize = 20;

/// Rows needed for each fitted parameter.
pub const ROWS_PER_PARAMETER: usize = 5;

/// What the input does between two samples. It is part of the data's type, because a held input
/// treated as a continuous one leaves a spurious input term many times larger than a real leak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// `u[k]` is held from `t[k]` to `t[k+1]` (a D/A converter).
    #[default]
    Zero,
    /// The input runs in a straight line from `u[k]` to `u[k+1]`.
    First,
}

/// One sampled signal with its name and unit as the file's header gives them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Signal {
    /// The header's name without its unit, for example `y`.
    pub name: String,
    /// The unit, for example `cm`; empty where the file does not say.
    pub unit: String,
    /// One value for each sample, all finite.
    pub values: Vec<f64>,
}

impl Signal {
    /// A signal from its name, its unit (may be empty) and one value for each sample.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Signal {
            name: name.into(),
            unit: unit.into(),
            values,
        }
    }

    /// Smallest and largest value, in the signal's unit; `(NaN, NaN)` when there are none.
    pub fn range(&self) -> (f64, f64) {
        self.values
            .iter()
            .fold((f64::NAN, f64::NAN), |(low, high), &v| {
                (low.min(v), high.max(v))
            })
    }
}

/// One experiment: time, input, output, of a plant with two actuators the second input and, in a loop, the reference.
///
/// `y[k]` is read at `t[k]`, before `u[k]` acts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Where it came from (a file's name), for messages.
    pub name: String,
    /// Sampling instants \[s\], strictly increasing.
    pub time: Vec<f64>,
    /// The command to the actuator.
    pub input: Signal,
    /// The command to a second actuator, where there is one; it has what the first one has: the same instants, the same hold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_2: Option<Signal>,
    /// The sensor's reading.
    pub output: Signal,
    /// The set point, where there is a loop.
    pub reference: Option<Signal>,
    /// What the input does between samples.
    pub hold: Hold,
}

impl Record {
    /// The number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// A part of it, by positions of its rows, under the same name; times are kept.
    ///
    /// Positions beyond the last row are left out.
    #[must_use]
    pub fn rows(&self, range: std::ops::Range<usize>) -> Self {
        let range = range.start.min(self.len())..range.end.min(self.len());
        let part = |signal: &Signal| Signal {
            name: signal.name.clone(),
            unit: signal.unit.clone(),
            values: signal.values[range.clone()].to_vec(),
        };
        Self {
            name: self.name.clone(),
            time: self.time[range.clone()].to_vec(),
            input: part(&self.input),
            input_2: self.input_2.as_ref().map(part),
            output: part(&self.output),
            reference: self.reference.as_ref().map(part),
            hold: self.hold,
        }
    }

    /// The median step of the time \[s\]; 0 with fewer than two samples.
    pub fn sample_interval(&self) -> f64 {
        median_step(&self.time)
    }

    /// Time from the first to the last sample \[s\]; 0 with fewer than two samples.
    pub fn duration(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Smallest and largest input, in its unit; `(NaN, NaN)` when the record is empty.
    pub fn input_range(&self) -> (f64, f64) {
        self.input.range()
    }

    /// Smallest and largest output, in its unit; `(NaN, NaN)` when the record is empty.
    pub fn output_range(&self) -> (f64, f64) {
        self.output.range()
    }

    /// Checks that the input moves.
    ///
    /// # Errors
    /// [`Error::ConstantInput`], which names the record and the column.
    pub fn require_moving_input(&self) -> Result<(), Error> {
        let Some(value) = constant(&self.input.values) else {
            return Ok(());
        };
        let Signal { name, unit, .. } = &self.input;
        let column = match unit.as_str() {
            "" => name.clone(),
            unit => format!("{name} [{unit}]"),
        };
        Err(Error::ConstantInput {
            file: self.name.clone(),
            column,
            value,
            rows: self.len(),
        })
    }

    /// Checks a record that was put together in code: equal lengths, finite values, increasing time.
    ///
    /// [`read_csv`](crate::read_csv) has done this and more.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`], [`Error::ValueNotFinite`], [`Error::TimeNotIncreasing`].
    pub fn validate(&self) -> Result<(), Error> {
        let signals = [
            Some(&self.input),
            self.input_2.as_ref(),
            Some(&self.output),
            self.reference.as_ref(),
        ];
        for signal in signals.into_iter().flatten() {
            if signal.values.len() != self.len() {
                return Err(Error::LengthMismatch {
                    record: self.name.clone(),
                    signal: signal.name.clone(),
                    expected: self.len(),
                    found: signal.values.len(),
                });
            }
            check_finite(&self.name, &signal.name, &signal.values)?;
        }
        check_finite(&self.name, "time", &self.time)?;
        for (k, pair) in self.time.windows(2).enumerate() {
            if pair[1] <= pair[0] {
                return Err(Error::TimeNotIncreasing {
                    record: self.name.clone(),
                    index: k + 1,
                    time: pair[1],
                    previous: pair[0],
                });
            }
        }
        Ok(())
    }

    /// Checks that there are enough rows to fit `parameters` parameters (initial states included):
    /// [`ROWS_PER_PARAMETER`] for each, and never fewer than [`MIN_ROWS`].
    ///
    /// # Errors
    /// [`Error::TooFewRows`].
    pub fn require_rows(&self, parameters: usize) -> Result<(), Error> {
        let needed = MIN_ROWS.max(parameters.saturating_mul(ROWS_PER_PARAMETER));
        if self.len() >= needed {
            return Ok(());
        }
        Err(Error::TooFewRows {
            record: self.name.clone(),
            rows: self.len(),
            needed,
            why: format!(" to fit {parameters} parameters"),
        })
    }
}

/// The median of the differences between neighbours; 0 when there are none.
pub(crate) fn median_step(time: &[f64]) -> f64 {
    quantile_of_steps(time, 0.5)
}

/// The step of the time that the share `tau` of all steps does not exceed; 0 when there are none.
pub(crate) fn quantile_of_steps(time: &[f64], tau: f64) -> f64 {
    if time.len() < 2 {
        return 0.0;
    }
    Data::new(
        time.windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect::<Vec<_>>(),
    )
    .quantile(tau)
}

/// Refuses the first value that is NaN or infinite.
pub(crate) fn check_finite(record: &str, signal: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Error::ValueNotFinite {
            record: record.into(),
            signal: signal.into(),
            index,
            value: values[index],
        }),
    }
}
