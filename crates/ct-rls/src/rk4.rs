//! The classical Runge-Kutta rule of fourth order: to compare with.
//!
//! Model and assumptions as of [`ExactHold`](crate::ExactHold); `dtheta/dt` and `dP/dt` are evaluated four times per step. The largest
//! stable step is little longer than for Euler's rule; if `P` would lose its positive definiteness, the step is not made, the run stops
//! with its estimates, and the health is [`Error::LostDefiniteness`](crate::Error::LostDefiniteness).
//!
//! Cost per update: about `14 p^2` multiplications, and `p^3/6` for the check. Reference: A. J. Udink ten Cate, WP-85-54, 1985, (2.14).

use crate::Error;
use crate::factor::dot;
use crate::integrator::sealed::{Covariance, Memory, Refusal, Rule};
use crate::integrator::{Integrator, Plain, take};
use crate::settings::{MAX_EPSILON, StepFactors, Weights};

/// Runge-Kutta method of fourth order for the full matrix `P`. Stops if `P` is no longer positive definite.
#[derive(Clone, Copy, Debug)]
pub struct Rk4;

impl Integrator for Rk4 {}

impl Memory for Rk4 {}

impl Rule for Rk4 {
    const NAME: &'static str = "The Runge-Kutta rule";
    type State<const P: usize> = Plain<P>;

    fn step<const P: usize>(
        theta: &mut [f64; P],
        state: &mut Plain<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        let s = dot(&state.times(phi), phi);
        if !(s.is_finite() && epsilon.abs() <= MAX_EPSILON) {
            return Err(Refusal::NotFinite);
        }
        let (eta, gamma, c, h) = (step.eta(), weights.gamma(), weights.c(), step.dt);
        // theta^ changes by `shift`, so eps - shift' phi is the error at the intermediate points.
        let (mut at, mut shift) = (*state, [0.0; P]);
        let (mut next, mut moved) = (state.0, [0.0; P]);
        for (reach, share) in [
            (0.5, 1.0 / 6.0),
            (0.5, 1.0 / 3.0),
            (1.0, 1.0 / 3.0),
            (0.0, 1.0 / 6.0),
        ] {
            let k = at.times(phi);
            let error = epsilon - dot(&shift, phi);
            for i in 0..P {
                for j in 0..P {
                    let slope = eta * at.0[i][j] - gamma * (k[i] * k[j]);
                    next[i][j] += share * h * slope;
                    at.0[i][j] = state.0[i][j] + reach * h * slope;
                }
                let slope = c * error * k[i];
                moved[i] += share * h * slope;
                shift[i] = reach * h * slope;
            }
        }
        let next = Plain(next);
        if let Err((index, pivot)) = next.smallest_pivot() {
            return Err(Refusal::Stop(Error::LostDefiniteness {
                integrator: Self::NAME,
                index,
                pivot,
                dt: h,
            }));
        }
        for (moved, theta) in moved.iter_mut().zip(&*theta) {
            *moved += theta;
        }
        take(theta, state, moved, next)?;
        Ok(s)
    }
}
