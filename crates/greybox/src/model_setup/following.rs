//! The linear response of an unstable model in a loop, which follows the residual.

use std::sync::Arc;

use ct_signals::{ArModel, Record};
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
        let found = self.with_least_deviance(setup, x);
        found.map_or_else(
            || self.with_response(LinearResponse::none(setup.outputs())),
            |(_, found)| found,
        )
    }

    /// The loop with the gain that makes the deviance least, and this deviance.
    fn with_least_deviance(&self, setup: &ModelSetup, x: &[f64]) -> Option<(f64, Self)> {
        let records = setup.records;
        let spread = |values: &mut dyn Iterator<Item = f64>| {
            let deviation = values.filter(|value| !value.is_nan()).population_std_dev();
            // A constant signal, or one without a value.
            if deviation > 0.0 { deviation } else { 1.0 }
        };
        // An output that is read in few rows corrects as if its noise were larger in all of them.
        let rows: usize = records.iter().map(Record::len).sum();
        let outputs: Vec<f64> = (0..setup.outputs())
            .map(|o| {
                let readings = records.iter().map(|record| &record.outputs[o].values);
                let share = setup.samples[o] as f64 / rows as f64;
                spread(&mut readings.flatten().copied()) / share.sqrt()
            })
            .collect();
        let inputs: Vec<f64> = (self.controllers.iter())
            .map(|of| {
                let commands = records.iter().map(|record| &record.inputs[of.input].values);
                spread(&mut commands.flatten().copied())
            })
            .collect();
        least(DISTURBANCES.iter().filter_map(|share| {
            let inputs: Vec<f64> = inputs.iter().map(|spread| share * spread).collect();
            let found = self.with_response(self.response.following(&inputs, &outputs)?);
            Some((found.deviance(setup, x)?, found))
        }))
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
        let read = (0..setup.outputs()).filter(|&o| setup.samples[o] > 0);
        let all = read.map(of_output).sum::<Option<f64>>();
        all.filter(|deviance| deviance.is_finite())
    }

    /// The same loop with the response and the gain that make the deviance of a setup least, if its response follows the residual: its own
    /// response, or that of the setup, which may not describe a hard nonlinearity. `None` if the deviance does not fall.
    #[must_use]
    pub fn following_anew(&self, setup: &ModelSetup, x: &[f64]) -> Option<Self> {
        if self.response.gain.is_empty() {
            return None;
        }
        let inputs: Vec<usize> = self.controllers.iter().map(|of| of.input).collect();
        let own = self.with_response(setup.response(x, &inputs, true));
        let following = [self, &own].map(|of| of.with_least_deviance(setup, x));
        let (deviance, found) = least(following.into_iter().flatten())?;
        (deviance < self.deviance(setup, x)?).then_some(found)
    }
}

/// The loop with the least deviance.
fn least(of: impl Iterator<Item = (f64, SimulatedLoop)>) -> Option<(f64, SimulatedLoop)> {
    of.min_by(|a, b| a.0.total_cmp(&b.0))
}
