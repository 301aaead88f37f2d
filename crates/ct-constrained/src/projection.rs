//! Projection of the estimates onto rows or a box: hard bounds, where a penalty is soft.
//!
//! Model: the nearest estimate that satisfies all rows, in the metric of the information matrix `P^-1`:
//! ```text
//! minimise (theta - theta^)' P^-1 (theta - theta^)   subject to  low_i <= f_i' theta <= high_i
//! ```
//! In this metric, unlike by clamping the entries, the Lyapunov function cannot grow if the true parameters satisfy the rows; and a
//! parameter at its bound changes those that are correlated with it. `P` does not change.
//!
//! Assumption: some `theta` satisfies all rows. Equations (the dual method of Goldfarb and Idnani) with `P = L L'`, so that
//! `theta = theta^ + L x` and the nearest point has the shortest `x`; `g_i = L' f_i/sum |f_ij| sqrt(P_jj)`, with the sign of the bound
//! that is violated. `G = Q R` are the active rows, `g` is the row that is violated most, `e` its violation in that unit:
//! ```text
//! r = R^-1 Q' g,   z = g - Q Q' g,   t = min(e/z'z, min lambda_j/r_j over r_j > 0)
//! lambda -= t r,   lambda_g += t,    e -= t z'z
//! ```
//! The first limit makes the row active, the second removes row `j` from the active set (never an equality). When a row has become
//! active, `x += Q y`, where `R' y` is the distance of the active rows from their bounds: rounding errors, except for the last one. Of the
//! other rows, the one that is violated most is the next.
//!
//! Rounding: a row is satisfied within 1e-12 of the size of its terms at the start and at the end, and 4e-15 of `|x|` in the unit above.
//! A row that is a combination of the active ones, `g = G r`, within 1e-13 of `1 + sum |r_j|`, and is violated by no more than that
//! of its and their terms, counts as satisfied.
//!
//! Convergence: in finitely many steps, one where one row is violated. Cost per step: `2 p^2` and `5 q p` for `q` active rows, at
//! most `p`.
//!
//! Reference: D. Goldfarb, A. Idnani, *A numerically stable dual method for solving strictly convex quadratic programs*,
//! Mathematical Programming 27 (1983) 1-33.

mod search;

use ct_rls::{ContinuousRls, Integrator, RecursiveEstimator};
use nalgebra::SVector;

use self::search::Search;
use crate::{Error, Relation, Row};

/// A row is satisfied within this share of the size of its terms.
const OBEYED: f64 = 1e-12;

/// A row is linearly dependent on the active rows if its part outside them is below this share.
const DEPENDENT: f64 = 1e-13;

/// Rounding error of a step, as a share of its length.
const WAY: f64 = 16.0 * f64::EPSILON;

/// Largest number of iterations of the active-set method, times the number of constraints and parameters; a few iterations in all are usual.
const STEPS: usize = 20;

/// Moves the estimates to the nearest point that satisfies all `rows`; weights have no influence. Returns whether the estimates changed.
///
/// # Errors
/// [`Error::NoCommonPoint`] where the rows contradict each other, [`Error::NotFinite`] where `f' theta` leaves the floating-point range,
/// and [`Error::Rls`] where `P` is not positive definite, which [`ExactHold`](ct_rls::ExactHold) excludes; nothing is changed then.
pub fn project<const P: usize, const R: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    rows: &[Row<P>; R],
) -> Result<bool, Error> {
    let intervals = rows.map(|row| {
        let (low, high) = match row.relation() {
            Relation::Equal => (row.chi(), row.chi()),
            Relation::AtMost => (f64::NEG_INFINITY, row.chi()),
            Relation::AtLeast => (row.chi(), f64::INFINITY),
        };
        Interval {
            f: *row.f(),
            low,
            high,
        }
    });
    nearest(rls, &intervals)
}

/// Moves the estimates to the nearest point of the box `lower <= theta <= upper`, entry by entry; an infinite bound means
/// no bound. Returns whether any entry changed.
///
/// Where `P` is so nearly singular that rounding hides which point is nearest, each entry goes to its nearer bound.
///
/// # Errors
/// [`Error::Bounds`], [`Error::NotFinite`] where a violation leaves the floating-point range, and [`Error::Rls`] where `P` is not positive
/// definite, which [`ExactHold`](ct_rls::ExactHold) excludes; nothing is changed then.
pub fn project_box<const P: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    lower: &SVector<f64, P>,
    upper: &SVector<f64, P>,
) -> Result<bool, Error> {
    check_box(lower, upper)?;
    let intervals: [Interval<P>; P] = core::array::from_fn(|i| {
        let mut f = SVector::zeros();
        f[i] = 1.0;
        Interval {
            f,
            low: lower[i],
            high: upper[i],
        }
    });
    let moved = match nearest(rls, &intervals) {
        // a box that is not empty has a point
        Err(Error::NoCommonPoint { .. }) => false,
        moved => moved?,
    };
    // rounding may have left an entry a little outside
    let inside = rls
        .theta()
        .zip_map(lower, f64::max)
        .zip_map(upper, f64::min);
    let outside = inside != *rls.theta();
    if outside {
        rls.set_theta(inside)?;
    }
    Ok(moved || outside)
}

pub(crate) fn check_box<const P: usize>(
    lower: &SVector<f64, P>,
    upper: &SVector<f64, P>,
) -> Result<(), Error> {
    for (index, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
        let possible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
        if !possible {
            return Err(Error::Bounds {
                index,
                lower,
                upper,
            });
        }
    }
    Ok(())
}

/// `low <= f' theta <= high`
struct Interval<const P: usize> {
    f: SVector<f64, P>,
    low: f64,
    high: f64,
}

impl<const P: usize> Interval<P> {
    fn equality(&self) -> bool {
        self.low == self.high
    }

    /// The bound that is violated, or nearest to be: 1 for the upper one and -1 for the lower one, and `f' theta` beyond it.
    fn excess(&self, theta: &SVector<f64, P>) -> (f64, f64) {
        let value = self.f.dot(theta);
        let (below, above) = (self.low - value, value - self.high);
        if below > above {
            (-1.0, below)
        } else {
            (1.0, above)
        }
    }

    fn bound(&self, sign: f64) -> f64 {
        if sign < 0.0 { self.low } else { self.high }
    }

    /// The size of the terms of `f' theta - bound`, by those of the entries of `theta`.
    fn size(&self, sign: f64, entries: &SVector<f64, P>) -> f64 {
        self.bound(sign).abs() + self.f.abs().dot(entries)
    }
}

/// A row that is active or becomes active, with the sign of its active bound.
#[derive(Clone, Copy)]
struct Active {
    row: usize,
    sign: f64,
    /// 1 over `sum |f_i| sqrt(P_ii)`: with this scaling no direction is longer than 1 in any units.
    unit: f64,
    lambda: f64,
}

/// The constraint with the largest violation relative to the size of its terms: its index, the sign of the violated bound, and the
/// violation, which is infinite if it overflows.
fn most_violated<const P: usize, const N: usize>(
    rows: &[Interval<P>; N],
    theta: &SVector<f64, P>,
    entries: &SVector<f64, P>,
    passed: impl Fn(usize) -> bool,
) -> Option<(usize, f64, f64)> {
    let mut most = OBEYED;
    let mut found = None;
    for (row, interval) in rows.iter().enumerate() {
        let (sign, excess) = interval.excess(theta);
        if excess <= 0.0 || passed(row) {
            continue;
        }
        let size = interval.size(sign, entries);
        if !(excess.is_finite() && size.is_finite()) {
            return Some((row, sign, f64::INFINITY));
        }
        let share = excess / size;
        if share > most {
            most = share;
            found = Some((row, sign, excess));
        }
    }
    found
}

/// The dual method.
fn nearest<const P: usize, const N: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    rows: &[Interval<P>; N],
) -> Result<bool, Error> {
    let start = *rls.theta();
    let Some(mut next) = most_violated(rows, &start, &start.abs(), |_| false) else {
        return Ok(false);
    };
    let mut search = Search::new(rows, start, rls.root()?);
    for _ in 0..STEPS * (N + P) {
        let (row, sign, excess) = next;
        let in_units = excess * search.unit(row);
        if !in_units.is_finite() {
            return Err(Error::NotFinite {
                what: "the violation",
                value: in_units,
            });
        }
        if !search.enter(row, sign, excess) {
            break;
        }
        let Some(violated) = search.next() else {
            // corrects the rounding error
            search.move_onto_active();
            rls.set_theta(search.theta)?;
            return Ok(search.theta != start);
        };
        next = violated;
    }
    let (row, _, violation) = next;
    Err(Error::NoCommonPoint { row, violation })
}
