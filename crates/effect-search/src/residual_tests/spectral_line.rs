//! A line in the spectrum of a series: a period.
//!
//! A line is compared with the mean of its `2 nu` neighbours, which a noise of a smooth spectrum exceeds `x` times with a
//! probability of `(1 + x/nu)^-nu` (the F distribution of 2 and `2 nu` degrees of freedom). An autoregressive model of any order
//! would describe a line as a resonance; therefore only a first-order model is used, which flattens the spectrum.
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

/// The rows of a series that is read at every k-th row; all rows if one reading is between them.
fn read_rows(series: &[f64]) -> Vec<f64> {
    let read: Vec<usize> = (0..series.len()).filter(|&k| !series[k].is_nan()).collect();
    let gaps = || read.windows(2).map(|two| two[1] - two[0]);
    let every = gaps().min().unwrap_or(1);
    match read.first() {
        Some(&first) if every > 1 && gaps().all(|gap| gap % every == 0) => {
            let from = first % every;
            series[from..].iter().step_by(every).copied().collect()
        }
        _ => series.to_vec(),
    }
}

/// The strongest line of a series; `None` if it is too short, or constant.
///
/// Of an output that is read at every k-th row only these rows are used: zeros between them would repeat every line at other frequencies.
pub fn strongest_line(series: &[f64]) -> Result<Option<Line>, Error> {
    let series = &read_rows(series);
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

#[cfg(test)]
mod tests {
    use ct_signals::noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn the_line_of_a_slow_output_is_that_of_its_readings() {
        const ROWS: usize = 1200;
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let noise = noise::white(ROWS, 0.5, &mut rng);
        let value = |(k, e): (usize, f64)| (2.0 * PI * 37.0 * k as f64 / ROWS as f64).sin() + e;
        let all: Vec<f64> = noise.into_iter().enumerate().map(value).collect();
        let cycles = |series: &[f64]| strongest_line(series).unwrap().unwrap().cycles;
        assert_eq!(cycles(&all), 37);
        let slow = |(k, e): (usize, &f64)| if k % 6 == 2 { *e } else { f64::NAN };
        let mut slow: Vec<f64> = all.iter().enumerate().map(slow).collect();
        assert_eq!(cycles(&slow), 37);
        // One of its readings is lost; and the first half of them: the cycles are those in the whole record.
        slow[602] = f64::NAN;
        assert_eq!(cycles(&slow), 37);
        slow[..600].fill(f64::NAN);
        assert_eq!(cycles(&slow), 37);
    }
}
