//! Random walk of the parameters, each with its own intensity: the form of the Kalman filter, with or without exponential forgetting.
//!
//! Model: `y = theta' phi`, `eps = y - theta^' phi`; `dtheta = dw` with `E dw dw' = Q dt`, `Q = diag(q_1, .., q_p)`, `q_i >= 0`:
//! ```text
//! dtheta^/dt = c P phi eps
//! dP/dt      = eta P + Q - gamma P phi phi' P
//! ```
//! For the Kalman filter `eta = 0` and `c = gamma = 1/r`, with `r` the intensity of white noise on `y` (unit(y)^2 s); with `c = gamma = 1`
//! `P` and `Q` are in units of that noise. `q` is what a parameter's variance grows by in a second: a parameter that drifts by `d` in `T`
//! seconds has `q = d^2/T` (divided by `r` where `c = 1`). Only a diagonal `Q` is offered: parameters that drift together need others.
//!
//! Assumptions: `phi`, `y` and the weights are constant over the step `h`. Equations: the whole walk of the step first, as the Kalman
//! filter predicts, then [`ExactHold`](crate::ExactHold)'s exact step:
//! ```text
//! P-     = P + Q (1 - e^{-eta h})/eta     (Q h for eta = 0)
//! P+     = e^{eta h} (P- - gamma b P- phi phi' P- / (1 + gamma b s)),   b = (e^{eta h} - 1)/eta,   s = phi' P- phi
//! theta+ = theta + P- phi eps (1 - D^{-c/gamma})/s,   D = 1 + gamma b s
//! ```
//! It is exact for `Q = 0`, and where the regressor is silent; else of first order in `h`. For a walk that moves only between samples
//! it is the Kalman filter itself.
//!
//! Bounds: `P` stays positive definite for every step, since each entry of `D` only grows in the first half and is multiplied by a
//! positive number in the second. Where the regressor excites persistently `P` is bounded; in a direction that stays silent it grows
//! linearly, by `q` a second, until its trace reaches [`trace_limit`](crate::Guards::trace_limit). There `P` as a whole is scaled down to
//! the limit in every step. With `eta = 0` that takes at most the share `h trace(Q)/trace_limit` from what is not silent, so
//! tracking goes on, if the limit is far above `P` there; but in a step that is scaled `V` may grow by as much.
//!
//! Convergence: with constant parameters `V = delta' P^-1 delta` decreases for every step below the cap, `0 <= gamma < 2 c`.
//!
//! Cost per update: that of the exact step, and for the i-th parameter with `q_i > 0`, `i = 0..p-1`, another `i^2` multiplications and `i`
//! divisions: `p^3/3` if all drift. So put the parameters that drift first.
//!
//! Reference: L. Ljung and S. Gunnarsson, *Adaptation and tracking in system identification: a survey*, Automatica 26, 1990.

use nalgebra::{SMatrix, SVector};

use crate::integrator::sealed::{
    Capped, Covariance, FactorRule, Memory, Refusal, Rule, step_on_factors,
};
use crate::integrator::{FactoredIntegrator, Integrator};
use crate::settings::{MAX_EPSILON, StepFactors, Weights, in_range};
use crate::{ContinuousRls, Error, UdFactor, factor};

/// Parameters that walk at random, on `P = U D U'`: an uncertainty that grows linearly. Positive definite whatever the step.
///
/// ```
/// use ct_rls::{ContinuousRls, RandomWalk, RecursiveEstimator, Sample, Weights};
/// use nalgebra::{SMatrix, SVector, vector};
///
/// // the first parameter drifts, the second is constant
/// let mut rls = ContinuousRls::<2, RandomWalk>::with_integrator(
///     SVector::zeros(), SMatrix::identity(), Weights::least_squares(0.0)?)?
///     .with_intensity(vector![0.01, 0.0])?;
/// for k in 0..20_000 {
///     let (t, u) = (0.5 * f64::from(k), if k % 60 < 30 { 1.0 } else { -1.0 });
///     rls.update(&Sample::new([u, 1.0], (2.0 + 1e-3 * t) * u + 0.5), 0.5);
/// }
/// assert!((rls.theta()[0] - 12.0).abs() < 0.02 && (rls.theta()[1] - 0.5).abs() < 0.02);
/// # Ok::<(), ct_rls::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct RandomWalk;

/// The factors of `P`, and what `P` grows by in a second.
#[derive(Clone, Copy, Debug)]
pub struct WalkState<const P: usize> {
    factor: UdFactor<P>,
    q: [f64; P],
}

/// Largest intensity `q`: in the longest step, 1e30 s, it raises `P` by at most 1e90, inside the limit of 1e100.
const MAX_INTENSITY: f64 = 1e60;

pub(crate) fn check_intensity(q: &[f64]) -> Result<(), Error> {
    let wrong = |q: &f64| !(*q >= 0.0 && *q <= MAX_INTENSITY);
    match q.iter().enumerate().find(|(_, q)| wrong(q)) {
        Some((index, &value)) => Err(Error::Intensity { index, value }),
        None => Ok(()),
    }
}

impl<const P: usize> ContinuousRls<P, RandomWalk> {
    /// The same estimator with the intensity `q` of each parameter's walk: its unit squared per second, 0 for a constant one, at
    /// most 1e60. [`with_integrator`](ContinuousRls::with_integrator) starts with 0 for all.
    ///
    /// # Errors
    /// [`Error::Intensity`].
    pub fn with_intensity(mut self, q: SVector<f64, P>) -> Result<Self, Error> {
        self.set_intensity(q)?;
        Ok(self)
    }

    /// Another intensity from now on.
    ///
    /// # Errors
    /// [`Error::Intensity`]; nothing is changed then.
    pub fn set_intensity(&mut self, q: SVector<f64, P>) -> Result<(), Error> {
        check_intensity(q.as_slice())?;
        [self.state.q] = q.data.0;
        Ok(())
    }

    /// The intensity in force, unit of `theta^2` per second.
    pub fn intensity(&self) -> SVector<f64, P> {
        self.state.q.into()
    }
}

impl Integrator for RandomWalk {}
impl FactoredIntegrator for RandomWalk {}

impl Memory for RandomWalk {
    #[cfg(feature = "serde")]
    const WALKS: bool = true;

    #[inline(always)]
    fn raised(bound: f64, step: &StepFactors, intensity: &[f64]) -> f64 {
        let walk: f64 = intensity.iter().sum();
        bound * step.growth + walk * step.length
    }
}

impl Rule for RandomWalk {
    const NAME: &'static str = "RandomWalk";
    type State<const P: usize> = WalkState<P>;

    #[inline(always)]
    fn step<const P: usize>(
        theta: &mut [f64; P],
        state: &mut WalkState<P>,
        phi: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        let WalkState { factor, q } = state;
        step_on_factors::<Self, P>(theta, factor, phi, epsilon, weights, step, q)
    }

    fn statement<const P: usize>(
        theta: &mut [f64; P],
        state: &mut WalkState<P>,
        f: &[f64; P],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
    ) -> Result<f64, Refusal> {
        let factor = &mut state.factor;
        step_on_factors::<Self, P>(theta, factor, f, epsilon, weights, step, &[])
    }
}

impl FactorRule for RandomWalk {
    fn factor<const P: usize>(state: &WalkState<P>) -> &UdFactor<P> {
        &state.factor
    }

    fn factor_mut<const P: usize>(state: &mut WalkState<P>) -> &mut UdFactor<P> {
        &mut state.factor
    }

    #[inline(always)]
    fn advance(
        (u, d, theta): (&mut [f64], &mut [f64], &mut [f64]),
        (f, k): (&mut [f64], &mut [f64]),
        phi: &[f64],
        epsilon: f64,
        weights: &Weights,
        step: &StepFactors,
        intensity: &[f64],
    ) -> Option<f64> {
        if !(in_range(weights, step, phi) && epsilon.abs() <= MAX_EPSILON) {
            return None;
        }
        let length = step.length / step.growth;
        for (j, q) in intensity.iter().enumerate() {
            if *q > 0.0 {
                raise(u, d, j, q * length, k);
            }
        }
        let hold = (step.growth, step.length);
        factor::exact_step((u, d, theta), (f, k), phi, epsilon, weights, hold)
    }
}

/// Adds `more`, above 0, to entry (j, j) of `U D U'`: Agee and Turner's update by a unit vector, which leaves the later columns alone.
#[inline(always)]
fn raise(u: &mut [f64], d: &mut [f64], j: usize, more: f64, left: &mut [f64]) {
    let p = d.len();
    let raised = d[j] + more;
    let kept = d[j] / raised;
    d[j] = raised;
    // the loss of this column is added to the block before it, as one more rank-one term
    let mut weight = more * kept;
    for (left, u) in left.iter_mut().zip(&mut u[j * p..j * p + j]) {
        *left = *u;
        *u *= kept;
    }
    for m in (0..j).rev() {
        let own = left[m];
        // in this order no product overflows
        let gain = weight * own;
        let raised = d[m] + gain * own;
        let inverse = 1.0 / raised;
        let share = gain * inverse;
        weight *= d[m] * inverse;
        d[m] = raised;
        let column = &mut u[m * p..m * p + m];
        for i in 0..m {
            left[i] -= own * column[i];
            column[i] += share * left[i];
        }
    }
}

impl<const P: usize> Capped for WalkState<P> {
    fn trace(&self) -> f64 {
        self.factor.trace()
    }

    fn scale(&mut self, factor: f64) {
        self.factor.scale(factor);
    }

    #[inline(always)]
    fn intensity(&self) -> &[f64] {
        &self.q
    }

    #[cfg(feature = "serde")]
    fn set_intensity(&mut self, q: &[f64]) {
        self.q.copy_from_slice(q);
    }
}

impl<const P: usize> Covariance<P> for WalkState<P> {
    fn from_matrix(matrix: &SMatrix<f64, P, P>) -> Result<Self, Error> {
        let factor = UdFactor::new(matrix)?;
        Ok(Self {
            factor,
            q: [0.0; P],
        })
    }

    fn restarted(&self, matrix: &SMatrix<f64, P, P>) -> Result<Self, Error> {
        let factor = UdFactor::new(matrix)?;
        Ok(Self { factor, q: self.q })
    }

    fn to_matrix(&self) -> SMatrix<f64, P, P> {
        self.factor.to_matrix()
    }

    fn times(&self, x: &SVector<f64, P>) -> (SVector<f64, P>, f64) {
        self.factor.times(x)
    }

    fn root(&self) -> Result<SMatrix<f64, P, P>, Error> {
        Ok(self.factor.root())
    }

    fn smallest_pivot(&self) -> Result<f64, (usize, f64)> {
        self.factor.smallest_pivot()
    }
}
