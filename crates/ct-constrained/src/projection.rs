//! Projection of the estimates onto rows or a box: hard bounds, where a penalty is soft.
//!
//! Model: the nearest estimate that obeys all rows, in the metric of what is known:
//! ```text
//! minimise (theta - theta^)' P^-1 (theta - theta^)   subject to  f_i' theta = chi_i  or  f_i' theta <= chi_i
//! ```
//! In this metric, and not by clamping the entries, the Lyapunov function cannot grow where the true parameters obey the rows;
//! and a parameter at its bound moves those that are correlated with it. `P` stays as it is.
//!
//! Assumption: some `theta` obeys all rows. Equations (the dual method of Goldfarb and Idnani), from `theta = theta^` and no active
//! rows, with `N` the active rows and `n` the row that is violated most:
//! ```text
//! r = (N' P N)^-1 N' P n,   z = P (n - N r)
//! theta -= t z,  lambda -= t r,  lambda_n += t,   t = min((n' theta - chi)/(n' z), min lambda_j/r_j over r_j > 0)
//! ```
//! The first limit makes `n` active, the second lets row `j` go (never an equality). Convergence: in finitely many steps, one
//! where one row is violated. Cost per step: `2 p^2` for `n` and `q^3/6 + q p` for `q` active rows, at most `p`.
//!
//! Reference: D. Goldfarb, A. Idnani, *A numerically stable dual method for solving strictly convex quadratic programs*,
//! Mathematical Programming 27 (1983) 1-33.

use ct_rls::{ContinuousRls, Integrator, RecursiveEstimator};
use nalgebra::SVector;

use crate::{Error, Relation, Row};

/// A row is obeyed within this share of the size of its terms.
const OBEYED: f64 = 1e-12;

/// A row whose part outside the active ones is below this share (squared) says nothing new.
const DEPENDENT: f64 = 1e-13;

/// Steps for each row and parameter before it is said that there is no end; a few in all are usual.
const STEPS: usize = 20;

/// Moves the estimates to the nearest point that obeys all `rows`; weights play no part. Returns whether anything moved.
///
/// # Errors
/// [`Error::NoCommonPoint`] where the rows contradict each other; nothing is changed then.
pub fn project<const P: usize, const R: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    rows: &[Row<P>; R],
) -> Result<bool, Error> {
    let statement = |i: usize| {
        let row = &rows[i];
        match row.relation() {
            Relation::AtLeast => (-row.f(), -row.chi(), false),
            relation => (*row.f(), row.chi(), relation == Relation::Equal),
        }
    };
    nearest(rls, R, statement)
}

/// Moves the estimates to the nearest point of the box `lower <= theta <= upper`, entry by entry; infinite bounds are none.
/// Returns whether anything moved.
///
/// # Errors
/// [`Error::Bounds`]; nothing is changed then.
pub fn project_box<const P: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    lower: &SVector<f64, P>,
    upper: &SVector<f64, P>,
) -> Result<bool, Error> {
    check_box(lower, upper)?;
    let statement = |i: usize| {
        let mut f = SVector::zeros();
        let (entry, sign, bound) = if i < P {
            (i, -1.0, -lower[i])
        } else {
            (i - P, 1.0, upper[i - P])
        };
        f[entry] = sign;
        (f, bound, false)
    };
    let moved = nearest(rls, 2 * P, statement)?;
    // rounding may have left an entry a little outside
    let inside = rls
        .theta()
        .zip_map(lower, f64::max)
        .zip_map(upper, f64::min);
    if inside != *rls.theta() {
        rls.set_theta(inside)?;
    }
    Ok(moved)
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

/// An active row.
#[derive(Clone, Copy)]
struct Active<const P: usize> {
    /// Which row.
    row: usize,
    f: SVector<f64, P>,
    /// `P f`
    k: SVector<f64, P>,
    lambda: f64,
    equality: bool,
}

/// The row that is violated most, for its size: its place, `f` with the sign that makes the violation positive, the violation,
/// and whether it is an equality.
type Violated<const P: usize> = (usize, SVector<f64, P>, f64, bool);

fn most_violated<const P: usize>(
    theta: &SVector<f64, P>,
    start: &SVector<f64, P>,
    rows: usize,
    statement: impl Fn(usize) -> (SVector<f64, P>, f64, bool),
) -> Option<Violated<P>> {
    let mut most = OBEYED;
    let mut found = None;
    for row in 0..rows {
        let (f, chi, equality) = statement(row);
        let excess = f.dot(theta) - chi;
        // with a bound of 0 the estimate itself is no measure of its rounding; what it was made from is
        let size = chi.abs() + f.abs().dot(&theta.abs().sup(&start.abs()));
        let violation = if equality { excess.abs() } else { excess };
        if violation > most * size {
            most = violation / size;
            let sign = if excess < 0.0 { -1.0 } else { 1.0 };
            found = Some((row, f * sign, violation, equality));
        }
    }
    found
}

/// `r = (N' P N)^-1 N' P n` by Cholesky's factorisation; entries beyond the active rows are 0.
fn multiplier_rates<const P: usize>(active: &[Active<P>], n: &SVector<f64, P>) -> [f64; P] {
    let mut l = [[0.0; P]; P];
    let mut r = [0.0; P];
    for i in 0..active.len() {
        for j in 0..=i {
            let known: f64 = (0..j).map(|m| l[i][m] * l[j][m]).sum();
            let rest = active[i].k.dot(&active[j].f) - known;
            l[i][j] = if i == j {
                libm::sqrt(rest.max(f64::MIN_POSITIVE))
            } else {
                rest / l[j][j]
            };
        }
        let known: f64 = (0..i).map(|m| l[i][m] * r[m]).sum();
        r[i] = (active[i].k.dot(n) - known) / l[i][i];
    }
    for i in (0..active.len()).rev() {
        let known: f64 = (i + 1..active.len()).map(|m| l[m][i] * r[m]).sum();
        r[i] = (r[i] - known) / l[i][i];
    }
    r
}

/// The dual method; `statement(i)` is `(f, chi, equality)` of `f' theta <= chi`.
fn nearest<const P: usize, I: Integrator>(
    rls: &mut ContinuousRls<P, I>,
    rows: usize,
    statement: impl Fn(usize) -> (SVector<f64, P>, f64, bool),
) -> Result<bool, Error> {
    let start = *rls.theta();
    let mut theta = start;
    let none = Active {
        row: 0,
        f: SVector::zeros(),
        k: SVector::zeros(),
        lambda: 0.0,
        equality: false,
    };
    let (mut active, mut q) = ([none; P], 0);
    let mut last = (0, 0.0);
    for _ in 0..STEPS * (rows + P) {
        let Some((row, f, mut excess, equality)) = most_violated(&theta, &start, rows, &statement)
        else {
            let moved = theta != start;
            if moved {
                rls.set_theta(theta)?;
            }
            return Ok(moved);
        };
        last = (row, excess);
        let (k, s) = rls.times(&f);
        let mut lambda = 0.0;
        loop {
            let r = multiplier_rates(&active[..q], &f);
            let z = (0..q).fold(k, |z, j| z - active[j].k * r[j]);
            let slope = f.dot(&z);
            let full = if slope > DEPENDENT * s {
                excess / slope
            } else {
                f64::INFINITY
            };
            let leaving = (0..q)
                .filter(|&j| !active[j].equality && r[j] > 0.0)
                .map(|j| (active[j].lambda / r[j], j))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let (t, leaves) = match leaving {
                Some((t, j)) if t < full => (t, Some(j)),
                _ => (full, None),
            };
            if t == f64::INFINITY {
                return Err(contradiction(last));
            }
            for (active, r) in active[..q].iter_mut().zip(r) {
                active.lambda -= t * r;
            }
            lambda += t;
            if full < f64::INFINITY {
                theta -= z * t;
                excess -= slope * t;
            }
            let Some(j) = leaves else {
                if q == P {
                    return Err(contradiction(last));
                }
                // a row that is active already comes back where rounding has moved it a little
                match active[..q].iter_mut().find(|a| a.row == row) {
                    Some(again) => again.lambda += lambda,
                    None => {
                        active[q] = Active {
                            row,
                            f,
                            k,
                            lambda,
                            equality,
                        };
                        q += 1;
                    }
                }
                break;
            };
            q -= 1;
            active[j] = active[q];
        }
    }
    Err(contradiction(last))
}

fn contradiction((row, violation): (usize, f64)) -> Error {
    Error::NoCommonPoint { row, violation }
}
