//! A line in the spectrum of a series: a period.
//!
//! A line is compared with the mean of its `2 nu` neighbours, which a noise of a smooth spectrum exceeds `x` times with a
//! probability of `(1 + x/nu)^-nu` (the F distribution of 2 and `2 nu` degrees of freedom). An autoregressive model of any order
//! would take a line for a resonance, so this does without one, but for a first-order one that flattens the spectrum.
//!
//! **Reference**: D. J. Thomson, Spectrum estimation and harmonic analysis, Proc. IEEE 70 (1982) 1055-1096.

use std::f64::consts::PI;

use ct_signals::ArModel;
use realfft::RealFftPlanner;

use ct_signals::Error;

/// Neighbours of a line: the first one outside its taper, the last one for which a smooth spectrum is nearly constant, and the least number
/// of them.
const NEAREST: usize = 3;
const FARTHEST: usize = 12;
const FEWEST: f64 = 4.0;

/// Least number of cycles in the series: a slower oscillation counts as a drift.
const CYCLES: usize = 3;

/// The largest spectral line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Periods in the series.
    pub cycles: usize,
    /// Probability that the largest line of a noise exceeds this one; above one without a line.
    pub chance: f64,
}

/// The strongest line of a series; `None` if it is too short, or constant.
pub fn strongest_line(series: &[f64]) -> Result<Option<Line>, Error> {
    let n = series.len();
    // Made nearly flat for a comparison of neighbours, by a filter whose order is too low to model a line.
    let mut flat = ArModel::fit(&[series], 1)?.whiten(series);
    for (k, value) in flat.iter_mut().enumerate() {
        // A missing sample contributes nothing.
        if value.is_nan() {
            *value = 0.0;
        }
        *value *= (PI * (k as f64 + 0.5) / n as f64).sin().powi(2);
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut spectrum = transform.make_output_vec();
    if transform.process(&mut flat, &mut spectrum).is_err() {
        return Ok(None);
    }
    // Without frequency zero, and without the Nyquist frequency, whose line has one degree of freedom.
    let lines: Vec<f64> = spectrum[1..n.div_ceil(2)]
        .iter()
        .map(|line| line.norm_sqr())
        .collect();
    let least = (CYCLES - 1..lines.len())
        .filter_map(|at| {
            let around: Vec<f64> = (at.saturating_sub(FARTHEST)
                ..lines.len().min(at + FARTHEST + 1))
                .filter(|j| j.abs_diff(at) >= NEAREST)
                .map(|j| lines[j])
                .collect();
            // The taper correlates neighbouring lines: two lines count as one.
            let count = 0.5 * around.len() as f64;
            let mean = around.iter().sum::<f64>() / (2.0 * count);
            (count >= FEWEST && mean > 0.0)
                .then(|| (-count * (lines[at] / (mean * count)).ln_1p(), at + 1))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    Ok(least.map(|(log_chance, cycles)| Line {
        cycles,
        chance: lines.len() as f64 * log_chance.exp(),
    }))
}
