//! The records of the experiment: input, output and the output's derivatives in closed form, without noise or with it.
//!
//! `u = sum_i sin(w_i t + 0.7 i^2)` with w = 1.4, 2.2, 3.2 rad/s; `a_2 y'' + a_1 y' + y = b_0 u` with all parameters 1, at rest at 0.
//! Noise: white noise held over a step through `1/(s/5 + 1)^3`, 1 % of the power of `y`; its derivatives are those of the filter.

use ct_lti::{Hold, StateVariableFilter};
use ct_signals::noise;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use stabilized_oe::KnownSample;

use crate::Error;

/// w_i, rad/s.
const FREQUENCIES: [f64; 3] = [1.4, 2.2, 3.2];

/// Poles of the noise's filter, rad/s.
const NOISE_POLE: f64 = 5.0;
/// Mean square of the noise over that of the output.
const NOISE_RATIO: f64 = 0.01;

/// Step and end of a run, s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub dt: f64,
    pub end: f64,
}

impl Grid {
    fn steps(self) -> usize {
        (self.end / self.dt).round() as usize
    }
}

pub(super) type Sample = KnownSample<2, 1>;

/// The record, without noise or with that of a seed and a stream of its generator.
pub(super) fn samples(grid: Grid, noise_of: Option<(u64, usize)>) -> Result<Vec<Sample>, Error> {
    let mut samples: Vec<Sample> = (0..grid.steps())
        .map(|k| {
            let (u, [y, slope, curvature]) = plant(k as f64 * grid.dt);
            Sample {
                u: [u],
                y,
                derivatives: [slope, curvature],
            }
        })
        .collect();
    let Some((seed, run)) = noise_of else {
        return Ok(samples);
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(run as u64);
    let mut filter = StateVariableFilter::with_bandwidth(3, NOISE_POLE, Hold::Zero)?;
    let mut disturbance = Vec::with_capacity(samples.len());
    for white in noise::white(samples.len(), 1.0, &mut rng) {
        let derivatives = filter.update(white, grid.dt)?;
        disturbance.push([derivatives[0], derivatives[1], derivatives[2]]);
    }
    let of_noise: f64 = disturbance.iter().map(|v| v[0] * v[0]).sum();
    let of_output: f64 = samples.iter().map(|sample| sample.y * sample.y).sum();
    let level = (NOISE_RATIO * of_output / of_noise).sqrt();
    for (sample, [v, slope, curvature]) in samples.iter_mut().zip(disturbance) {
        sample.y += level * v;
        sample.derivatives[0] += level * slope;
        sample.derivatives[1] += level * curvature;
    }
    Ok(samples)
}

/// `u` and `y, y', y''` at `t`, in closed form: each sine's stationary response, and the transient.
fn plant(t: f64) -> (f64, [f64; 3]) {
    let (decay, w0) = (0.5_f64, 0.75_f64.sqrt());
    let (mut u, mut y, mut slope) = (0.0, 0.0, 0.0);
    let (mut y_at_0, mut slope_at_0) = (0.0, 0.0);
    for (i, w) in FREQUENCIES.iter().enumerate() {
        let phase = 0.7 * (i * i) as f64;
        let (re, im) = (1.0 - w * w, *w);
        let size = re.hypot(im);
        let shift = phase - im.atan2(re);
        u += (w * t + phase).sin();
        y += (w * t + shift).sin() / size;
        slope += w * (w * t + shift).cos() / size;
        y_at_0 += shift.sin() / size;
        slope_at_0 += w * shift.cos() / size;
    }
    // e^{-t/2} (p cos(w0 t) + q sin(w0 t))
    let (p, q) = (-y_at_0, -(slope_at_0 + decay * y_at_0) / w0);
    let ((sin, cos), fade) = ((w0 * t).sin_cos(), (-decay * t).exp());
    y += fade * (p * cos + q * sin);
    slope += fade * ((q * w0 - decay * p) * cos - (p * w0 + decay * q) * sin);
    (u, [y, slope, u - y - slope])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plant_is_its_equation() {
        let h = 1e-4;
        for t in [0.0, 0.3, 2.0, 17.0] {
            let (_, [before, slope_before, _]) = plant(t - h);
            let (_, [after, slope_after, _]) = plant(t + h);
            let (_, [_, slope, curvature]) = plant(t);
            assert!(((after - before) / (2.0 * h) - slope).abs() < 1e-7);
            assert!(((slope_after - slope_before) / (2.0 * h) - curvature).abs() < 1e-7);
        }
        let (_, [y, slope, _]) = plant(0.0);
        assert!(y.abs() < 1e-15 && slope.abs() < 1e-15);
    }
}
