//! Readings that are rounded together with their noise.
//!
//! The readings themselves show it: nearly all are multiples of one step. No effect describes such an error, because the noise acts as
//! dither: the mean reading is nearly linear in the measured quantity, and rounding acts as further noise of variance `step^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use std::ops::RangeInclusive;

use ct_model::effects::Port;
use greybox::exact_reading_step;
use serde::{Deserialize, Serialize};

use crate::node::{Context, Node};
use crate::score::QUANTISATION;

/// Rounding is reported if its variance is within this range, as a share of the mean squared residual. With a larger variance the measured
/// quantity is constant, or the grid is not that of a converter.
const SHARE: RangeInclusive<f64> = 1.0 / 3.0..=1.1;

/// Rounding of an output's readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantisation {
    /// The output.
    pub output: String,
    /// Unit of the output.
    pub unit: String,
    /// Nearly all readings are multiples of this step \[unit of the output\].
    pub step: f64,
    /// Variance of the rounding error, as a share of the mean squared residual.
    pub share: f64,
}

/// Outputs whose rounded readings cause a large part of a model's residual, except those that are rounded in the model too.
pub(crate) fn quantisation(context: &Context, node: &Node) -> Vec<Quantisation> {
    let records = &context.problem.records;
    let in_model = |output: usize| {
        node.added.iter().any(|&i| {
            let candidate = &context.candidates[i];
            let effect = candidate
                .effect
                .is_some_and(|effect| effect.id == QUANTISATION);
            effect && candidate.port == Port::Output(output)
        })
    };
    let outputs = records[0].outputs.iter().zip(&node.fit.rmse).enumerate();
    let rounded = outputs.filter_map(|(i, (output, rmse))| {
        if in_model(i) {
            return None;
        }
        let step = exact_reading_step(records, i)?;
        let share = step.powi(2) / 12.0 / rmse.powi(2);
        SHARE.contains(&share).then(|| Quantisation {
            output: output.name.clone(),
            unit: output.unit.clone(),
            step,
            share,
        })
    });
    rounded.collect()
}
