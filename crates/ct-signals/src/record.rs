//! A record: what was measured in one experiment, and what happens between its samples.

use serde::{Deserialize, Serialize};
use statrs::statistics::{Data, OrderStatistics};

use crate::series::{constant, interpolated};
use crate::{Calendar, Error, Shortage};

/// Least number of rows of a record for any model.
pub const MIN_ROWS: usize = 20;

/// Rows needed for each fitted parameter.
pub const ROWS_PER_PARAMETER: usize = 5;

/// Hold: the behaviour of the input between two samples. It is part of the data's type, because a held input that is treated as a
/// continuous one causes a spurious input term many times larger than a real leak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// `u[k]` is held from `t[k]` to `t[k+1]` (a D/A converter).
    #[default]
    Zero,
    /// The input runs in a straight line from `u[k]` to `u[k+1]`.
    First,
}

/// One sampled signal: name and unit from the file's header, hold, and samples.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Channel {
    /// The header's name without its unit, for example `y`.
    pub name: String,
    /// The unit, for example `cm`; empty if not known.
    pub unit: String,
    /// Hold between two samples; it has no meaning for an output.
    #[serde(default)]
    pub hold: Hold,
    /// One value per instant of the record; NaN if the sample is missing.
    pub values: Vec<f64>,
}

impl Channel {
    /// A channel from its name, its unit (may be empty) and one value for each instant, held between them.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Channel {
            name: name.into(),
            unit: unit.into(),
            hold: Hold::Zero,
            values,
        }
    }

    /// The same channel with another hold.
    #[must_use]
    pub fn with_hold(self, hold: Hold) -> Self {
        Self { hold, ..self }
    }

    /// The same name, unit and hold with other values.
    #[must_use]
    pub fn with_values(&self, values: Vec<f64>) -> Self {
        Self {
            name: self.name.clone(),
            unit: self.unit.clone(),
            hold: self.hold,
            values,
        }
    }

    /// Smallest and largest value, in the channel's unit, missing samples aside; `(NaN, NaN)` when there are none.
    pub fn range(&self) -> (f64, f64) {
        self.values
            .iter()
            .fold((f64::NAN, f64::NAN), |(low, high), &v| {
                (low.min(v), high.max(v))
            })
    }

    /// The present samples, in order.
    pub fn present(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().copied().filter(|value| !value.is_nan())
    }

    /// Number of missing samples.
    #[must_use]
    pub fn missing(&self) -> usize {
        self.values.iter().filter(|value| value.is_nan()).count()
    }

    /// The values with straight lines in place of missing samples ([`interpolated`]).
    #[must_use]
    pub fn interpolated(&self) -> Vec<f64> {
        interpolated(&self.values)
    }

    /// The name with the unit in brackets, as in a header; the name alone without a unit.
    #[must_use]
    pub fn header(&self) -> String {
        match self.unit.as_str() {
            "" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }
}

/// One experiment: its instants and any number of inputs, outputs and references, on one clock.
///
/// `y[k]` is read at `t[k]`, before `u[k]` acts. Outputs at different rates are outputs of which samples are missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Record {
    /// Name of the source (a file's name), for messages.
    pub name: String,
    /// Sampling instants \[s\], strictly increasing.
    pub time: Vec<f64>,
    /// The commands to the actuators and the disturbances that are measured.
    pub inputs: Vec<Channel>,
    /// The sensors' readings; samples may be missing.
    pub outputs: Vec<Channel>,
    /// The set points, if there is a loop.
    pub references: Vec<Channel>,
    /// Number of this part of a record that was cut, from 1 ([`Record::without_gaps`]); 0 of a whole record.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub part: usize,
    /// Date and time at zero of the record's clock, if known.
    #[serde(skip)]
    pub calendar: Option<Calendar>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_zero(part: &usize) -> bool {
    *part == 0
}

impl Record {
    /// A record of evenly sampled channels that starts at time zero; `interval` in seconds. It has as many samples as its first channel.
    #[must_use]
    pub fn sampled(
        name: impl Into<String>,
        interval: f64,
        inputs: Vec<Channel>,
        outputs: Vec<Channel>,
    ) -> Self {
        let first = inputs.first().or(outputs.first());
        let samples = first.map_or(0, |channel| channel.values.len());
        Self {
            name: name.into(),
            time: (0..samples).map(|k| interval * k as f64).collect(),
            inputs,
            outputs,
            ..Self::default()
        }
    }

    /// The number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// A part of the record, by positions of its rows, under the same name; times do not change.
    ///
    /// Positions beyond the last row are left out.
    #[must_use]
    pub fn rows(&self, range: std::ops::Range<usize>) -> Self {
        let range = range.start.min(self.len())..range.end.min(self.len());
        let part = |channels: &[Channel]| {
            let cut =
                |channel: &Channel| channel.with_values(channel.values[range.clone()].to_vec());
            channels.iter().map(cut).collect()
        };
        Self {
            name: self.name.clone(),
            time: self.time[range.clone()].to_vec(),
            inputs: part(&self.inputs),
            outputs: part(&self.outputs),
            references: part(&self.references),
            part: self.part,
            calendar: self.calendar.clone(),
        }
    }

    /// All channels: inputs, outputs, references.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.inputs
            .iter()
            .chain(&self.outputs)
            .chain(&self.references)
    }

    /// Hold of the first input.
    #[must_use]
    pub fn hold(&self) -> Hold {
        self.inputs.first().map_or(Hold::Zero, |input| input.hold)
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

    /// Smallest and largest value of the first input, in its unit; `(NaN, NaN)` where there is none.
    pub fn input_range(&self) -> (f64, f64) {
        self.inputs
            .first()
            .map_or((f64::NAN, f64::NAN), Channel::range)
    }

    /// Smallest and largest value of the first output, in its unit; `(NaN, NaN)` where there is none.
    pub fn output_range(&self) -> (f64, f64) {
        self.outputs
            .first()
            .map_or((f64::NAN, f64::NAN), Channel::range)
    }

    /// Checks that an input changes.
    ///
    /// # Errors
    /// [`Error::ConstantInput`], which names the record and the first input's column.
    pub fn require_moving_input(&self) -> Result<(), Error> {
        let Some(first) = self.inputs.first() else {
            return Ok(());
        };
        match constant(&first.values) {
            Some(value) => Err(Error::ConstantInput {
                file: self.name.clone(),
                column: first.header(),
                value,
                rows: self.len(),
            }),
            None => Ok(()),
        }
    }

    /// Checks that no sample of an input is missing: a simulation needs them all ([`Record::without_gaps`]).
    ///
    /// # Errors
    /// [`Error::ValueNotFinite`], which names the input and the first sample that is missing.
    pub fn require_whole_inputs(&self) -> Result<(), Error> {
        let check = |input: &Channel| check_finite(&self.name, &input.name, &input.values);
        self.inputs.iter().try_for_each(check)
    }

    /// Checks a record that was put together in code: equal lengths, values that are finite or missing (NaN), increasing time.
    ///
    /// [`read_csv`](crate::read_csv) has done this and more.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`], [`Error::ValueNotFinite`], [`Error::TimeNotIncreasing`].
    pub fn validate(&self) -> Result<(), Error> {
        for channel in self.channels() {
            if channel.values.len() != self.len() {
                return Err(Error::LengthMismatch {
                    record: self.name.clone(),
                    signal: channel.name.clone(),
                    expected: self.len(),
                    found: channel.values.len(),
                });
            }
            if let Some(index) = channel.values.iter().position(|v| v.is_infinite()) {
                return Err(Error::ValueNotFinite {
                    record: self.name.clone(),
                    signal: channel.name.clone(),
                    index,
                    value: channel.values[index],
                });
            }
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
}

/// The names of records; parts of one record, which follow each other, once.
#[must_use]
pub fn record_names(records: &[Record]) -> Vec<&str> {
    let mut names: Vec<&str> = records.iter().map(|record| record.name.as_str()).collect();
    names.dedup();
    names
}

/// Checks that records have enough samples of an output to fit `parameters` parameters to all of them together (the initial states of
/// each included): [`ROWS_PER_PARAMETER`] for each, and never fewer than [`MIN_ROWS`].
///
/// # Errors
/// [`Error::TooFewRows`].
pub fn require_samples(records: &[Record], parameters: usize) -> Result<(), Error> {
    let needed = MIN_ROWS.max(parameters.saturating_mul(ROWS_PER_PARAMETER));
    let samples = |record: &Record| {
        let missing = record.outputs.iter().map(Channel::missing).max();
        record.len() - missing.unwrap_or(0)
    };
    let rows: usize = records.iter().map(samples).sum();
    if rows >= needed {
        return Ok(());
    }
    Err(Error::TooFewRows {
        record: record_names(records).join(" and "),
        rows,
        needed,
        why: Shortage::Parameters {
            parameters,
            missing: records.iter().any(|record| samples(record) < record.len()),
        },
    })
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
