//! Effect of two adaptive blocks and a constant gain on one error over a step: three integrals.

use ct_rls::Weights;

/// A block of the adaptive gain: its weights, and `s = phi'P phi` at the step's start.
pub(crate) struct Block {
    pub weights: Weights,
    pub s: f64,
}

impl Block {
    /// `c e^{eta t}/d` and `(c/gamma) ln d` at `t`, with `d = 1 + gamma s b`.
    fn at(&self, t: f64) -> (f64, f64) {
        let (c, gamma, eta) = (self.weights.c(), self.weights.gamma(), self.weights.eta());
        let grown = libm::expm1(eta * t);
        let b = if eta * t < f64::EPSILON {
            t
        } else {
            grown / eta
        };
        let x = gamma * self.s * b;
        let exponent = if x < f64::EPSILON {
            c * self.s * b
        } else {
            c / gamma * libm::log1p(x)
        };
        (c * (1.0 + grown) / (1.0 + x), exponent)
    }
}

/// Gauss and Legendre's points on (0, 1) and their weights, 8 of them: the first half, the rest by symmetry.
const POINTS: [(f64, f64); 4] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_65),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
];

/// Beyond this exponent the error is negligible.
const GONE: f64 = 45.0;

/// Pieces for each `e`-fold of `1 + (rates) t`: with 2 the integrals are right to 1e-9.
const PIECES: f64 = 2.0;

/// Over `dt` seconds, `int c_i e^{eta_i t}/d_i x dt` of both blocks and `int x dt`, where `x = eps(t)/eps(0)` and the constant gain lets
/// the error decay at the rate `l`, 1/s.
pub(crate) fn shares(blocks: [Block; 2], l: f64, dt: f64) -> [f64; 3] {
    let at = |t: f64| {
        let ((one, decay1), (two, decay2)) = (blocks[0].at(t), blocks[1].at(t));
        let left = libm::exp(-decay1 - decay2 - l * t);
        [one * left, two * left, left]
    };
    let speed = blocks
        .iter()
        .map(|block| block.weights.c() * block.s)
        .sum::<f64>()
        + l;
    let rate = speed + blocks[0].weights.eta() + blocks[1].weights.eta();
    let mut sums = [0.0; 3];
    let mut add = |t: f64, weight: f64| {
        for (sum, value) in sums.iter_mut().zip(at(t)) {
            *sum += weight * value;
        }
    };
    if rate * dt < f64::EPSILON {
        add(0.0, dt);
        return sums;
    }
    // in x = ln(1 + rate t) every decay takes a range of the order of 1
    let range = libm::log1p(rate * dt).min(libm::log1p(GONE * rate / l));
    let pieces = libm::ceil(PIECES * range).max(1.0);
    let length = range / pieces;
    for piece in 0..pieces as u32 {
        for (point, weight) in POINTS {
            for point in [point, 1.0 - point] {
                let rate_t = libm::expm1((f64::from(piece) + point) * length);
                add(rate_t / rate, weight * length * (1.0 + rate_t) / rate);
            }
        }
    }
    // the error's end is known: scaled to it, no rule passes 0
    let (ends, end) = (blocks[0].at(dt).1 + blocks[1].at(dt).1, l * dt);
    let moved = blocks[0].s * sums[0] + blocks[1].s * sums[1] + l * sums[2];
    let scale = -libm::expm1(-ends - end) / moved;
    if scale.is_finite() {
        sums = sums.map(|sum| sum * scale);
    }
    sums
}
