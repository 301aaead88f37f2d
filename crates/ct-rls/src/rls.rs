//! The estimator for a number of parameters that is known at compile time.

use nalgebra::{SMatrix, SVector};

use crate::estimator::{Health, Innovation, RecursiveEstimator};
use crate::guard::Guard;
use crate::integrator::sealed::{Capped, Covariance};
use crate::settings::{Guards, MAX_EPSILON, MAX_PHI_SQUARED, Weights};
use crate::{Error, ExactHold, FactoredIntegrator, Integrator, UdFactor, factor};

/// One sample: the output `y` and the regressor `phi`, held over the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const P: usize> {
    /// Regressor, one entry for each parameter. What contains derivatives comes from state variable filters,
    /// the same for `y` and for `phi`.
    pub phi: SVector<f64, P>,
    /// Output, the unit of `theta' phi`.
    pub y: f64,
}

impl<const P: usize> Sample<P> {
    /// A sample from plain numbers.
    pub fn new(phi: [f64; P], y: f64) -> Self {
        Self {
            phi: SVector::from(phi),
            y,
        }
    }

    /// The mean of this sample and the `next`: to hold over the step between them. For smooth signals the estimates are
    /// then of second order in the step, instead of first.
    #[must_use]
    pub fn midway(&self, next: &Self) -> Self {
        Self {
            phi: 0.5 * (self.phi + next.phi),
            y: 0.5 * (self.y + next.y),
        }
    }
}

/// Recursive least squares in continuous time, `P` parameters, no allocation.
///
/// Equations, assumptions and convergence: those of the integrator, [`ExactHold`] unless another is named, which also says what is
/// forgotten.
///
/// ```
/// use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
/// use nalgebra::{SMatrix, SVector};
///
/// // memory of 50 s, nothing known of the two parameters
/// let mut rls = ContinuousRls::<2>::new(SVector::zeros(), SMatrix::identity() * 1e3, Weights::least_squares(0.02)?)?;
/// for k in 0..1000 {
///     let u = if k % 60 < 30 { 1.0 } else { -1.0 };
///     rls.update(&Sample::new([u, 1.0], 2.0 * u + 0.5), 0.5);
/// }
/// assert!((rls.theta()[0] - 2.0).abs() < 1e-6);
/// assert!(rls.health()?.excitation > 1.0);
/// # Ok::<(), ct_rls::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ContinuousRls<const P: usize, I: Integrator = ExactHold> {
    pub(crate) theta: SVector<f64, P>,
    pub(crate) state: I::State<P>,
    pub(crate) weights: Weights,
    pub(crate) guard: Guard,
}

impl<const P: usize> ContinuousRls<P> {
    /// An estimator with the exact step.
    ///
    /// - `theta`: first guess, 0 where nothing is known.
    /// - `p`: how little is known: symmetric, positive definite; 10 to 1000 times the squared size of each parameter on the
    ///   diagonal is usual, 1e6 does no harm.
    ///
    /// # Errors
    /// [`Error::Theta`], [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`], [`Error::TraceAboveLimit`] beyond 1e100.
    pub fn new(
        theta: SVector<f64, P>,
        p: SMatrix<f64, P, P>,
        weights: Weights,
    ) -> Result<Self, Error> {
        Self::with_integrator(theta, p, weights)
    }
}

impl<const P: usize, I: FactoredIntegrator> ContinuousRls<P, I> {
    /// The factors of `P`.
    pub fn factor(&self) -> &UdFactor<P> {
        I::factor(&self.state)
    }

    /// `V = delta' P^-1 delta`, with `delta` from `theta` to the estimates: distance of the estimates from `theta`, relative to their
    /// uncertainty.
    pub fn distance(&self, theta: &SVector<f64, P>) -> f64 {
        self.factor().information_norm(&(theta - self.theta))
    }
}

impl<const P: usize, I: Integrator> ContinuousRls<P, I> {
    /// An estimator with a named integrator: `ContinuousRls::<2, Directional>::with_integrator(...)`.
    ///
    /// # Errors
    /// As of [`ContinuousRls::new`].
    pub fn with_integrator(
        theta: SVector<f64, P>,
        p: SMatrix<f64, P, P>,
        weights: Weights,
    ) -> Result<Self, Error> {
        check_theta(theta.as_slice())?;
        let state = I::State::<P>::from_matrix(&p)?;
        let guard = Guard::new(state.trace())?;
        Ok(Self {
            theta,
            state,
            weights,
            guard,
        })
    }

    /// Moves the estimates towards `f' theta = chi` along `P f`, and leaves `P` as it is: by the share
    /// `1 - exp(-pull f'P f)`, which is the exact solution of `dtheta/dt = w P f (chi - f' theta)` with `pull = w h`;
    /// `f64::INFINITY` moves all the way. At least 0.
    ///
    /// Returns `chi - f' theta` before; `None`, and nothing is done, where a number is out of range: `f` longer than 1e30, the
    /// returned difference above 1e100, `f'P f` below 1e-200 for an `f` other than 0.
    pub fn relax(&mut self, f: &SVector<f64, P>, chi: f64, pull: f64) -> Option<f64> {
        let epsilon = chi - f.dot(&self.theta);
        let (k, s) = self.state.times(f);
        if !(pull >= 0.0 && epsilon.abs() <= MAX_EPSILON && f.norm_squared() <= MAX_PHI_SQUARED) {
            return None;
        }
        if s >= MIN_RELAXED {
            let share = -libm::expm1(-pull * s);
            self.theta += k * (epsilon * share / s);
        } else if f.iter().any(|x| *x != 0.0) {
            return None;
        }
        Some(epsilon)
    }

    /// `L`, upper triangular, with `P = L L'`.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] where a rule other than [`ExactHold`] has lost it.
    #[inline]
    pub fn root(&self) -> Result<SMatrix<f64, P, P>, Error> {
        self.state.root()
    }

    /// The same estimator with other guards against wind-up.
    ///
    /// # Errors
    /// [`Error::Guard`], [`Error::TraceAboveLimit`].
    pub fn with_guards(mut self, guards: Guards) -> Result<Self, Error> {
        self.guard.set(guards, self.state.trace())?;
        Ok(self)
    }

    /// The guards in force.
    pub fn guards(&self) -> Guards {
        self.guard.guards
    }

    /// The weights in force where an update is not given others.
    pub fn weights(&self) -> Weights {
        self.weights
    }

    /// Other weights from now on.
    pub fn set_weights(&mut self, weights: Weights) {
        self.weights = weights;
    }

    /// Starts `P` again and keeps the estimates: after a step change of the parameters, or after a run has stopped.
    ///
    /// # Errors
    /// [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`], [`Error::TraceAboveLimit`]; nothing is changed then.
    pub fn reset_covariance(&mut self, p: &SMatrix<f64, P, P>) -> Result<(), Error> {
        let state = self.state.restarted(p)?;
        self.guard.restart(state.trace())?;
        self.state = state;
        Ok(())
    }

    /// Replaces the estimates and keeps `P`.
    ///
    /// # Errors
    /// [`Error::Theta`]; nothing is changed then.
    pub fn set_theta(&mut self, theta: SVector<f64, P>) -> Result<(), Error> {
        check_theta(theta.as_slice())?;
        self.theta = theta;
        Ok(())
    }

    /// [`update`](RecursiveEstimator::update) with weights for this step alone.
    #[inline(always)]
    pub fn update_with(&mut self, sample: &Sample<P>, dt: f64, weights: &Weights) -> Innovation {
        let epsilon = sample.y - factor::dot(sample.phi.as_slice(), self.theta.as_slice());
        let (step, outcome) = match self.guard.begin::<I>(sample.phi.as_slice(), dt, weights) {
            Ok(begun) => begun,
            Err(outcome) => return Innovation::unused(epsilon, outcome),
        };
        let [theta] = &mut self.theta.data.0;
        let [phi] = &sample.phi.data.0;
        let s = match I::step(theta, &mut self.state, phi, epsilon, weights, &step) {
            Ok(s) => s,
            Err(refusal) => {
                return Innovation::unused(epsilon, self.guard.refused(refusal));
            }
        };
        let outcome = self.guard.grown::<I, _>(&step, outcome, &mut self.state);
        Innovation {
            epsilon,
            s,
            outcome,
        }
    }
}

impl<const P: usize, I: Integrator> RecursiveEstimator for ContinuousRls<P, I> {
    type Sample = Sample<P>;
    type Theta = SVector<f64, P>;
    type Covariance = SMatrix<f64, P, P>;
    type Error = Error;

    #[inline(always)]
    fn update(&mut self, sample: &Sample<P>, dt: f64) -> Innovation {
        let weights = self.weights;
        self.update_with(sample, dt, &weights)
    }

    fn theta(&self) -> &SVector<f64, P> {
        &self.theta
    }

    fn covariance(&self) -> SMatrix<f64, P, P> {
        self.state.to_matrix()
    }

    fn health(&self) -> Result<Health, Error> {
        let lost = |(index, pivot)| Error::LostDefiniteness {
            integrator: I::NAME,
            index,
            pivot,
            dt: self.guard.step.dt,
        };
        self.guard.running()?;
        let pivot = self.state.smallest_pivot().map_err(lost)?;
        let mut m = self.state.to_matrix().data.0;
        let largest = factor::largest_eigenvalue(m.as_flattened_mut(), P);
        Ok(self.guard.health(largest, pivot, self.state.trace()))
    }
}

/// With a smaller `f'P f` a step along `P f` may overflow.
const MIN_RELAXED: f64 = 1e-200;

pub(crate) fn check_theta(theta: &[f64]) -> Result<(), Error> {
    match theta.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((index, &value)) => Err(Error::Theta { index, value }),
        None => Ok(()),
    }
}
