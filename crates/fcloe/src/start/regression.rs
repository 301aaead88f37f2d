//! Regressions for plants of any order, in the monic form.
//!
//! Model: with `A` and `B` over `a_n`, and all signals through the same filter `E(0)/E(p)` of degree n,
//! ```text
//! p^n y_f = -sum_{i<n} alpha_i p^i y_f + sum_i beta_i p^i u_f
//! ```
//! whose terms a [`StateVariableFilter`](ct_lti::StateVariableFilter) gives without numerical differentiation. y is interpolated
//! linearly between samples, u according to its hold. A held u that is interpolated linearly, or a y that is held, is shifted by half a
//! step, and tau is biased by 15 %.
//!
//! Instruments: `[sum z phi']^-1 sum z p^n y_f`, with z the regressor of a model of the loop, driven by r, so that it
//! is independent of the noise, also of noise that is fed back. In open loop it is driven by u.
//!
//! SRIVC, in a loop CLSRIVC: the filter `E = A^` and the instruments are updated until the estimates converge. For white noise on the
//! record this has the least possible variance (P. C. Young, A. Jakeman, International Journal of Control 31 (1980) 741-764, for open loop;
//! M. Gilson, H. Garnier, P. C. Young, P. Van den Hof, in Identification of Continuous-time Models from Sampled Data, Springer 2008, ch. 5,
//! for the loop). With a continuous-time controller, an error remains because u changes between samples.
//!
//! Readings of y may be missing; their rows are not used. In least squares y is interpolated linearly between its readings, and rows after
//! long gaps are left out ([`ct_lti::ReadingFilter`]). With instruments a missing reading is replaced in the filters of y by the simulated
//! output of the loop. The instruments are independent of the error of this replacement, so the estimates are consistent, and for the
//! filter `E = A^` the residual of a row does not depend on the replacements in other rows.
//!
//! Several records are taken together.

use ct_lti::Polynomial;

use super::signals::{Signals, Sums};
use crate::{ClosedLoop, Controller, Error, LoopRecord, Orders, PlantModel};

/// The share of the readings that must be usable for least squares with missing readings.
const LEAST_LEFT: f64 = 0.3;

/// A refinement ends if every parameter changes by at most this share of its value.
const RESTS: f64 = 1e-4;

/// Least squares. `filter` is E, Hurwitz, of degree n, its scale being of no importance: `(p + lambda)^n`, say, lambda 2
/// to 10 times the loop's poles. Noise biases it, the more the higher lambda; start [`instruments`] from it.
///
/// The controller says whether a sensor's filter is in the loop, through which u is passed then.
///
/// # Errors
/// [`Error::NoRecord`], [`Error::RegressionWithoutInput`], [`Error::Length`] for a filter of another degree,
/// [`Error::NotDetermined`], [`Error::Lti`], [`Error::Gaps`]; those of [`LoopRecord::validate`] and [`PlantModel::new`].
pub fn least_squares(
    records: &[LoopRecord],
    controller: &Controller,
    orders: Orders,
    filter: &Polynomial,
) -> Result<PlantModel, Error> {
    check(records, orders, filter)?;
    let mut sums = Sums::new(orders.parameters());
    let mut phi = vec![0.0; orders.parameters()];
    for record in records {
        let signals = Signals::measured(record, controller)?;
        let mut left = 0;
        signals.filtered(filter, |_, y, u| {
            left += 1;
            regressor(&mut phi, orders, y, u);
            sums.add(&phi, &phi, y[orders.n]);
        })?;
        let readings = record.readings();
        if (left as f64) < LEAST_LEFT * readings as f64 {
            return Err(Error::Gaps {
                record: record.name.clone(),
                missing: 1.0 - readings as f64 / record.len() as f64,
                left,
                rows: record.len(),
            });
        }
    }
    plant(&sums.solve()?, orders)
}

/// Instruments simulated in the loop from r, with `model` for the plant: its loop has to be stable.
///
/// # Errors
/// As [`least_squares`]; [`Error::UnstableLoop`].
pub fn instruments(
    records: &[LoopRecord],
    controller: &Controller,
    filter: &Polynomial,
    model: &PlantModel,
) -> Result<PlantModel, Error> {
    let orders = model.orders();
    check(records, orders, filter)?;
    ClosedLoop::new(model, controller)?.require_stable()?;
    let mut sums = Sums::new(orders.parameters());
    for record in records {
        rows(record, controller, filter, model, |_, z, phi, y| {
            sums.add(z, phi, y);
        })?;
    }
    plant(&sums.solve()?, orders)
}

/// Shows the number of the sample, instruments, regressor and `p^n y_f` at each sample of a record whose reading is there.
pub(super) fn rows(
    record: &LoopRecord,
    controller: &Controller,
    filter: &Polynomial,
    model: &PlantModel,
    mut see: impl FnMut(usize, &[f64], &[f64], f64),
) -> Result<(), Error> {
    let orders = model.orders();
    let measured = Signals::measured(record, controller)?;
    let simulated = Signals::simulated(model, record, controller)?;
    let mut z = Vec::with_capacity(record.len() * orders.parameters());
    let mut row = vec![0.0; orders.parameters()];
    simulated.filtered(filter, |_, y, u| {
        regressor(&mut row, orders, y, u);
        z.extend_from_slice(&row);
    })?;
    let mut z = z.chunks_exact(orders.parameters());
    measured
        .clone()
        .filled(&simulated)
        .filtered(filter, |k, y, u| {
            regressor(&mut row, orders, y, u);
            if let Some(z) = z.next()
                && !measured.is_missing(k)
            {
                see(k, z, &row, y[orders.n]);
            }
        })
}

/// Result of a refinement.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Refinement {
    /// The last plant with a stable loop.
    pub plant: PlantModel,
    /// Regressions that gave such a plant.
    pub iterations: usize,
    /// Whether the estimates have converged.
    pub rests: bool,
}

/// SRIVC, in a loop CLSRIVC: instruments and filter updated with the estimates, at most `most` times. It ends early, with the last plant
/// that has a stable loop, if the next loop is unstable, or if A^ is not Hurwitz and cannot be a filter.
///
/// # Errors
/// [`Error::UnstableLoop`] for the start; those of [`LoopRecord::validate`], [`Error::RegressionWithoutInput`],
/// [`Error::NoRecord`].
pub fn srivc(
    records: &[LoopRecord],
    controller: &Controller,
    start: &PlantModel,
    most: usize,
) -> Result<Refinement, Error> {
    ClosedLoop::new(start, controller)?.require_stable()?;
    check(records, start.orders(), &start.a_polynomial())?;
    for record in records {
        Signals::measured(record, controller)?;
    }
    let mut last = Refinement {
        plant: start.clone(),
        iterations: 0,
        rests: false,
    };
    for _ in 0..most {
        let filter = last.plant.a_polynomial();
        if !filter.is_hurwitz() {
            break;
        }
        let Ok(next) = instruments(records, controller, &filter, &last.plant) else {
            break;
        };
        if !ClosedLoop::new(&next, controller).is_ok_and(|closed| closed.is_stable()) {
            break;
        }
        let pairs = next.theta().iter().zip(last.plant.theta());
        last.rests = pairs
            .clone()
            .all(|(new, old)| (new - old).abs() <= RESTS * old.abs());
        last.plant = next;
        last.iterations += 1;
        if last.rests {
            break;
        }
    }
    Ok(last)
}

pub(super) fn check(
    records: &[LoopRecord],
    orders: Orders,
    filter: &Polynomial,
) -> Result<(), Error> {
    orders.check()?;
    if records.is_empty() {
        return Err(Error::NoRecord);
    }
    let found = filter.coefficients().len();
    if found != orders.n + 1 {
        return Err(Error::Length {
            what: "the filter's polynomial",
            expected: orders.n + 1,
            found,
        });
    }
    Ok(())
}

/// `[-p^0 y_f .. -p^(n-1) y_f, p^0 u_f .. p^m u_f]`.
fn regressor(phi: &mut [f64], orders: Orders, y: &[f64], u: &[f64]) {
    let (of_y, of_u) = phi.split_at_mut(orders.n);
    for (phi, y) in of_y.iter_mut().zip(y) {
        *phi = -y;
    }
    of_u.copy_from_slice(&u[..=orders.m]);
}

/// From `[alpha_0 .., beta_0 ..]` to `A = 1 + ..`.
fn plant(monic: &[f64], orders: Orders) -> Result<PlantModel, Error> {
    let (alpha, beta) = monic.split_at(orders.n);
    let a: Vec<f64> = alpha[1..]
        .iter()
        .chain([&1.0])
        .map(|c| c / alpha[0])
        .collect();
    let b: Vec<f64> = beta.iter().map(|c| c / alpha[0]).collect();
    PlantModel::new(&a, &b)
}
