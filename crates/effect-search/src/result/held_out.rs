//! Errors on held-out records: their initial states are fitted on the first samples, all other parameters are fixed, and the rest is
//! scored.
//!
//! The first five samples, as in the benchmark of the cascaded tanks, if they determine the states well enough. Five noisy positions, for
//! example, estimate an unmeasured speed so badly that its error alone determines the score. In this case the number of samples is doubled
//! until the uncertainty of the states changes the outputs by no more than their noise.

use ct_signals::Record;
use estimation::Fit;
use greybox::{FitOptions, ModelSetup};
use nalgebra::{DMatrix, DVector};

use crate::{Error, HeldOutError};

/// Samples on which the initial states of a held-out record are fitted at least, and which are not scored.
const STATE_ROWS: usize = 5;
/// ... and by the rule of newer benchmarks, ...
pub const LATER_ROWS: usize = 50;
/// ... which needs a record of this multiple of them.
pub const MOST_OF_RECORD: usize = 4;

/// A fitted model on held-out records.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Simulation error of each output \[its unit\].
    pub rmse: Vec<f64>,
    /// `rmse` with initial states from the first 50 rows, which are not scored; `None` if a record has fewer than 200.
    pub rmse_50: Option<Vec<f64>>,
    /// Parts of the error of each output \[its unit\].
    pub errors: Vec<HeldOutError>,
    /// Simulated output: a series for each record and output; NaN after the simulation diverges.
    pub simulated: Vec<Vec<f64>>,
    /// Number of first samples of each record for the fit of the initial states; they are not scored.
    pub state_rows: Vec<usize>,
}

/// A fitted model on held-out records; `None` without any. `fit`: fit of the model in `setup`.
///
/// # Errors
/// Where a record is not one of this model, or its initial states cannot be fitted.
pub fn held_out(setup: &ModelSetup, fit: &Fit, test: &[Record]) -> Result<Option<HeldOut>, Error> {
    if test.is_empty() {
        return Ok(None);
    }
    let found = from_rows(setup, fit, test, (STATE_ROWS, true))?;
    let are_long = test
        .iter()
        .all(|record| record.len() >= MOST_OF_RECORD * LATER_ROWS);
    // A model whose simulation over this number of rows is not finite has no such score.
    let later = are_long
        .then(|| from_rows(setup, fit, test, (LATER_ROWS, false)).ok())
        .flatten()
        .filter(|found| {
            found
                .scored
                .iter()
                .all(|all| all.iter().any(|pairs| !pairs.is_empty()))
        });
    Ok(Some(HeldOut {
        rmse: found.scored.iter().map(rms).collect(),
        rmse_50: later.map(|found| found.scored.iter().map(rms).collect()),
        errors: found
            .scored
            .iter()
            .map(|all| HeldOutError::of(all))
            .collect(),
        simulated: found.simulated,
        state_rows: found.state_rows,
    }))
}

/// Pairs of measured value and model, for each record.
type Pairs = Vec<Vec<(f64, f64)>>;

fn rms(pairs: &Pairs) -> f64 {
    let squares = pairs.iter().flatten().map(|(y, m)| (y - m).powi(2));
    let count: usize = pairs.iter().map(Vec::len).sum();
    (squares.sum::<f64>() / count.max(1) as f64).sqrt()
}

struct Scored {
    /// For each output.
    scored: Vec<Pairs>,
    simulated: Vec<Vec<f64>>,
    state_rows: Vec<usize>,
}

/// Held-out records with initial states from this number of rows, or from more if these do not determine them and `may_be_more`.
fn from_rows(
    setup: &ModelSetup,
    fit: &Fit,
    test: &[Record],
    (least, may_be_more): (usize, bool),
) -> Result<Scored, Error> {
    let outputs = fit.rmse.len();
    let mut scored: Vec<Pairs> = vec![Vec::new(); outputs];
    let mut simulated = Vec::new();
    let mut state_rows = Vec::new();
    for record in test {
        let whole = [record.clone()];
        let of_whole = setup.held_out(&whole, &fit.x)?;
        let mut rows = least.min(record.len());
        let states = loop {
            let first = [record.rows(0..rows)];
            let states = setup
                .held_out(&first, &fit.x)?
                .fit_states(&FitOptions::default())?;
            let known = !may_be_more || states_are_known(&of_whole, &states, rows, &fit.rmse);
            if known || MOST_OF_RECORD * 2 * rows > record.len() {
                break states;
            }
            rows *= 2;
        };
        let model = of_whole.simulate(&states);
        let model = model.unwrap_or_else(|| vec![vec![f64::NAN; record.len()]; outputs]);
        for (o, scored) in scored.iter_mut().enumerate() {
            let measured = record.outputs[o].values.iter().copied();
            let pairs = measured.zip(model[o].iter().copied()).skip(rows);
            scored.push(pairs.filter(|(y, _)| !y.is_nan()).collect());
        }
        simulated.extend(model);
        state_rows.push(rows);
    }
    Ok(Scored {
        scored,
        simulated,
        state_rows,
    })
}

/// Whether the uncertainty of the initial states after the first rows changes the outputs of the whole record by no more than their noise
/// (root mean square). `noise`: standard deviation at each output \[its unit\].
fn states_are_known(setup: &ModelSetup, x: &[f64], first: usize, noise: &[f64]) -> bool {
    let Some(rows) = estimation::rows(setup, x) else {
        return true;
    };
    let states = rows.columns - 1;
    if states == 0 {
        return true;
    }
    let mut information = DMatrix::<f64>::zeros(states, states);
    let mut all = DMatrix::<f64>::zeros(states, states);
    let mut count = 0;
    for (output, series) in rows.series() {
        let scale = 1.0 / noise[output].max(f64::MIN_POSITIVE);
        for (k, row) in series.chunks_exact(rows.columns).enumerate() {
            if row[states].is_nan() {
                continue;
            }
            let slope = DVector::from_column_slice(&row[..states]) * scale;
            let square = &slope * slope.transpose();
            if k < first {
                information += &square;
            }
            all += square;
            count += 1;
        }
    }
    // A state without influence needs no estimate. Each in its own unit.
    for i in 0..states {
        let of_all = all[(i, i)] / count.max(1) as f64;
        information[(i, i)] += if of_all > 0.0 { 1e-9 * of_all } else { 1.0 };
    }
    information.cholesky().is_some_and(|factor| {
        let moved = factor.solve(&all).trace();
        moved <= count as f64
    })
}
