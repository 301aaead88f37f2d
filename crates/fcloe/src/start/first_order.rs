//! The paper's start for plants of first order: least squares and instruments with one state variable filter.
//!
//! Model: `y' = -1/tau y + K/tau u`, and so for the filtered signals (Baysse, Carrillo, Habbadi, (21) to (23)):
//! ```text
//! Y_f = theta' phi_f,   theta = [1/tau, K/tau],   phi_f = [-y_f, u_f],   Y_f = p y_f = lambda (y - y_f)
//! ```
//! Sampled, `Y_f` has to be what the filter's own rule says of the slope: `lambda (y - y_f)` is right for Euler's rule;
//! for the exact filter of a held signal the factor is `(1 - e^{-lambda Ts})/Ts`. With `lambda` there instead, tau comes
//! out too small by `(1 - e^{-lambda Ts})/(lambda Ts)`, without any noise: 93 for 110 at `lambda Ts = 0.36`.
//!
//! Bias: least squares is biased by noise, in the loop and without; the standard instruments only by noise that
//! is fed back in the loop, as they are simulated from the measured u. [`super::instruments`] simulates them from r.

use serde::{Deserialize, Serialize};

use super::signals::solve;
use crate::controller::positive;
use crate::{Error, LoopRecord, PlantModel};

/// Discretisation of `lambda/(p + lambda)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Discretisation {
    /// `x_f+ = x_f + Ts lambda (x - x_f)`, `Y_f = lambda (y - y_f)`. Stable for `lambda Ts < 2`.
    Euler,
    /// Exact for held signals, `Y_f = (1 - e^{-lambda Ts})/Ts (y - y_f)`.
    ZeroOrderHold,
    /// Exact for held signals, but `Y_f = lambda (y - y_f)` as printed: inconsistent, for reproduction of results.
    ZeroOrderHoldAsPrinted,
}

impl Discretisation {
    /// `(share of x - x_f that x_f moves in a step, factor of y - y_f in Y_f)`.
    fn factors(self, lambda: f64, step: f64) -> (f64, f64) {
        let exact = -(-lambda * step).exp_m1();
        match self {
            Self::Euler => (lambda * step, lambda),
            Self::ZeroOrderHold => (exact, exact / step),
            Self::ZeroOrderHoldAsPrinted => (exact, lambda),
        }
    }
}

/// Form of the equation for the instruments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// `[sum phi^ phi']^-1 sum phi^ Y`.
    Standard,
    /// `[sum phi^ phi^']^-1 sum phi^ Y`, (26) as printed: biased even in open loop, for reproduction of results.
    AsPrinted,
}

/// Least squares, (24). lambda in \[1/time\]; needs u in the record.
///
/// # Errors
/// [`Error::RegressionWithoutInput`], [`Error::Setting`], [`Error::NotDetermined`], those of [`LoopRecord::validate`] and
/// [`PlantModel::new`].
pub fn least_squares(
    record: &LoopRecord,
    lambda: f64,
    discretisation: Discretisation,
) -> Result<PlantModel, Error> {
    let filtered = Filtered::new(record, lambda, discretisation)?;
    plant(&filtered.phi, &filtered.phi, &filtered.target)
}

/// Instruments, (25) and (26): y^ is that of a model, from least squares, driven by the measured u, by Euler's rule.
///
/// # Errors
/// As [`least_squares`]; [`Error::Length`] for a model that is not of first order with `m = 0`.
pub fn instruments(
    record: &LoopRecord,
    lambda: f64,
    discretisation: Discretisation,
    model: &PlantModel,
    form: Form,
) -> Result<PlantModel, Error> {
    let &[tau, gain] = model.theta() else {
        return Err(Error::Length {
            what: "a model of first order",
            expected: 2,
            found: model.theta().len(),
        });
    };
    let filtered = Filtered::new(record, lambda, discretisation)?;
    let (share, _) = discretisation.factors(lambda, record.step);
    let level = record.operating_point().u;
    let (mut y, mut y_f) = (0.0, 0.0);
    let u = record.u.iter().flatten().map(|u| u - level);
    let simulated = u.zip(&filtered.phi).map(|(u, phi)| {
        let row = [-y_f, phi[1]];
        y_f += share * (y - y_f);
        y += record.step / tau * (gain * u - y);
        row
    });
    let simulated: Vec<[f64; 2]> = simulated.collect();
    match form {
        Form::Standard => plant(&simulated, &filtered.phi, &filtered.target),
        Form::AsPrinted => plant(&simulated, &simulated, &filtered.target),
    }
}

/// phi_f and Y_f at all samples.
struct Filtered {
    phi: Vec<[f64; 2]>,
    target: Vec<f64>,
}

impl Filtered {
    fn new(record: &LoopRecord, lambda: f64, rule: Discretisation) -> Result<Self, Error> {
        record.validate()?;
        positive("the filter's bandwidth lambda", lambda)?;
        let u = super::signals::input(record)?;
        let (share, factor) = rule.factors(lambda, record.step);
        let point = record.operating_point();
        let (mut u_f, mut y_f) = (0.0, 0.0);
        let (mut phi, mut target) = (Vec::new(), Vec::new());
        for (u, y) in u.iter().zip(record.y_on_lines().iter()) {
            let y = y - point.y;
            phi.push([-y_f, u_f]);
            target.push(factor * (y - y_f));
            u_f += share * (u - point.u - u_f);
            y_f += share * (y - y_f);
        }
        Ok(Self { phi, target })
    }
}

fn plant(z: &[[f64; 2]], phi: &[[f64; 2]], target: &[f64]) -> Result<PlantModel, Error> {
    let rows = z.iter().zip(phi).zip(target);
    let theta = solve(2, rows.map(|((z, phi), y)| (&z[..], &phi[..], *y)))?;
    PlantModel::first_order(theta[1] / theta[0], 1.0 / theta[0])
}
