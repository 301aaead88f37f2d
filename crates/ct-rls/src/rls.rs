//! The estimator for a number of parameters that is known when the program is built.

use nalgebra::{SMatrix, SVector};

use crate::estimator::{Health, Innovation, Outcome, RecursiveEstimator};
use crate::integrator::sealed::{Capped, Covariance, Refusal};
use crate::settings::{Guards, MAX_EPSILON, MAX_PHI_SQUARED, Step, Weights};
use crate::{Error, ExactHold, Integrator, UdFactor, factor};

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
/// Equations, assumptions and convergence: those of the integrator, [`ExactHold`] unless you compare.
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

    /// The factors of `P`.
    pub fn factor(&self) -> &UdFactor<P> {
        &self.state
    }

    /// `V = delta' P^-1 delta`, with `delta` from `theta` to the estimates: how far the estimates say it is away.
    pub fn distance(&self, theta: &SVector<f64, P>) -> f64 {
        self.state.information_norm(&(theta - self.theta))
    }
}

impl<const P: usize, I: Integrator> ContinuousRls<P, I> {
    /// An estimator with a named integrator: `ContinuousRls::<2, Euler>::with_integrator(...)`.
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

    /// Starts `P` again and keeps the estimates: after a jump of the parameters, or after a run has stopped.
    ///
    /// # Errors
    /// [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`], [`Error::TraceAboveLimit`]; nothing is changed then.
    pub fn reset_covariance(&mut self, p: &SMatrix<f64, P, P>) -> Result<(), Error> {
        let state = I::State::<P>::from_matrix(p)?;
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
    #[inline]
    pub fn update_with(&mut self, sample: &Sample<P>, dt: f64, weights: &Weights) -> Innovation {
        let epsilon = sample.y - factor::dot(sample.phi.as_slice(), self.theta.as_slice());
        let (step, outcome) = match self.guard.begin(sample.phi.as_slice(), dt, weights.eta()) {
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
        let outcome = self.guard.grown(step.growth, outcome, &mut self.state);
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

    #[inline]
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

/// With a smaller `f'P f` a step along `P f` may leave the floating-point range.
const MIN_RELAXED: f64 = 1e-200;

/// The start of the cap on the trace, times the trace of `P(0)`.
const TRACE_LIMIT: f64 = 1e6;

pub(crate) fn check_theta(theta: &[f64]) -> Result<(), Error> {
    match theta.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((index, &value)) => Err(Error::Theta { index, value }),
        None => Ok(()),
    }
}

/// Everything around the step that does not depend on how `P` is kept: guards, counts, and why the run stopped.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    pub guards: Guards,
    /// At least the trace of `P`: only `eta` raises it, so the trace itself is seldom needed.
    bound: f64,
    /// The cap in force.
    limit: f64,
    silent_below_squared: f64,
    pub step: Step,
    failure: Option<Error>,
    used: u64,
    unused: u64,
    capped: u64,
    silent: u64,
}

impl Guard {
    pub fn new(trace: f64) -> Result<Self, Error> {
        let guards = Guards {
            trace_limit: TRACE_LIMIT * trace,
            silent_below: 0.0,
        };
        guards.check(trace)?;
        Ok(Self {
            guards,
            bound: trace,
            limit: guards.cap(),
            silent_below_squared: 0.0,
            step: Step::none(),
            failure: None,
            used: 0,
            unused: 0,
            capped: 0,
            silent: 0,
        })
    }

    pub fn set(&mut self, guards: Guards, trace: f64) -> Result<(), Error> {
        guards.check(trace)?;
        self.guards = guards;
        self.limit = guards.cap();
        let squared = guards.silent_below * guards.silent_below.abs();
        self.silent_below_squared = squared.min(MAX_PHI_SQUARED);
        Ok(())
    }

    pub fn restart(&mut self, trace: f64) -> Result<(), Error> {
        self.guards.check(trace)?;
        self.bound = trace;
        self.failure = None;
        Ok(())
    }

    pub fn running(&self) -> Result<(), Error> {
        self.failure.map_or(Ok(()), Err)
    }

    pub fn skip(&mut self, outcome: Outcome) -> Outcome {
        self.unused += 1;
        outcome
    }

    /// The step to make, or why there is none.
    #[inline(always)]
    pub fn begin(&mut self, phi: &[f64], dt: f64, eta: f64) -> Result<(Step, Outcome), Outcome> {
        if self.failure.is_some() {
            return Err(self.skip(Outcome::Stopped));
        }
        if !self.step.matches(eta, dt) {
            match Step::new(eta, dt) {
                Some(step) => self.step = step,
                None => return Err(self.skip(Outcome::BadStep)),
            }
        }
        let squared: f64 = phi.iter().map(|x| x * x).sum();
        if squared <= self.silent_below_squared {
            Ok((self.step.remembering(), Outcome::Silent))
        } else if squared <= MAX_PHI_SQUARED {
            Ok((self.step, Outcome::Updated))
        } else {
            Err(self.skip(Outcome::NotFinite))
        }
    }

    #[cold]
    pub fn refused(&mut self, refusal: Refusal) -> Outcome {
        match refusal {
            Refusal::NotFinite => self.skip(Outcome::NotFinite),
            Refusal::Stop(error) => {
                self.failure = Some(error);
                self.skip(Outcome::Stopped)
            }
        }
    }

    /// Counts a step that was made, and caps the trace. A `P` below the cap before the step and scaled down to it after
    /// has grown by less than `e^{eta h}`, as if less had been forgotten.
    #[inline(always)]
    pub fn grown<S: Capped>(&mut self, growth: f64, outcome: Outcome, state: &mut S) -> Outcome {
        self.used += 1;
        self.silent += u64::from(outcome == Outcome::Silent);
        self.bound *= growth;
        if self.bound > self.limit && self.capped(state) {
            Outcome::Capped
        } else {
            outcome
        }
    }

    #[cold]
    fn capped<S: Capped>(&mut self, state: &mut S) -> bool {
        let (trace, limit) = (state.trace(), self.limit);
        if trace > limit {
            state.scale(limit / trace);
            self.bound = limit;
            self.capped += 1;
            true
        } else {
            self.bound = trace;
            false
        }
    }

    pub fn health(&self, largest: f64, smallest_pivot: f64, trace: f64) -> Health {
        Health {
            excitation: 1.0 / largest,
            smallest_pivot,
            trace,
            used: self.used,
            unused: self.unused,
            capped: self.capped,
            silent: self.silent,
        }
    }
}
