//! Euler's rule, as in the paper's simulations: to compare with.
//!
//! Model and assumptions as of [`ExactHold`](crate::ExactHold). Equations:
//! ```text
//! theta+ = theta + h c P phi eps,    P+ = P + h (eta P - gamma P phi phi' P)
//! ```
//! `P` stays positive definite only while `gamma h phi'P phi < 1 + eta h`: the paper's "numerical difficulties" for larger
//! `P(0)`. A step beyond that is not made: the run stops with its estimates, and the health is
//! [`Error::EulerLimit`](crate::Error::EulerLimit).
//!
//! Cost per update: `2 p^2` multiplications. Reference: A. J. Udink ten Cate, WP-85-54, 1985, section 6.

use crate::Error;
use crate::factor::dot;
use crate::integrator::sealed::{Memory, Refusal, Rule};
use crate::integrator::{Integrator, Plain, take};
use crate::settings::{MAX_EPSILON, StepFactors, Weights};

/// Euler's rule for the full matrix `P`. Stops if its step is too long.
#[derive(Clone, Copy, Debug)]
pub struct Euler;

impl Integrator for Euler {}

impl Memory for Euler {}

impl Rule for Euler {
    const NAME: &'static str = "Euler's rule";
    type State<const P: usize> = Plain<P>;

    fn step<const P: usize>(
        theta: &mut [f64; P],
        state: &mut Plain<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        let k = state.times(phi);
        let s = dot(&k, phi);
        let (gain, limit) = (weights.gamma() * step.dt * s, 1.0 + step.eta() * step.dt);
        if !(gain.is_finite() && epsilon.abs() <= MAX_EPSILON) {
            return Err(Refusal::NotFinite);
        }
        if gain >= limit {
            return Err(Refusal::Stop(Error::EulerLimit {
                gain,
                limit,
                dt: step.dt,
            }));
        }
        if s < 0.0 {
            return Err(Refusal::Stop(Error::LostDefiniteness {
                integrator: Self::NAME,
                index: 0,
                pivot: s,
                dt: step.dt,
            }));
        }
        let rate = weights.gamma() * step.dt;
        let (mut next, mut moved) = (state.0, *theta);
        for i in 0..P {
            for j in 0..P {
                // the same bits for (i, j) and (j, i)
                next[i][j] = limit * next[i][j] - rate * (k[i] * k[j]);
            }
            moved[i] += weights.c() * step.dt * epsilon * k[i];
        }
        take(theta, state, moved, Plain(next))?;
        Ok(s)
    }
}
