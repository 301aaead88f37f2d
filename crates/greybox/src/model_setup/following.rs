//! The linear response of an unstable model in a loop, which follows the residual.

use std::sync::Arc;

use ct_signals::ArModel;
use statrs::statistics::Statistics;

use super::ModelSetup;
use super::simulated_loop::SimulatedLoop;
use crate::feedback::LinearResponse;

/// Standard deviations of disturbances at the inputs that an unstable model is taken to have, over those of the commands; those of noise at
/// the outputs, over those of the readings, are one.
const DISTURBANCES: [f64; 6] = [0.0, 0.01, 0.1, 1.0, 10.0, 100.0];

impl SimulatedLoop {
    /// The same with the response of an unstable model that follows the residual ([`LinearResponse::following`]), with the gain that makes the
    /// deviance least: the smallest one would do for the true model, and one that lacks an effect behaves as if its inputs were disturbed.
    /// Without a response if no gain makes it stable.
    pub(super) fn following(self, setup: &ModelSetup, x: &[f64]) -> Self {
        let records = setup.records;
        let spread = |values: &mut dyn Iterator<Item = f64>| {
            let deviation = values.filter(|value| !value.is_nan()).population_std_dev();
            deviation.max(f64::MIN_POSITIVE)
        };
        let outputs: Vec<f64> = (0..setup.outputs())
            .map(|o| {
                let readings = records.iter().map(|record| &record.outputs[o].values);
                spread(&mut readings.flatten().copied())
            })
            .collect();
        let inputs: Vec<f64> = (self.controllers.iter())
            .map(|of| {
                let commands = records.iter().map(|record| &record.inputs[of.input].values);
                spread(&mut commands.flatten().copied())
            })
            .collect();
        let followed = DISTURBANCES.iter().filter_map(|share| {
            let inputs: Vec<f64> = inputs.iter().map(|spread| share * spread).collect();
            let found = self.with_response(self.response.following(&inputs, &outputs)?);
            let deviance = found.deviance(setup, x)?;
            Some((deviance, found))
        });
        let smallest = followed.min_by(|a, b| a.0.total_cmp(&b.0));
        smallest.map_or_else(
            || self.with_response(LinearResponse::none(setup.outputs())),
            |(_, found)| found,
        )
    }

    /// Deviance of the residual, with noise of first order at each output.
    fn deviance(&self, setup: &ModelSetup, x: &[f64]) -> Option<f64> {
        let setup = setup.clone().in_loop(Arc::new(self.clone()));
        let residuals = estimation::residuals(&setup, x)?;
        let of_output = |o: usize| {
            let series = residuals.iter().skip(o).step_by(setup.outputs());
            let series: Vec<&[f64]> = series.map(Vec::as_slice).collect();
            let noise = ArModel::fit(&series, 1).ok()?;
            Some(2.0 * setup.samples[o] as f64 * noise.sigma().ln())
        };
        let all = (0..setup.outputs()).map(of_output).sum::<Option<f64>>();
        all.filter(|deviance| deviance.is_finite())
    }

    /// The same loop with the response and the gain that make the deviance of a setup least, if its response follows the residual: its own
    /// response, or that of the setup, which may not describe a hard nonlinearity. With the fall of the deviance; `None` if it does not fall.
    #[must_use]
    pub fn following_anew(&self, setup: &ModelSetup, x: &[f64]) -> Option<(Self, f64)> {
        if self.response.gain.is_empty() {
            return None;
        }
        let present = self.deviance(setup, x)?;
        let inputs: Vec<usize> = self.controllers.iter().map(|of| of.input).collect();
        let responses = [(*self.response).clone(), setup.response(x, &inputs, true)];
        let following = responses.into_iter().filter_map(|response| {
            let found = self.with_response(response).following(setup, x);
            Some((found.deviance(setup, x)?, found))
        });
        let smallest = following.min_by(|a, b| a.0.total_cmp(&b.0));
        let (deviance, found) = smallest.filter(|(deviance, _)| *deviance < present)?;
        Some((found, present - deviance))
    }
}
