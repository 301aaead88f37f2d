//! Whether a residual depends on the signals that come from outside.

use ct_signals::ArModel;
use ct_signals::residual_tests::prewhitened_input_test;
use estimation::Residuals;
use greybox::ModelSetup;

use super::white::of_command;
use crate::thresholds::Thresholds;

/// The dependence of a residual on a signal from outside, the most significant one.
#[derive(Debug, Clone, PartialEq)]
pub struct InputDependence {
    /// The input, or the reference that replaces it in a simulated loop.
    pub input: String,
    /// Position of the residual, by record and output.
    pub residual: usize,
    /// p-value, corrected for the number of tests.
    pub p: f64,
}

impl InputDependence {
    /// As [`InputDependence::of`], with the residuals at a fitted vector.
    #[must_use]
    pub fn at(setup: &ModelSetup, x: &[f64], thresholds: &Thresholds) -> Option<Self> {
        Self::of(setup, &estimation::residuals(setup, x)?, thresholds)
    }

    /// Tests every residual of a setup, a series for each record and output, against all signals that are derived from its external signals;
    /// `None` where no signal can be tested.
    #[must_use]
    pub fn of(setup: &ModelSetup, residuals: &[Vec<f64>], thresholds: &Thresholds) -> Option<Self> {
        let outputs = setup.samples().len();
        let (mut least, mut count): (Option<Self>, f64) = (None, 0.0);
        for (i, residual) in residuals.iter().enumerate() {
            let record = &setup.records()[i / outputs];
            let samples = residual.iter().filter(|e| !e.is_nan()).count();
            let lags = (samples / 10).clamp(2, 25);
            for input in setup.external_signals(record) {
                let (low, high) = input.range();
                if high <= low {
                    continue;
                }
                for signal in of_command(&input.values) {
                    if is_predictable(&signal, thresholds) {
                        continue;
                    }
                    count += 1.0;
                    match prewhitened_input_test(&signal, residual, lags) {
                        Ok((_, p)) if p < least.as_ref().map_or(1.0, |least| least.p) => {
                            least = Some(Self {
                                input: input.name.clone(),
                                residual: i,
                                p,
                            });
                        }
                        _ => {}
                    }
                }
            }
        }
        least.map(|least| Self {
            p: (least.p * count).min(1.0),
            ..least
        })
    }
}

/// Whether the past of a signal predicts nearly all of it.
fn is_predictable(signal: &[f64], thresholds: &Thresholds) -> bool {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let centred: Vec<f64> = signal.iter().map(|v| v - mean).collect();
    let power = centred.iter().map(|v| v * v).sum::<f64>() / centred.len().max(1) as f64;
    ArModel::fit(&[&centred], thresholds.noise_order)
        .is_ok_and(|model| model.sigma() <= thresholds.predictable_input * power.sqrt())
}
