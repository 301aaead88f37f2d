//! The recursive estimator: Gauss-Newton along the record, for a loop or for open loop.
//!
//! Model: `A y = B u` in a loop with a known R/S, driven by r; theta may drift. The loop of the model is simulated in
//! parallel from r alone, so noise that is fed back causes no bias.
//!
//! Equations: `theta' = P sigma eps`, `P' = eta P - P sigma sigma' P` with `sigma = S/P_f phi^` (Baysse, Carrillo,
//! Habbadi, (12), (13); the recursion itself is cited there, not printed), sampled with sigma held, relative to a
//! scale, `s = scale sigma`, `F = Ts P` over the scales:
//! ```text
//! g = F s/(l + s'F s),   F+ = (F - g s'F)/l,   theta+ = theta + scale g eps,   l = 1 - (1 - e^{-eta dt}) e^{-t/T_f}
//! ```
//! with eps the output error before the step. F is kept as factors by `ct-rls`, its exact step with
//! `c = gamma = eta_k/(1 - l)`, `eta_k = -ln(l)/dt`, which is this step.
//!
//! What holds it back: F's trace stays at or below that of its start, so it cannot wind up; a step changes no parameter
//! by more than the step limit; a step is halved until `P^(p - rate)` is Hurwitz, with rate 1 % of the start's slowest
//! decay, and all parameters are in their range, and refused where 20 halvings do not do.
//!
//! Convergence: with a fixed filter where condition (14) holds, see [`Condition`](crate::Condition), for r that excites
//! and independent noise; with an adaptive filter from nearly every start that was tried.
//!
//! Cost per update: `1.5 p^2` products for F, and the series of [`model`]; no allocation, unless stability is so close
//! that integers decide it.

mod health;
mod model;
mod settings;
mod step;

use ct_lti::Polynomial;
use ct_rls::{DynamicRls, Guards, Health, Innovation, Outcome, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector};

pub use health::LoopHealth;
pub use settings::{Filter, RecursiveSettings};

use crate::{ClosedLoop, Controller, Error, Orders, PlantModel};
use model::MovingLoop;

/// Number of halvings of a step before it is rejected.
const HALVINGS: usize = 20;

/// Least decay rate of the model's loop, relative to the slowest one at the start.
const DECAY: f64 = 0.01;

/// A parameter smaller than this share of its scale may change by the step limit times this share.
const SMALL: f64 = 0.1;

/// Range of a scale for which P, in the parameters' units, does not overflow.
const SCALES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// One sample of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSample {
    /// Reference from this sample to the next, unit of y; in open loop the input.
    pub drive: f64,
    /// Output at this sample.
    pub y: f64,
}

/// Recursive closed-loop output error.
#[derive(Debug, Clone)]
pub struct RecursiveFcloe {
    orders: Orders,
    controller: Controller,
    settings: RecursiveSettings,
    scale: Vec<f64>,
    theta: Vec<f64>,
    rls: DynamicRls,
    model: MovingLoop,
    /// The loop has to decay faster \[1/time\].
    rate: f64,
    time: f64,
    last_drive: f64,
    /// Variance of the output error, and the sum of weights it is based on.
    variance: (f64, f64),
    shortened: u64,
    refused: u64,
    limited: u64,
    /// s, the parameters tried, their deltas, P^.
    s: Vec<f64>,
    tried: Vec<f64>,
    delta: Vec<f64>,
    step: Vec<f64>,
    p: Vec<f64>,
}

impl RecursiveFcloe {
    /// From a start whose loop is stable, at rest; the scales are the start's parameters, so none of them may be 0, see
    /// [`RecursiveFcloe::with_scale`].
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::ZeroStart`], [`Error::UnstableLoop`], [`Error::Lti`], [`Error::Rls`].
    pub fn new(
        start: &PlantModel,
        controller: &Controller,
        settings: RecursiveSettings,
    ) -> Result<Self, Error> {
        let scale: Vec<f64> = start.theta().to_vec();
        Self::with_scale(start, &scale, controller, settings)
    }

    /// The same with a size for each parameter, 1e-100 to 1e100, by which it is scaled; its sign does not matter.
    ///
    /// # Errors
    /// As [`RecursiveFcloe::new`]; [`Error::Length`].
    pub fn with_scale(
        start: &PlantModel,
        scale: &[f64],
        controller: &Controller,
        settings: RecursiveSettings,
    ) -> Result<Self, Error> {
        settings.check()?;
        let (theta, orders) = (start.theta(), start.orders());
        let n = theta.len();
        if scale.len() != n {
            return Err(Error::Length {
                what: "the scale",
                expected: n,
                found: scale.len(),
            });
        }
        if let Some(index) = scale.iter().position(|s| *s == 0.0 || !s.is_finite()) {
            return Err(Error::ZeroStart { index });
        }
        if let Some(&value) = scale.iter().find(|s| !SCALES.contains(&s.abs())) {
            return Err(Error::Setting {
                what: "the scale of a parameter",
                value,
                range: "1e-100 to 1e100 in size; choose other units",
            });
        }
        let closed = ClosedLoop::new(start, controller)?;
        closed.require_stable()?;
        let slowest = closed.characteristic().roots()?;
        let rate = DECAY * slowest.last().map_or(0.0, |z| z.re.abs());
        let scale: Vec<f64> = scale.iter().map(|s| s.abs()).collect();
        let delta: Vec<f64> = theta.iter().zip(&scale).map(|(t, s)| t / s).collect();
        let f0 = DMatrix::identity(n, n) * settings.gain;
        let rls = DynamicRls::new(
            DVector::from_vec(delta.clone()),
            &f0,
            Weights::least_squares(0.0)?,
        )?;
        let rls = rls.with_guards(Guards {
            // The trace as ct-rls sums it may round the other way.
            trace_limit: settings.gain * n as f64 * (1.0 + 1e-12),
            silent_below: 0.0,
        })?;
        let mut model = MovingLoop::new(orders, controller);
        model.set(theta, true);
        let p = closed.characteristic().coefficients().to_vec();
        Ok(Self {
            orders,
            controller: controller.clone(),
            settings,
            theta: theta.to_vec(),
            rls,
            model,
            rate,
            time: 0.0,
            last_drive: 0.0,
            variance: (0.0, 0.0),
            shortened: 0,
            refused: 0,
            limited: 0,
            s: vec![0.0; n],
            tried: vec![0.0; n],
            step: vec![0.0; n],
            delta,
            p,
            scale,
        })
    }

    /// n and m.
    pub fn orders(&self) -> Orders {
        self.orders
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The plant as estimated.
    ///
    /// # Errors
    /// None in practice: the estimates are checked at each step.
    pub fn plant(&self) -> Result<PlantModel, Error> {
        PlantModel::from_theta(self.orders, &self.theta)
    }

    /// P^ in the filter of the sensitivities.
    ///
    /// # Errors
    /// None in practice, as above.
    pub fn filter_polynomial(&self) -> Result<Polynomial, Error> {
        Ok(Polynomial::new(self.model.filter())?)
    }

    /// Root mean square of the output error over the memory, unit of y; 0 before the first sample.
    pub fn residual_rms(&self) -> f64 {
        let (sum, weight) = self.variance;
        if weight > 0.0 {
            (sum / weight).sqrt()
        } else {
            0.0
        }
    }

    /// Resets F and the forgetting to their start values: for use after a step change of the parameters.
    ///
    /// # Errors
    /// [`Error::Rls`].
    pub fn restart(&mut self) -> Result<(), Error> {
        let n = self.theta.len();
        self.rls
            .reset_covariance(&(DMatrix::identity(n, n) * self.settings.gain))?;
        self.time = 0.0;
        Ok(())
    }

    pub(crate) fn least_squares(&self) -> &DynamicRls {
        &self.rls
    }

    pub(crate) fn scale(&self) -> &[f64] {
        &self.scale
    }

    pub(crate) fn counts(&self) -> [u64; 3] {
        [self.shortened, self.refused, self.limited]
    }

    /// The forgetting factor of this step.
    fn forgetting_factor(&self, dt: f64) -> f64 {
        let at_once = -(-self.settings.forgetting * dt).exp_m1();
        1.0 - at_once * (-self.time / self.settings.fading).exp()
    }
}

impl RecursiveEstimator for RecursiveFcloe {
    type Sample = LoopSample;
    type Theta = [f64];
    type Covariance = DMatrix<f64>;
    type Error = Error;

    /// Updates the estimates with y at this sample, then simulates the model over dt with the drive held. If y is missing (NaN) or
    /// implausible, the model is simulated without an update; if the drive is not finite, the last value is held. If the model's states
    /// overflow, the model restarts from rest; the outcome shows how the sample was used. Steps are 1e-40 to 1e30 of the time's unit, and
    /// no longer than 10 000 time constants of the fastest root.
    fn update(&mut self, sample: &LoopSample, dt: f64) -> Innovation {
        let point = self.settings.operating_point;
        let level = if self.controller.is_open_loop() {
            point.u
        } else {
            point.r
        };
        let drive = sample.drive - level;
        let known = drive.is_finite() && drive.abs() <= 1e100;
        if known {
            self.last_drive = drive;
        }
        let (y, _) = self.model.signals(self.last_drive);
        let epsilon = sample.y - point.y - y;
        let steppable = dt > 0.0 && dt.is_finite() && self.model.substeps(dt).is_some();
        if !steppable {
            return Innovation {
                epsilon,
                s: f64::NAN,
                outcome: Outcome::BadStep,
            };
        }
        let innovation = if known {
            self.learn(self.last_drive, epsilon, dt)
        } else {
            Innovation {
                epsilon,
                s: f64::NAN,
                outcome: Outcome::NotFinite,
            }
        };
        // the update is kept even if the model's states overflow and the model restarts from rest
        self.model.advance(self.last_drive, dt);
        self.time += dt;
        innovation
    }

    /// `[a1, .., an, b0, .., bm]`.
    fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// P in theta: times the noise's variance, it is the covariance of the estimates, if forgetting is slow.
    fn covariance(&self) -> DMatrix<f64> {
        let f = self.rls.covariance();
        DMatrix::from_fn(f.nrows(), f.ncols(), |i, j| {
            f[(i, j)] * self.scale[i] * self.scale[j]
        })
    }

    /// State of the least squares inside, in the relative parameters; [`RecursiveFcloe::loop_health`] has more information.
    fn health(&self) -> Result<Health, Error> {
        Ok(self.rls.health()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factored form agrees with the equations for F in the module's head, step by step.
    #[test]
    fn the_textbook_recursion() {
        let plant = PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap();
        let controller = Controller::pi(0.3, 0.004).unwrap();
        let (f0, eta, fading, dt) = (0.3, 0.01, 200.0, 2.0);
        let mut settings = RecursiveSettings::new(f0, eta, fading, 1e9);
        // The start is so near that neither the step limit nor the stability bound is active.
        settings.range = 1e6;
        let mut estimator = RecursiveFcloe::new(&plant, &controller, settings).unwrap();
        let mut f = DMatrix::identity(4, 4) * f0;
        for k in 0..600 {
            let drive = if (k / 20 + k / 70) % 2 == 0 {
                1.0
            } else {
                -1.0
            };
            let before = estimator.theta.clone();
            let y = estimator.model.signals(drive).0 + 1e-4 * f64::from(k % 7);
            let innovation = estimator.update(&LoopSample { drive, y }, dt);
            let s = DVector::from_column_slice(&estimator.s);
            let l = 1.0 - (1.0 - (-eta * dt).exp()) * (-f64::from(k) * dt / fading).exp();
            let g = &f * &s / (l + (s.transpose() * &f * &s)[0]);
            f = (&f - &g * (s.transpose() * &f)) / l;
            f = (&f + f.transpose()) * 0.5;
            if f.trace() > 4.0 * f0 {
                f *= 4.0 * f0 / f.trace();
            }
            for i in 0..4 {
                let step = plant.theta()[i] * g[i] * innovation.epsilon;
                let expected = before[i] + step;
                assert!((estimator.theta[i] - expected).abs() < 1e-9 * plant.theta()[i]);
            }
            let covariance = estimator.rls.covariance();
            assert!((&covariance - &f).norm() < 1e-8 * f.norm(), "{k}");
        }
        assert_eq!(estimator.counts(), [0, 0, 0]);
        assert!(f.trace() < 3.8 * f0, "nothing was learnt: {}", f.trace());
    }
}
