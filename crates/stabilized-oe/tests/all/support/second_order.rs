//! The plant of the n = 2 experiments, `y'' + y' + y = u`, under three sines, with exact derivatives.

use ct_rls::{ContinuousRls, ExactHold, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, Full, Integrator, KnownSample};

/// `a_1, a_2, b_0`
pub const THETA: [f64; 3] = [1.0, 1.0, 1.0];
pub const START: [f64; 3] = [2.0, 2.0, 0.5];
pub const FREQUENCIES: [f64; 3] = [1.4, 2.2, 3.2];

pub fn input(t: f64) -> f64 {
    let wave = |(i, w): (usize, &f64)| (w * t + 0.7 * (i * i) as f64).sin();
    FREQUENCIES.iter().enumerate().map(wave).sum()
}

/// `y, y'` at `t` from rest at 0: the response to each sine, stationary and dying out, in closed form.
pub fn response(t: f64) -> [f64; 2] {
    let mut total = [0.0; 2];
    // dying out: e^{-t/2} (p cos(w0 t) + q sin(w0 t))
    let (decay, w0) = (0.5, 0.75f64.sqrt());
    let (mut y0, mut dy0) = (0.0, 0.0);
    for (i, w) in FREQUENCIES.iter().enumerate() {
        let phase = 0.7 * (i * i) as f64;
        let (re, im) = (1.0 - w * w, *w);
        let size = (re * re + im * im).sqrt();
        let shift = phase - im.atan2(re);
        total[0] += (w * t + shift).sin() / size;
        total[1] += w * (w * t + shift).cos() / size;
        y0 -= shift.sin() / size;
        dy0 -= w * shift.cos() / size;
    }
    let (p, q) = (y0, (dy0 + decay * y0) / w0);
    let (sin, cos) = (w0 * t).sin_cos();
    let fade = (-decay * t).exp();
    total[0] += fade * (p * cos + q * sin);
    total[1] += fade * ((q * w0 - decay * p) * cos - (p * w0 + decay * q) * sin);
    total
}

/// A sample at `t` with `noise` and its first two derivatives on the output.
pub fn sample(t: f64, noise: [f64; 3]) -> KnownSample<2, 1> {
    let (u, [y, slope]) = (input(t), response(t));
    let curvature = u - y - slope;
    KnownSample {
        u: [u],
        y: y + noise[0],
        derivatives: [slope + noise[1], curvature + noise[2]],
    }
}

pub fn weights(eta: f64) -> Weights {
    Weights::least_squares(eta).unwrap()
}

/// `theta^(0)`, `c^(0) = (1, 1)`, `P(0) = I`.
pub fn block_diagonal<I: Integrator>(weights: Weights) -> BlockDiagonal<2, 3, I> {
    let theta = SVector::from(START);
    let first = ContinuousRls::with_integrator(theta, SMatrix::identity(), weights).unwrap();
    let c = SVector::from([1.0, 1.0]);
    let second = ContinuousRls::with_integrator(c, SMatrix::identity(), weights).unwrap();
    BlockDiagonal::new(first, second)
}

pub fn full(weights: Weights) -> Full<2, 3, 5> {
    let [a1, a2, b0] = START;
    let start = SVector::from([a1, a2, b0, 1.0, 1.0]);
    Full::new(
        ContinuousRls::<5, ExactHold>::with_integrator(start, SMatrix::identity(), weights)
            .unwrap(),
    )
}

/// Largest error of the parameters.
pub fn error(theta: &SVector<f64, 3>) -> f64 {
    (theta - SVector::from(THETA)).amax()
}
