//! Projection of the estimates onto rows or a box: hard bounds, where a penalty is soft.
//!
//! Model: the nearest estimate that obeys all rows, in the metric of what is known:
//! ```text
//! minimise (theta - theta^)' P^-1 (theta - theta^)   subject to  f_i' theta = chi_i  or  f_i' theta <= chi_i
//! ```
//! In this metric, and not by clamping the entries, the Lyapunov function cannot grow where the true parameters obey the rows;
//! and a parameter at its bound moves those that are correlated with it. `P` stays as it is.
//!
//! Assumption: some `theta` obeys all rows. Equations (Hildreth's method), over all rows until nothing moves:
//! ```text
//! d = max((f_i' theta - chi_i)/(f_i' P f_i), -lambda_i)     (without the second for equalities)
//! lambda_i += d,  theta -= P f_i d
//! ```
//! Convergence: linear, to the minimum; after one visit of a row where one row is violated, slow where rows are nearly
//! parallel: each is obeyed to 1e-13 of the size of its terms, or to 1e-8 after 10 000 sweeps. Cost per visit: `2 p^2`.
//!
//! Reference: C. Hildreth, *A quadratic programming procedure*, Naval Research Logistics Quarterly 4 (1957) 79-85.

use ct_rls::{ContinuousRls, RecursiveEstimator};
use nalgebra::SVector;

use crate::{Error, Relation, Row};

/// Sweeps over all rows at most. Nearly parallel rows need many; rows that contradict each other never settle.
const SWEEPS: u32 = 10_000;

/// A move is none within this share of the size of a row's terms: then the rows are settled.
const SETTLED: f64 = 1e-13;

/// A row is obeyed within this share of the size of its terms, where the sweeps end before everything is settled.
const OBEYED: f64 = 1e-8;

/// Moves the estimates to the nearest point that obeys all `rows`; weights play no part. Returns whether anything moved.
///
/// # Errors
/// [`Error::NoCommonPoint`] where the rows contradict each other; nothing is changed then.
pub fn project<const P: usize, const R: usize>(
    rls: &mut ContinuousRls<P>,
    rows: &[Row<P>; R],
) -> Result<bool, Error> {
    let statement = |i: usize| {
        let row = &rows[i];
        match row.relation() {
            Relation::AtLeast => (-row.f(), -row.chi(), false),
            relation => (*row.f(), row.chi(), relation == Relation::Equal),
        }
    };
    nearest(rls, &mut [0.0; R], statement)
}

/// Moves the estimates to the nearest point of the box `lower <= theta <= upper`, entry by entry; infinite bounds are none.
/// Returns whether anything moved.
///
/// # Errors
/// [`Error::Bounds`]; nothing is changed then.
pub fn project_box<const P: usize>(
    rls: &mut ContinuousRls<P>,
    lower: &SVector<f64, P>,
    upper: &SVector<f64, P>,
) -> Result<bool, Error> {
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
    let mut multipliers = [[0.0; P]; 2];
    nearest(rls, multipliers.as_flattened_mut(), statement)
}

/// Hildreth's method; `statement(i)` is `(f, chi, equality)` of `f' theta <= chi`.
fn nearest<const P: usize>(
    rls: &mut ContinuousRls<P>,
    multipliers: &mut [f64],
    statement: impl Fn(usize) -> (SVector<f64, P>, f64, bool),
) -> Result<bool, Error> {
    let mut theta = *rls.theta();
    let mut moved = false;
    let mut worst = (0, 0.0, 0.0);
    for _ in 0..SWEEPS {
        let mut settled = true;
        worst = (0, 0.0, 0.0);
        for (i, multiplier) in multipliers.iter_mut().enumerate() {
            let (f, chi, equality) = statement(i);
            if chi == f64::INFINITY {
                continue;
            }
            let excess = f.dot(&theta) - chi;
            let size = chi.abs()
                + f.iter()
                    .zip(&theta)
                    .map(|(f, x)| (f * x).abs())
                    .sum::<f64>();
            if excess.abs() <= SETTLED * size || (excess < 0.0 && !equality && *multiplier == 0.0) {
                continue;
            }
            let (k, s) = rls.factor().times(&f);
            if s == 0.0 {
                // 0 <= chi or 0 = chi, which nothing can change
                settled = false;
                worst = (i, excess, f64::INFINITY);
                continue;
            }
            let mut step = excess / s;
            if !equality {
                step = step.max(-*multiplier);
            }
            *multiplier += step;
            theta -= k * step;
            if (step * s).abs() > SETTLED * size {
                settled = false;
                moved = true;
                if excess.abs() > worst.2 * size {
                    worst = (i, excess, excess.abs() / size);
                }
            }
        }
        if settled {
            break;
        }
    }
    if worst.2 <= OBEYED {
        if moved {
            rls.set_theta(theta)?;
        }
        return Ok(moved);
    }
    Err(Error::NoCommonPoint {
        row: worst.0,
        violation: worst.1,
        sweeps: SWEEPS,
    })
}
