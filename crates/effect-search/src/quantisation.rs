//! Readings that are rounded together with their noise.
//!
//! The readings themselves show it: nearly all are multiples of one step. No effect describes such an error, because the noise acts as
//! dither: the mean reading is nearly linear in the measured quantity, and rounding acts as further noise of variance `step^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use std::ops::RangeInclusive;

use ct_signals::Record;
use greybox::exact_reading_step;
use serde::{Deserialize, Serialize};

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

/// Outputs whose rounded readings cause a large part of the residual. `rmse`: residual by output.
pub(crate) fn quantisation(records: &[Record], rmse: &[f64]) -> Vec<Quantisation> {
    let outputs = records[0].outputs.iter().zip(rmse).enumerate();
    let rounded = outputs.filter_map(|(i, (output, rmse))| {
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
