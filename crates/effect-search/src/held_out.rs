//! Errors on held-out records: their initial states are fitted on the first samples, all else stays, and the rest is scored.

use ct_signals::Record;
use estimation::Fit;
use greybox::{FitOptions, ModelSetup};

use crate::Error;

/// Samples on which the initial states of a held-out record are fitted, and which are not scored.
const STATE_ROWS: usize = 5;

/// A fitted model on held-out records.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Simulation error of each output \[its unit\].
    pub rmse: Vec<f64>,
    /// What the model gives: a series for each record and output; NaN where the simulation cannot go on.
    pub simulated: Vec<Vec<f64>>,
}

/// A fitted model on held-out records; `None` without any. `fit`: of the model that `setup` has.
///
/// # Errors
/// Where a record is not one of this model, or its initial states cannot be fitted.
pub fn held_out(setup: &ModelSetup, fit: &Fit, test: &[Record]) -> Result<Option<HeldOut>, Error> {
    if test.is_empty() {
        return Ok(None);
    }
    let outputs = fit.rmse.len();
    let mut sums = vec![(0.0, 0_usize); outputs];
    let mut simulated = Vec::new();
    for record in test {
        let whole = [record.clone()];
        let first = [record.rows(0..STATE_ROWS.min(record.len()))];
        let states = setup
            .held_out(&first, &fit.x)?
            .fit_states(&FitOptions::default())?;
        let model = setup.held_out(&whole, &fit.x)?.simulate(&states);
        let model = model.unwrap_or_else(|| vec![vec![f64::NAN; record.len()]; outputs]);
        for (o, sum) in sums.iter_mut().enumerate() {
            let measured = record.outputs[o].values.iter();
            let pairs = measured.zip(&model[o]).skip(STATE_ROWS);
            for (y, m) in pairs.filter(|(y, _)| !y.is_nan()) {
                sum.0 += (y - m).powi(2);
                sum.1 += 1;
            }
        }
        simulated.extend(model);
    }
    let rms = |(sum, n): (f64, usize)| (sum / n.max(1) as f64).sqrt();
    Ok(Some(HeldOut {
        rmse: sums.into_iter().map(rms).collect(),
        simulated,
    }))
}
