//! The exact solution of the estimator's equations over a step with held signals.
//!
//! Model: `y = theta' phi`, `eps = y - theta^' phi`; [U] 2.14:
//! ```text
//! dtheta^/dt = c P phi eps
//! dP/dt      = eta P - gamma P phi phi' P
//! ```
//! Assumptions: `phi`, `y`, `c`, `gamma` and `eta` are constant over the step `h`. For smooth signals holding the value
//! at the step's start costs first order in `h`, holding [`Sample::midway`](crate::Sample::midway) second order.
//!
//! Equations:
//! ```text
//! b      = (e^{eta h} - 1)/eta                (h for eta = 0)
//! s      = phi' P phi,   D = 1 + gamma b s
//! P+     = e^{eta h} (P - gamma b P phi phi' P / D)
//! theta+ = theta + P phi eps (1 - D^{-c/gamma})/s
//! ```
//! The last factor is `c b/D` for `gamma = c` and `(1 - e^{-c b s})/s` for `gamma = 0`. With
//! `V = delta' P^-1 delta`, `delta = theta - theta^`, and signals that obey the model,
//! ```text
//! V+ = e^{-eta h} (V - eps^2 (1 - D^{1 - 2c/gamma})/s)
//! ```
//! Convergence: `V` decreases for every step, every regressor and every `P(0) > 0` where `0 <= gamma < 2 c` and
//! `eta >= 0`; `theta^` converges as `e^{-eta t/2}` where the regressor excites persistently, so that
//! `P^-1` stays above some multiple of the identity.
//!
//! Cost per update: `2 p^2` multiplications and `p` divisions, on the factors `P = U D U'`, which cannot lose definiteness.
//!
//! Reference: A. J. Udink ten Cate, *Continuous-time constrained least-squares algorithms for recursive parameter estimation of stochastic
//! linear systems by a stabilized output error method*, WP-85-54, IIASA, Laxenburg, 1985, section 2.

use nalgebra::{SMatrix, SVector};

use crate::integrator::sealed::{
    Capped, Covariance, FactorRule, Memory, Refusal, Rule, step_on_factors,
};
use crate::integrator::{FactoredIntegrator, Integrator};
use crate::settings::{StepFactors, Weights};
use crate::{Error, UdFactor, factor};

/// The exact solution for held signals, on `P = U D U'`: the default. Positive definite whatever the step.
#[derive(Clone, Copy, Debug)]
pub struct ExactHold;

impl Integrator for ExactHold {}
impl FactoredIntegrator for ExactHold {}

impl Memory for ExactHold {}

impl Rule for ExactHold {
    const NAME: &'static str = "ExactHold";
    type State<const P: usize> = UdFactor<P>;

    #[inline(always)]
    fn step<const P: usize>(
        theta: &mut [f64; P],
        state: &mut UdFactor<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        step_on_factors::<Self, P>(theta, state, phi, epsilon, weights, step, &[])
    }
}

impl FactorRule for ExactHold {
    fn factor<const P: usize>(state: &UdFactor<P>) -> &UdFactor<P> {
        state
    }

    fn factor_mut<const P: usize>(state: &mut UdFactor<P>) -> &mut UdFactor<P> {
        state
    }

    #[inline(always)]
    fn advance(
        parts: (&mut [f64], &mut [f64], &mut [f64]),
        scratch: (&mut [f64], &mut [f64]),
        phi: &[f64],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
        _intensity: &[f64],
    ) -> Option<f64> {
        let hold = (step.growth, step.length);
        factor::exact_step(parts, scratch, phi, epsilon, weights, hold)
    }
}

impl<const P: usize> Capped for UdFactor<P> {
    fn trace(&self) -> f64 {
        self.trace()
    }

    fn scale(&mut self, factor: f64) {
        for d in &mut self.d {
            *d *= factor;
        }
    }
}

impl<const P: usize> Covariance<P> for UdFactor<P> {
    fn from_matrix(matrix: &SMatrix<f64, P, P>) -> Result<Self, Error> {
        Self::new(matrix)
    }

    fn to_matrix(&self) -> SMatrix<f64, P, P> {
        self.to_matrix()
    }

    fn times(&self, x: &SVector<f64, P>) -> (SVector<f64, P>, f64) {
        self.times(x)
    }

    #[inline]
    fn root(&self) -> Result<SMatrix<f64, P, P>, Error> {
        Ok(self.root())
    }

    fn smallest_pivot(&self) -> Result<f64, (usize, f64)> {
        let mut smallest = f64::INFINITY;
        for (j, &d) in self.d.iter().enumerate() {
            if !(d > 0.0 && d.is_finite()) {
                return Err((j, d));
            }
            smallest = smallest.min(d);
        }
        Ok(smallest)
    }
}
