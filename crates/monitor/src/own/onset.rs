//! Onset of a deviation for a user's own model: the onset of the single change that explains the latest rows best.
//!
//! A change of direction `i` (a watched parameter, or an offset of one output) by `d` that begins at row `j` adds `d s_i(k)` to the outputs
//! from then on; `s_i` is the derivative of the learned model's outputs, simulated from the states at row `j`. With `s` whitened by the noise
//! model of the outputs, and `e` the innovations of the learned model, both in standard deviations,
//! ```text
//! g(j) = max_i (sum_{k >= j} s_i(k) e(k))^2 / sum_{k >= j} s_i(k)^2
//! ```
//! is the fall of the sum of squares with the best direction: the generalised likelihood ratio of a change at row `j`. The onset is the row
//! at which it is largest (A. S. Willsky, H. L. Jones, IEEE Trans. Automatic Control 21 (1976) 108-112). The response is linearised in the
//! change. For a large change this is accurate only soon after the onset, so rows later than [`BEHIND`] time constants after the alarm are
//! not used.
//!
//! **Cost**: about 25 simulations with derivatives of at most the stored rows, each time an alarm is analysed.

use ct_signals::Hold;

use super::{OwnModel, simulation::running};
use crate::{Each, isolate::Kept, learn::Learned};

/// Onsets that are tried first, in multiples of the slowest time constant before the latest row; then those between the best one and its
/// neighbours.
const ONSETS: [f64; 14] = [
    0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0,
];
/// Rows are used until this number of slowest time constants after the alarm.
const BEHIND: f64 = 1.0;
/// Least number of rows after an onset.
const FEWEST: usize = 2;

/// Onset \[s\] of the change after an alarm at `raised` \[s\]; `None` if the rows do not determine it.
pub(super) fn onset(
    own: &OwnModel,
    learned: &Learned,
    hold: Hold,
    rows: &[Kept],
    growth: &Each<f64>,
    raised: f64,
) -> Option<f64> {
    let end = raised + BEHIND * learned.time_constant;
    let rows = &rows[..rows.partition_point(|kept| kept.sample.time <= end)];
    let unit = learned.rows_per_time_constant();
    let lengths = ONSETS.map(|share| ((share * unit).round() as usize).max(FEWEST));
    let mut lengths: Vec<usize> = lengths.into_iter().filter(|n| *n < rows.len()).collect();
    if rows.len() < FEWEST {
        return None;
    }
    lengths.push(rows.len());
    lengths.dedup();
    let gain = |length: usize| -> f64 {
        let rows = &rows[rows.len() - length..];
        gain(own, learned, hold, rows, growth).unwrap_or(0.0)
    };
    let gains: Vec<f64> = lengths.iter().map(|length| gain(*length)).collect();
    let (at, mut most) = gains
        .iter()
        .copied()
        .enumerate()
        .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let mut best = lengths[at];
    let below = at.checked_sub(1).map_or(FEWEST, |i| lengths[i]);
    let above = lengths.get(at + 1).copied().unwrap_or(rows.len());
    let mut step = (best - below.min(best)).max(above - best);
    while step > 1 {
        step = step.div_ceil(2);
        let centre = best;
        for length in [centre.saturating_sub(step), centre + step] {
            if (FEWEST..=rows.len()).contains(&length) {
                let gain = gain(length);
                if gain > most {
                    (best, most) = (length, gain);
                }
            }
        }
    }
    (most > 0.0).then(|| rows[rows.len() - best].sample.time)
}

/// Fall of the sum of squares of these rows with the best change at the first of them.
fn gain(
    own: &OwnModel,
    learned: &Learned,
    hold: Hold,
    rows: &[Kept],
    growth: &Each<f64>,
) -> Option<f64> {
    let first = rows.first()?;
    let lanes = learned.theta.len();
    let mut model = running(own, &learned.theta, &first.states);
    // Derivatives, then one for an offset of that output.
    let mut row = vec![0.0; lanes + 1];
    let mut whiteners = Vec::with_capacity(growth.len());
    for noise in &learned.outputs {
        let mut whitener = noise.model()?.whitener(lanes + 1);
        // Before the change its influence is zero.
        for _ in 0..=noise.coefficients.len() {
            row.fill(0.0);
            whitener.push(&mut row);
        }
        whiteners.push((whitener, noise.sigma));
    }
    let directions = lanes + whiteners.len();
    let (mut with_residual, mut squares) = (vec![0.0; directions], vec![0.0; directions]);
    let mut before: Option<&Kept> = None;
    for kept in rows {
        if let Some(before) = before {
            model.advance(hold, &before.sample, &kept.sample);
        }
        before = Some(kept);
        model.observe(&kept.sample);
        for (output, (whitener, sigma)) in whiteners.iter_mut().enumerate() {
            model.read(output, &mut row[..lanes]);
            row[lanes] = 1.0;
            if kept.sample.outputs[output].is_none() {
                whitener.skip();
                continue;
            }
            whitener.push(&mut row);
            let scale = 1.0 / (*sigma * growth[output]);
            let e = kept.innovations[output] / growth[output];
            for (lane, s) in row.iter().enumerate() {
                let direction = if lane < lanes { lane } else { lanes + output };
                let s = s * scale;
                with_residual[direction] += s * e;
                squares[direction] += s * s;
            }
        }
    }
    let gains = with_residual.iter().zip(&squares);
    gains
        .filter(|(_, squares)| **squares > 0.0)
        .map(|(with_residual, squares)| with_residual * with_residual / squares)
        .filter(|gain| gain.is_finite())
        .max_by(f64::total_cmp)
}
