//! Test whether the simulation error depends on an input or, in a loop, on the reference.

use ct_signals::{Record, residual_tests};

use crate::{Error, Shown, Warning};

/// Largest number of lags for the test that the error does not depend on a signal.
const MOST_LAGS: usize = 25;
/// Significance level: a correlation of a signal with the error below this p-value is reported.
const UNLIKELY: f64 = 0.01;

/// The parts of a record, one after the other.
#[derive(Default)]
pub(super) struct Joined {
    pub shown: Shown,
    /// Signals that must be uncorrelated with the error, and the error; with rows without a value between the parts.
    signals: Vec<ct_signals::Channel>,
    error: Vec<f64>,
    pub readings: Vec<f64>,
}

impl Joined {
    /// In open loop the error is tested against every input, in a loop against the reference, because the input depends on the noise there.
    pub fn add(&mut self, record: &Record, in_loop: bool, error: impl Iterator<Item = f64>) {
        let signals: Vec<&ct_signals::Channel> = match record.references.first().filter(|_| in_loop)
        {
            Some(reference) => vec![reference],
            None => record.inputs.iter().collect(),
        };
        let between = match self.signals.is_empty() {
            true => 0,
            false => MOST_LAGS,
        };
        if self.signals.is_empty() {
            self.signals = signals.iter().map(|s| s.with_values(Vec::new())).collect();
            self.shown.input = record.inputs[0].with_values(Vec::new());
            self.shown.output = record.outputs[0].with_values(Vec::new());
        }
        let nothing = || std::iter::repeat_n(f64::NAN, between);
        for (own, signal) in self.signals.iter_mut().zip(signals) {
            own.values.extend(nothing());
            own.values.extend(&signal.values);
        }
        self.error.extend(nothing());
        self.error.extend(error);
        self.shown.time.extend(&record.time);
        self.shown.input.values.extend(&record.inputs[0].values);
        self.shown.output.values.extend(&record.outputs[0].values);
    }
}

/// The signal with the largest correlation with the simulation errors.
#[derive(Default)]
pub(super) struct Visible {
    tests: usize,
    least: Option<(f64, String)>,
}

impl Visible {
    pub fn test(&mut self, joined: &Joined) -> Result<(), Error> {
        let lags = (joined.readings.len() / 10).clamp(2, MOST_LAGS);
        for signal in &joined.signals {
            let (_, p) =
                residual_tests::prewhitened_input_test(&signal.values, &joined.error, lags)?;
            self.tests += 1;
            if self.least.as_ref().is_none_or(|(least, _)| p < *least) {
                self.least = Some((p, signal.name.clone()));
            }
        }
        Ok(())
    }

    pub fn warning(self, inputs: usize) -> Option<Warning> {
        let (p, signal) = self.least?;
        let p_value = p * (self.tests as f64);
        (p_value < UNLIKELY).then_some(Warning::DependsOnSignal {
            signal,
            inputs,
            p_value,
        })
    }
}
