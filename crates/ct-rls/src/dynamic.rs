//! The estimator for a number of parameters that is known only at run time, on factors in vectors. The same code does the step
//! as for [`ContinuousRls`](crate::ContinuousRls), so the numbers are the same to the bit.

extern crate alloc;

use alloc::vec;
use alloc::vec::Vec;
use core::marker::PhantomData;

use nalgebra::{DMatrix, DVector};

use crate::estimator::{Health, Innovation, RecursiveEstimator};
use crate::guard::Guard;
use crate::integrator::sealed::{Capped, Refusal};
use crate::outcome::Outcome;
use crate::random_walk::check_intensity;
use crate::rls::check_theta;
use crate::{Error, ExactHold, FactoredIntegrator, Guards, RandomWalk, Weights, factor};

/// One sample for a [`DynamicRls`].
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicSample {
    /// Regressor, one entry for each parameter.
    pub phi: DVector<f64>,
    /// Output, the unit of `theta' phi`.
    pub y: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Factors {
    pub u: Vec<f64>,
    pub d: Vec<f64>,
    /// Intensities of the random walk; empty without one.
    pub q: Vec<f64>,
}

impl Capped for Factors {
    fn trace(&self) -> f64 {
        factor::trace(&self.u, &self.d)
    }

    fn scale(&mut self, by: f64) {
        for d in &mut self.d {
            *d *= by;
        }
    }

    fn intensity(&self) -> &[f64] {
        &self.q
    }
}

/// Recursive least squares in continuous time, for any number of parameters; allocates when it is made. The exact step with
/// exponential forgetting, unless another [`FactoredIntegrator`] is named.
#[derive(Clone, Debug)]
pub struct DynamicRls<I: FactoredIntegrator = ExactHold> {
    pub(crate) theta: DVector<f64>,
    pub(crate) state: Factors,
    pub(crate) scratch: [Vec<f64>; 2],
    pub(crate) weights: Weights,
    pub(crate) guard: Guard,
    pub(crate) integrator: PhantomData<I>,
}

impl DynamicRls {
    /// As [`ContinuousRls::new`](crate::ContinuousRls::new), with the number of parameters of `theta`.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::Theta`], [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`],
    /// [`Error::TraceAboveLimit`] beyond 1e100.
    pub fn new(theta: DVector<f64>, p: &DMatrix<f64>, weights: Weights) -> Result<Self, Error> {
        Self::with_integrator(theta, p, weights)
    }
}

impl DynamicRls<RandomWalk> {
    /// As [`ContinuousRls::with_intensity`](crate::ContinuousRls::with_intensity), one intensity for each parameter.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::Intensity`].
    pub fn with_intensity(mut self, q: &[f64]) -> Result<Self, Error> {
        let (found, expected) = (q.len(), self.theta.len());
        if found != expected {
            return Err(Error::Size {
                what: "the intensity",
                found,
                expected,
            });
        }
        check_intensity(q)?;
        self.state.q = q.to_vec();
        Ok(self)
    }
}

impl<I: FactoredIntegrator> DynamicRls<I> {
    /// An estimator with a named integrator: `DynamicRls::<Directional>::with_integrator(...)`.
    ///
    /// # Errors
    /// As of [`DynamicRls::new`].
    pub fn with_integrator(
        theta: DVector<f64>,
        p: &DMatrix<f64>,
        weights: Weights,
    ) -> Result<Self, Error> {
        check_theta(theta.as_slice())?;
        let state = factors(p, theta.len())?;
        let guard = Guard::new(state.trace())?;
        let scratch = [vec![0.0; theta.len()], vec![0.0; theta.len()]];
        Ok(Self {
            theta,
            state,
            scratch,
            weights,
            guard,
            integrator: PhantomData,
        })
    }

    /// The same estimator with other guards against wind-up.
    ///
    /// # Errors
    /// [`Error::Guard`], [`Error::TraceAboveLimit`].
    pub fn with_guards(mut self, guards: Guards) -> Result<Self, Error> {
        self.guard.set(guards, self.state.trace())?;
        Ok(self)
    }

    /// Starts `P` again and keeps the estimates: after a step change of the parameters.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`], [`Error::TraceAboveLimit`]; nothing is
    /// changed then.
    pub fn reset_covariance(&mut self, p: &DMatrix<f64>) -> Result<(), Error> {
        let mut state = factors(p, self.theta.len())?;
        self.guard.restart(state.trace())?;
        core::mem::swap(&mut state.q, &mut self.state.q);
        self.state = state;
        Ok(())
    }

    /// Replaces the estimates and keeps `P`; allocates nothing.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::Theta`]; nothing is changed then.
    pub fn set_theta(&mut self, theta: &[f64]) -> Result<(), Error> {
        let (found, expected) = (theta.len(), self.theta.len());
        if found != expected {
            return Err(Error::Size {
                what: "theta",
                found,
                expected,
            });
        }
        check_theta(theta)?;
        self.theta.as_mut_slice().copy_from_slice(theta);
        Ok(())
    }

    /// [`update`](RecursiveEstimator::update) from a slice, with weights for this step alone; allocates nothing.
    pub fn update_with(&mut self, phi: &[f64], y: f64, dt: f64, weights: &Weights) -> Innovation {
        if phi.len() != self.theta.len() {
            return Innovation::unused(f64::NAN, self.guard.skip(Outcome::BadSize));
        }
        let epsilon = y - factor::dot(phi, self.theta.as_slice());
        let (step, outcome) = match self.guard.begin::<I>(phi, dt, weights) {
            Ok(begun) => begun,
            Err(outcome) => return Innovation::unused(epsilon, outcome),
        };
        let [f, k] = &mut self.scratch;
        let made = I::advance(
            (
                &mut self.state.u,
                &mut self.state.d,
                self.theta.as_mut_slice(),
            ),
            (f, k),
            phi,
            epsilon,
            weights,
            &step,
            &self.state.q,
        );
        let Some(s) = made else {
            return Innovation::unused(epsilon, self.guard.refused(Refusal::NotFinite));
        };
        let outcome = self.guard.grown::<I, _>(&step, outcome, &mut self.state);
        Innovation {
            epsilon,
            s,
            outcome,
        }
    }
}

fn factors(p: &DMatrix<f64>, n: usize) -> Result<Factors, Error> {
    for found in [p.nrows(), p.ncols()] {
        if found != n {
            return Err(Error::Size {
                what: "P(0)",
                found,
                expected: n,
            });
        }
    }
    let (mut u, mut d) = (p.as_slice().to_vec(), vec![0.0; n]);
    factor::factorise(&mut u, &mut d)?;
    let q = Vec::new();
    Ok(Factors { u, d, q })
}

impl<I: FactoredIntegrator> RecursiveEstimator for DynamicRls<I> {
    type Sample = DynamicSample;
    type Theta = DVector<f64>;
    type Covariance = DMatrix<f64>;
    type Error = Error;

    fn update(&mut self, sample: &DynamicSample, dt: f64) -> Innovation {
        let weights = self.weights;
        self.update_with(sample.phi.as_slice(), sample.y, dt, &weights)
    }

    fn theta(&self) -> &DVector<f64> {
        &self.theta
    }

    fn covariance(&self) -> DMatrix<f64> {
        let n = self.theta.len();
        DMatrix::from_fn(n, n, |i, j| {
            factor::entry(&self.state.u, &self.state.d, i, j)
        })
    }

    fn health(&self) -> Result<Health, Error> {
        self.guard.running()?;
        let mut m = self.covariance();
        let largest = factor::largest_eigenvalue(m.as_mut_slice(), self.theta.len());
        let smallest = self.state.d.iter().fold(f64::INFINITY, |a, &d| a.min(d));
        Ok(self.guard.health(largest, smallest, self.state.trace()))
    }
}
