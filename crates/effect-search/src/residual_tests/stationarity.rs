//! Whether one noise model holds for the whole of a residual.
//!
//! The spectrum of the whitened residual is flat in every part of the record where the noise is stationary. A line whose frequency moves,
//! which an autoregressive model takes for a broad resonance, is in another band in each part. The power of each band is compared over the
//! parts (Bartlett's test of equal variances); each part is scaled to its own variance, so that noise whose size alone changes is the same.
//!
//! **References**: M. B. Priestley, T. Subba Rao, J. Royal Statistical Society B 31 (1969) 140-149 (the test of an evolving spectrum by
//! time and frequency); M. S. Bartlett, Proc. Royal Society A 160 (1937) 268-282.

use ct_signals::ArModel;
use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::bands::bands;
use crate::thresholds::Thresholds;

/// p-value of the test that a residual has the same noise model in all its parts; 1 where it is too short for that.
#[must_use]
pub fn stationary_p(noise: &ArModel, residual: &[f64], thresholds: &Thresholds) -> f64 {
    let size = residual.len() / thresholds.stationary_parts;
    if size < thresholds.stationary_part_samples {
        return 1.0;
    }
    let white: Vec<f64> = noise
        .whiten(residual)
        .into_iter()
        // A missing sample contributes no power.
        .map(|w| if w.is_nan() { 0.0 } else { w })
        .collect();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(size);
    let mut spectrum = transform.make_output_vec();
    let mut powers: Vec<Vec<f64>> = Vec::new();
    let mut lines: Vec<f64> = Vec::new();
    for part in white.chunks_exact(size).take(thresholds.stationary_parts) {
        let mut part = part.to_vec();
        if transform.process(&mut part, &mut spectrum).is_err() {
            return 1.0;
        }
        // Without frequency zero, and without the Nyquist frequency, whose line has one degree of freedom.
        let power: Vec<f64> = spectrum[1..size.div_ceil(2)]
            .iter()
            .map(|line| line.norm_sqr())
            .collect();
        let mean = power.iter().sum::<f64>() / power.len() as f64;
        if mean <= 0.0 {
            return 1.0;
        }
        let mut of_part = Vec::new();
        lines.clear();
        for band in bands(power.len(), thresholds.stationary_lines) {
            lines.push(band.len() as f64);
            let expected = mean * band.len() as f64;
            of_part.push(power[band].iter().sum::<f64>() / expected);
        }
        powers.push(of_part);
    }
    let parts = powers.len() as f64;
    let mut deviance = 0.0;
    for (band, lines) in lines.iter().enumerate() {
        let of_parts = || powers.iter().map(|bands| bands[band]);
        let mean = of_parts().sum::<f64>() / parts;
        let logs: f64 = of_parts()
            .map(|power| (mean / power.max(f64::MIN_POSITIVE)).ln())
            .sum();
        // A line has two degrees of freedom.
        let correction = 1.0 + (parts - 1.0 / parts) / (3.0 * (parts - 1.0) * 2.0 * lines);
        deviance += 2.0 * lines * logs / correction;
    }
    let freedom = (parts - 1.0) * (lines.len() as f64 - 1.0);
    ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(deviance))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::f64::consts::TAU;

    use ct_signals::noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const SAMPLES: usize = 1500;

    #[test]
    fn noise_of_any_colour_has_one_model() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut chance = 0;
        for run in 0..400 {
            let mut e = noise::ar1(SAMPLES, 0.1, [0.0, 0.5, 0.9, 0.97][run % 4], &mut rng);
            if run % 8 < 4 {
                // Three times as large from the middle on, with the same spectrum.
                e[SAMPLES / 2..].iter_mut().for_each(|e| *e *= 3.0);
            }
            let model = ArModel::fit(&[&e], 6).unwrap();
            chance += usize::from(stationary_p(&model, &e, &Thresholds::DEFAULT) < 0.01);
        }
        // The nominal level is one in a hundred, of 400 records.
        assert!(chance <= 10, "{chance}");
    }

    #[test]
    fn a_line_whose_frequency_moves_is_no_noise() {
        const RUNS: usize = 20;
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut seen = 0;
        for _ in 0..RUNS {
            let mut e = noise::white(SAMPLES, 1.0, &mut rng);
            for (k, e) in e.iter_mut().enumerate() {
                let part = k as f64 / SAMPLES as f64;
                *e += 4.0 * (TAU * (4.0 * part + 10.0 * part * part)).sin();
            }
            let model = ArModel::fit(&[&e], 6).unwrap();
            seen += usize::from(stationary_p(&model, &e, &Thresholds::DEFAULT) < 1e-4);
        }
        // The autoregressive model describes a part of the moving line as a broad resonance, and the test sees the remainder only.
        assert!(seen >= RUNS / 2, "{seen} of {RUNS}");
    }
}
