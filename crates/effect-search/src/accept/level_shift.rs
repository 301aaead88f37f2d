//! Level shift: the simplest function of time that no candidate describes. From one row to the next a reading changes by a constant.
//!
//! Effects can imitate it: a parameter that changes at that instant explains a part, a store or a drift the rest. A set of effects is not
//! accepted if a level shift explains more, by the criterion with the same weighting.

use std::sync::Arc;

use ct_model::effects::Port;
use estimation::{Noise, fit_from};
use rayon::prelude::*;

use crate::Error;
use crate::fit::node::{Context, FINE, Node};
use crate::residual_tests::NotNoise;

/// Number of instants that are tried, those with the largest whitened residual.
const INSTANTS: usize = 4;
/// The first size is the difference of the residual's means over this number of rows before and after.
const AROUND: usize = 8;

/// A model with a level shift of a reading.
#[derive(Debug, Clone)]
pub(crate) struct LevelShift {
    /// Criterion of the model with the level shift: its size and its instant count.
    pub bic: f64,
    /// The level shift as structure of the record.
    pub found: NotNoise,
}

impl Context<'_> {
    /// A set with a level shift of a reading at the best instant, with the weighting of a noise model; `None` if no fit succeeds, and for records
    /// with clocks of their own.
    pub fn level_shift(&self, node: &Node, noise: &Noise) -> Result<Option<LevelShift>, Error> {
        let setup = self.setup(&node.model)?;
        // The shift has one instant on the model's clock: records with clocks of their own would all have it.
        let begins: Vec<f64> = (0..self.problem.records.len())
            .filter_map(|record| setup.model_time(record).first().copied())
            .collect();
        if begins.len() > 1
            && begins
                .iter()
                .any(|begin| begins.iter().filter(|b| *b == begin).count() > 1)
        {
            return Ok(None);
        }
        let Some(residuals) = estimation::residuals(&setup, &node.fit.x) else {
            return Ok(None);
        };
        // Beside other model errors an instant is abrupt only if the residual's own noise model does not predict it.
        let own = estimation::noise_of(&setup, &node.fit, self.thresholds.noise_order)?;
        let whitened = own.whiten(&residuals);
        let outputs = setup.outputs();
        let mut instants: Vec<(f64, usize, usize)> = Vec::new();
        for (series, whitened) in whitened.iter().enumerate() {
            let sigma = own.of_series(series).sigma();
            let within = AROUND..whitened.len().saturating_sub(AROUND);
            let present = within.filter(|&row| !whitened[row].is_nan());
            instants.extend(present.map(|row| (whitened[row].abs() / sigma, series, row)));
        }
        instants.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut shifted = self.clone();
        let first = shifted.candidates.len();
        shifted.candidates.extend(self.level_shifts.iter().cloned());
        let shifts = instants.into_par_iter().take(INSTANTS);
        let shifts = shifts.filter_map(|(_, series, row)| {
            let at = (series / outputs, series % outputs, row);
            shifted
                .shifted(node, (first, at), &residuals[series], noise)
                .ok()?
        });
        Ok(shifts.min_by(|a, b| a.bic.total_cmp(&b.bic)))
    }

    /// The set with a level shift before a row of an output of a record. `first`: position of the first level shift among the candidates.
    fn shifted(
        &self,
        node: &Node,
        (first, (record, output, row)): (usize, (usize, usize, usize)),
        residual: &[f64],
        noise: &Noise,
    ) -> Result<Option<LevelShift>, Error> {
        let of_output = |i: &usize| self.candidates[*i].port == Port::Output(output);
        let Some(i) = (first..self.candidates.len()).find(of_output) else {
            return Ok(None);
        };
        let added: Vec<usize> = node.added.iter().copied().chain([i]).collect();
        let model = Arc::new(self.model(&added)?);
        let setup = self.setup(&model)?;
        let mut start = self.transfer(node, &model, setup.start());
        let place = |short: &str| {
            let mut own = self.candidates[i].parameters.iter();
            let own = own.find(|own| own.short == short)?;
            let parameters = &model.spec().parameters;
            parameters.iter().position(|p| p.about.name == own.name)
        };
        let (Some(size), Some(since)) = (place("size"), place("since")) else {
            return Ok(None);
        };
        let time = setup.model_time(record);
        start[size] = mean(&residual[row..row + AROUND]) - mean(&residual[row - AROUND..row]);
        start[since] = 0.5 * (time[row - 1] + time[row]);
        let free: Vec<usize> = setup
            .free()
            .iter()
            .copied()
            .filter(|k| *k != since)
            .collect();
        let setup = setup.with_free(&free);
        let fit = fit_from(&setup, vec![start.into()], noise, FINE)?;
        let read = &self.problem.records[record];
        Ok(Some(LevelShift {
            bic: fit.bic() + self.samples().ln(),
            found: NotNoise::LevelShift {
                output: read.outputs[output].name.clone(),
                record: read.name.clone(),
                at: read.time[row],
                size: fit.x[size],
                unit: read.outputs[output].unit.clone(),
            },
        }))
    }
}

/// The mean of the present values; zero if there is none.
fn mean(values: &[f64]) -> f64 {
    let present = || values.iter().filter(|value| !value.is_nan());
    present().sum::<f64>() / present().count().max(1) as f64
}
