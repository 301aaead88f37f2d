//! Two blocks of parameters that share one output and have no covariance between them.
//!
//! Model: `y = theta1'phi1 + theta2'phi2`, with a `P` that has no entries between the blocks; [U] 4.11, 4.18:
//! ```text
//! eps        = y - theta1^'phi1 - theta2^'phi2
//! dtheta_i^/dt = c_i P_i phi_i eps
//! dP_i/dt      = eta_i P_i - gamma_i P_i phi_i phi_i' P_i
//! ```
//! Assumption: `phi_i`, `y` and the weights are constant over the step `h`. Equations, with `b_i = (e^{eta_i t} - 1)/eta_i`,
//! `s_i = phi_i'P_i phi_i` at the step's start and `d_i = 1 + gamma_i b_i s_i`:
//! ```text
//! eps(t)   = eps(0) d_1^{-c_1/gamma_1} d_2^{-c_2/gamma_2}
//! theta_i+ = theta_i + P_i phi_i eps(0) int_0^h c_i e^{eta_i t} (eps(t)/eps(0))/d_i dt
//! P_i+     as of one block
//! ```
//! The integrals have no closed form that keeps its digits; with `c = gamma` Gauss and Legendre's rule of 8 points in `ln(1 + (s_1 + s_2)
//! b)` gives them to 7e-7 for `b s` up to 100, to 1e-12 below 0.1. Updating one block after the other instead has an error of a third if
//! the step is stiff. For `gamma < c` the range is cut into pieces; for `gamma = 0` in both there is a closed form.
//!
//! Convergence: **not** that of one block. `V = sum delta_i'P_i^-1 delta_i` may grow for every `gamma > 0`; with `gamma = 0` and
//! `eta = 0` in both it falls, `dV/dt = -2 c eps^2` for `c_1 = c_2`.
//!
//! Cost: that of both blocks, and 8 evaluations of both integrands, each with an exponential where `(s_1 + s_2) b` is above 0.1.

use nalgebra::SVector;

use crate::estimator::Innovation;
use crate::integrator::sealed::{Block, BlockRule, Refusal, Rule};
use crate::outcome::Outcome;
use crate::settings::{MAX_EPSILON, StepFactors, Weights};
use crate::{ContinuousRls, Euler, ExactHold, Integrator, UdFactor, factor};

/// An integrator that can carry two blocks with one output error: [`ExactHold`] or [`Euler`].
pub trait BlockIntegrator: Integrator + BlockRule {}

impl BlockIntegrator for ExactHold {}
impl BlockIntegrator for Euler {}

/// Advances two estimators whose regressors together explain one output, by `dt` seconds over which everything is held.
///
/// `epsilon` is `y - theta1'phi1 - theta2'phi2`, which the caller knows. In the innovation `s` is the sum over the blocks. Where one
/// block cannot use the sample, none does.
pub fn update_blocks<const A: usize, const B: usize, I: BlockIntegrator>(
    (first, phi1): (&mut ContinuousRls<A, I>, &SVector<f64, A>),
    (second, phi2): (&mut ContinuousRls<B, I>, &SVector<f64, B>),
    epsilon: f64,
    dt: f64,
) -> Innovation {
    let (w1, w2) = (first.weights, second.weights);
    let begun = (
        first.guard.begin::<I>(phi1.as_slice(), dt, &w1),
        second.guard.begin::<I>(phi2.as_slice(), dt, &w2),
    );
    let ((step1, outcome1), (step2, outcome2)) = match begun {
        (Ok(one), Ok(two)) => (one, two),
        (Ok(_), Err(outcome)) => {
            return Innovation::unused(epsilon, first.guard.skip(outcome));
        }
        (Err(outcome), Ok(_)) => {
            return Innovation::unused(epsilon, second.guard.skip(outcome));
        }
        (Err(outcome), Err(_)) => return Innovation::unused(epsilon, outcome),
    };
    let ([theta1], [theta2]) = (&mut first.theta.data.0, &mut second.theta.data.0);
    let ([phi1], [phi2]) = (&phi1.data.0, &phi2.data.0);
    let made = I::blocks(
        (theta1, &mut first.state, phi1, &w1, &step1),
        (theta2, &mut second.state, phi2, &w2, &step2),
        epsilon,
    );
    let s = match made {
        Ok(s) => s,
        Err(refusal) => {
            second.guard.refused(refusal);
            return Innovation::unused(epsilon, first.guard.refused(refusal));
        }
    };
    let one = first
        .guard
        .grown::<I, _>(&step1, outcome1, &mut first.state);
    let two = second
        .guard
        .grown::<I, _>(&step2, outcome2, &mut second.state);
    let outcome = match (one, two) {
        (Outcome::Capped, _) | (_, Outcome::Capped) => Outcome::Capped,
        // the second block may have no excitation for long, for example if the model is right
        (one, _) => one,
    };
    Innovation {
        epsilon,
        s,
        outcome,
    }
}

impl BlockRule for Euler {
    #[inline(always)]
    fn blocks<const A: usize, const B: usize>(
        (theta1, state1, phi1, w1, step1): Block<'_, A, Self::State<A>>,
        (theta2, state2, phi2, w2, step2): Block<'_, B, Self::State<B>>,
        epsilon: f64,
    ) -> Result<f64, Refusal> {
        let before = (*theta1, *state1);
        let s1 = Self::step(theta1, state1, phi1, epsilon, w1, step1)?;
        match Self::step(theta2, state2, phi2, epsilon, w2, step2) {
            Ok(s2) => Ok(s1 + s2),
            Err(refusal) => {
                (*theta1, *state1) = before;
                Err(refusal)
            }
        }
    }
}

impl BlockRule for ExactHold {
    #[inline(always)]
    fn blocks<const A: usize, const B: usize>(
        (theta1, state1, phi1, w1, step1): Block<'_, A, UdFactor<A>>,
        (theta2, state2, phi2, w2, step2): Block<'_, B, UdFactor<B>>,
        epsilon: f64,
    ) -> Result<f64, Refusal> {
        let (mut f1, mut f2) = ([0.0; A], [0.0; B]);
        let (mut k1, mut k2) = ([0.0; A], [0.0; B]);
        let s1 = factor::project(state1.u.as_flattened(), &state1.d, phi1, &mut f1);
        let s2 = factor::project(state2.u.as_flattened(), &state2.d, phi2, &mut f2);
        let (a1, a2) = (w1.gamma() * step1.length, w2.gamma() * step2.length);
        let size = (w1.c() * step1.length + a1) * s1 + (w2.c() * step2.length + a2) * s2;
        // both weights times s, without the step, are what the integrals divide by
        let rates = 2.0 * (w1.c() * s1 + w2.c() * s2);
        if !(size.is_finite() && rates.is_finite() && epsilon.abs() <= MAX_EPSILON) {
            return Err(Refusal::NotFinite);
        }
        let [share1, share2] = if size < f64::EPSILON {
            // the error does not change over the step; below that, what the integrals divide by may be subnormal
            [w1.c() * step1.length, w2.c() * step2.length]
        } else {
            shares((w1, step1, s1), (w2, step2, s2))
        };
        let (u1, u2) = (state1.u.as_flattened_mut(), state2.u.as_flattened_mut());
        factor::absorb(u1, &mut state1.d, &f1, a1, step1.growth, &mut k1);
        factor::absorb(u2, &mut state2.d, &f2, a2, step2.growth, &mut k2);
        for (theta, k) in theta1.iter_mut().zip(k1) {
            *theta += k * (epsilon * share1);
        }
        for (theta, k) in theta2.iter_mut().zip(k2) {
            *theta += k * (epsilon * share2);
        }
        Ok(s1 + s2)
    }
}

/// Gauss and Legendre's points on (0, 1) and their weights, 8 of them: the first half, the rest by symmetry.
const POINTS: [(f64, f64); 4] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_65),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
];

/// Pieces of the range where the error does not decay as for least squares.
const PIECES: u32 = 8;

/// Factor of `P_i phi_i eps(0)` over the step.
fn shares(
    (w1, step1, s1): (&Weights, &StepFactors, f64),
    (w2, step2, s2): (&Weights, &StepFactors, f64),
) -> [f64; 2] {
    let (c1, c2, b) = (w1.c(), w2.c(), step1.length);
    let rate = c1 * s1 + c2 * s2;
    let same_memory = step1.eta() == step2.eta();
    if w1.gamma() == 0.0 && w2.gamma() == 0.0 && same_memory {
        let x = rate * b;
        let decayed = if x < f64::EPSILON {
            b
        } else {
            -libm::expm1(-x) / rate
        };
        return [c1 * decayed, c2 * decayed];
    }
    // both integrands over b of the first block, at one of its values
    let least_squares = w1.gamma() == c1 && w2.gamma() == c2;
    let at = |b: f64| {
        let (b2, growth) = if same_memory {
            (b, 1.0)
        } else {
            second_length(b, step1, step2)
        };
        let (d1, d2) = (1.0 + w1.gamma() * s1 * b, 1.0 + w2.gamma() * s2 * b2);
        let remains = if least_squares {
            1.0 / (d1 * d2)
        } else {
            libm::exp(-exponent(w1, s1, b) - exponent(w2, s2, b2))
        };
        [c1 * remains / d1, c2 * remains * growth / d2]
    };
    let mut sum = [0.0; 2];
    let mut add = |weight: f64, [one, two]: [f64; 2]| {
        sum[0] += weight * one;
        sum[1] += weight * two;
    };
    if rate * b < 0.1 && step1.eta() * step1.dt < 0.1 && step2.eta() * step2.dt < 0.1 {
        // nearly polynomials in b itself
        for (x, weight) in POINTS {
            add(weight * b, at(x * b));
            add(weight * b, at((1.0 - x) * b));
        }
        return sum;
    }
    let whole = libm::log1p(rate * b);
    let (pieces, range) = if least_squares && same_memory {
        (1, whole)
    } else {
        // the slower of two decays; beyond 45 the result is zero
        let power = (c1 / w1.gamma()).min(c2 / w2.gamma());
        (PIECES, whole.min(4.0 + 45.0 / power))
    };
    let length = range / f64::from(pieces);
    for piece in 0..pieces {
        for (x, weight) in POINTS {
            for x in [x, 1.0 - x] {
                let rate_b = libm::expm1((f64::from(piece) + x) * length);
                let jacobian = (1.0 + rate_b) / rate;
                add(weight * length * jacobian, at(rate_b / rate));
            }
        }
    }
    sum
}

/// `b_2` and `e^{(eta_2 - eta_1) t}` at the time where the first block has `b`.
fn second_length(b: f64, step1: &StepFactors, step2: &StepFactors) -> (f64, f64) {
    let (eta1, eta2) = (step1.eta(), step2.eta());
    let t = if eta1 * b < f64::EPSILON {
        b
    } else {
        libm::log1p(eta1 * b) / eta1
    };
    let b2 = if eta2 * t < f64::EPSILON {
        t
    } else {
        libm::expm1(eta2 * t) / eta2
    };
    (b2, libm::exp((eta2 - eta1) * t))
}

/// `(c/gamma) ln(1 + gamma s b)`, `c s b` for `gamma -> 0`.
fn exponent(w: &Weights, s: f64, b: f64) -> f64 {
    let x = w.gamma() * s * b;
    if x < f64::EPSILON {
        w.c() * s * b
    } else {
        w.c() * libm::log1p(x) / w.gamma()
    }
}
