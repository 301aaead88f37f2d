//! Projection of the estimates onto rows or a box: hard bounds, where a penalty is soft.
//!
//! Model: the nearest estimate that obeys all rows, in the metric of what is known:
//! ```text
//! minimise (theta - theta^)' P^-1 (theta - theta^)   subject to  low_i <= f_i' theta <= high_i
//! ```
//! In this metric, and not by clamping the entries, the Lyapunov function cannot grow where the true parameters obey the rows;
//! and a parameter at its bound moves those that are correlated with it. `P` stays as it is.
//!
//! Assumption: some `theta` obeys all rows. Equations (the dual method of Goldfarb and Idnani) with `P = L L'`, so that
//! `theta = theta^ + L x` and the nearest point has the shortest `x`; `g_i = L' f_i/sum |f_ij| sqrt(P_jj)`, with the sign of the bound
//! that is violated. `G = Q R` are the active rows, `g` is the row that is violated most, `e` its violation in that unit:
//! ```text
//! r = R^-1 Q' g,   z = g - Q Q' g,   t = min(e/z'z, min lambda_j/r_j over r_j > 0)
//! lambda -= t r,   lambda_g += t,    e -= t z'z
//! ```
//! The first limit makes the row active, the second lets row `j` go (never an equality). With a row that has become active,
//! `x += Q y`, and `R' y` is what the active rows are off their bounds by: rounding, but for the last one. Of the other rows the one
//! that is violated most comes next.
//!
//! Rounding: a row is obeyed within 1e-12 of the size of its terms at the start and at the end, and 4e-15 of `|x|` in the unit above.
//! A row that is a combination of the active ones, `g = G r`, within 1e-13 of `1 + sum |r_j|`, and is violated by no more than that
//! of its and their terms, is obeyed.
//!
//! Convergence: in finitely many steps, one where one row is violated. Cost per step: `2 p^2` and `5 q p` for `q` active rows, at
//! most `p`.
//!
//! Reference: D. Goldfarb, A. Idnani, *A numerically stable dual method for solving strictly convex quadratic programs*,
//! Mathematical Programming 27 (1983) 1-33.

use ct_rls::{ContinuousRls, Integrator, RecursiveEstimator};
use nalgebra::{SMatrix, SVector};

use crate::{Error, Relation, Row};

/// A row is obeyed within this share of the size of its terms.
const OBEYED: f64 = 1e-12;

/// A row whose part outside the active ones is below this share says nothing new.
const DEPENDENT: f64 = 1e-13;

/// Rounding of a way, as a share of its length.
const WAY: f64 = 16.0 * f64::EPSILON;

/// Steps for each row and parameter before it is said that there is no end; a few in all are usual.
const STEPS: usize = 20;

/// Moves the estimates to the nearest point that obeys all `rows`; weights play no part. Returns whether anything moved.
///
/// # Errors
/// [`Error::NoCommonPoint`] where the rows contradict each other, [`Error::NotFinite`] where `f' theta` leaves the floating-point range, and
/// [`Error::Rls`] where `P` is not positive definite, which [`ExactHold`](ct_rls::ExactHold) excludes; nothing is changed then.
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

/// Moves the estimates to the nearest point of the box `lower <= theta <= upper`, entry by entry; infinite bounds are none.
/// Returns whether anything moved.
///
/// Where `P` is so nearly singular that rounding hides which point is nearest, each entry goes to its nearer bound.
///
/// # Errors
/// [`Error::Bounds`], [`Error::NotFinite`] where a violation leaves the floating-point range, and [`Error::Rls`] where `P` is not positive definite, which [`ExactHold`](ct_rls::ExactHold) excludes;
/// nothing is changed then.
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

/// A row that is active or becomes so, with the sign of the bound that holds.
#[derive(Clone, Copy)]
struct Active {
    row: usize,
    sign: f64,
    /// 1 over `sum |f_i| sqrt(P_ii)`: with it no direction is longer than 1, whatever the units.
    unit: f64,
    lambda: f64,
}

/// The row that is violated most for its size, its side and its excess; not finite where that is beyond the floating-point range.
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

struct Search<'a, const P: usize, const N: usize> {
    rows: &'a [Interval<P>; N],
    start: SVector<f64, P>,
    theta: SVector<f64, P>,
    /// What the rounding of the entries of `theta` is measured by. With a bound of 0 the entries themselves are no measure; what
    /// they were made from is.
    entries: SVector<f64, P>,
    /// How long the way from the start was, in the metric.
    way: f64,
    /// `L`
    root: SMatrix<f64, P, P>,
    /// `sqrt(P_ii)`
    spread: SVector<f64, P>,
    active: [Active; P],
    /// How many rows are active.
    count: usize,
    /// `Q`, by columns.
    q: [SVector<f64, P>; P],
    /// `R`, by columns.
    r: [[f64; P]; P],
    /// Rows that the active ones imply.
    implied: [bool; N],
}

impl<'a, const P: usize, const N: usize> Search<'a, P, N> {
    #[inline]
    fn new(rows: &'a [Interval<P>; N], start: SVector<f64, P>, root: SMatrix<f64, P, P>) -> Self {
        let mut squares = SVector::zeros();
        for column in root.column_iter() {
            squares += column.component_mul(&column);
        }
        let none = Active {
            row: 0,
            sign: 0.0,
            unit: 0.0,
            lambda: 0.0,
        };
        Self {
            rows,
            start,
            theta: start,
            entries: start.abs(),
            way: 0.0,
            root,
            spread: squares.map(libm::sqrt),
            active: [none; P],
            count: 0,
            q: [SVector::zeros(); P],
            r: [[0.0; P]; P],
            implied: [false; N],
        }
    }

    fn active(&self) -> &[Active] {
        &self.active[..self.count]
    }

    fn next(&self) -> Option<(usize, f64, f64)> {
        most_violated(self.rows, &self.theta, &self.entries, |row| {
            self.implied[row] || self.active().iter().any(|a| a.row == row)
        })
    }

    /// `g`
    fn direction(&self, active: &Active) -> SVector<f64, P> {
        self.root.tr_mul(&self.rows[active.row].f) * (active.sign * active.unit)
    }

    /// The size of a row's terms.
    fn size(&self, active: &Active) -> f64 {
        active.unit * self.rows[active.row].size(active.sign, &self.entries)
    }

    /// `Q' g`, `z = g - Q Q' g` and `z'z`.
    fn split(&self, g: &SVector<f64, P>) -> ([f64; P], SVector<f64, P>, f64) {
        let (mut h, mut z, mut left) = ([0.0; P], *g, g.norm_squared());
        loop {
            let before = left;
            for (h, q) in h.iter_mut().zip(&self.q[..self.count]) {
                let part = q.dot(&z);
                *h += part;
                z -= q * part;
            }
            left = z.norm_squared();
            // once more where much has gone, so that rounding is no part of what is left
            let again = left < 0.01 * before && left > DEPENDENT * DEPENDENT;
            if !again {
                return (h, z, left);
            }
        }
    }

    /// `R^-1 h`; entries beyond the active rows are 0.
    fn combination(&self, mut h: [f64; P]) -> [f64; P] {
        for i in (0..self.count).rev() {
            h[i] /= self.r[i][i];
            for j in 0..i {
                h[j] -= self.r[i][j] * h[i];
            }
        }
        h
    }

    fn push(&mut self, active: Active, mut h: [f64; P], z: SVector<f64, P>, slope: f64) {
        let length = libm::sqrt(slope);
        h[self.count] = length;
        self.q[self.count] = z / length;
        self.r[self.count] = h;
        self.active[self.count] = active;
        self.count += 1;
    }

    /// Lets a row go and goes back to the start.
    fn remove(&mut self, j: usize) {
        let (active, count) = (self.active, self.count);
        self.count = j;
        for later in &active[j + 1..count] {
            let (h, z, slope) = self.split(&self.direction(later));
            self.push(*later, h, z, slope);
        }
        self.implied = [false; N];
        (self.theta, self.way) = (self.start, 0.0);
    }

    /// Moves `theta` to where the active rows hold, by the shortest way.
    fn move_onto_active(&mut self) {
        let (mut x, mut y) = (SVector::zeros(), [0.0; P]);
        for (j, active) in self.active().iter().enumerate() {
            let interval = &self.rows[active.row];
            let left = interval.bound(active.sign) - interval.f.dot(&self.theta);
            let known: f64 = (0..j).map(|i| self.r[j][i] * y[i]).sum();
            y[j] = (left * active.sign * active.unit - known) / self.r[j][j];
            x += self.q[j] * y[j];
        }
        self.go(&x);
    }

    /// `theta += L x`
    fn go(&mut self, x: &SVector<f64, P>) {
        self.theta += self.root * x;
        self.way += x.norm();
        let ends = self.theta.abs().sup(&self.start.abs());
        self.entries = ends + self.spread * (WAY / OBEYED * self.way);
    }

    /// 1 over the row's length in the metric, its terms added up; 1 where it has none.
    fn unit(&self, row: usize) -> f64 {
        let scale = self.rows[row].f.abs().dot(&self.spread);
        if scale > 0.0 { 1.0 / scale } else { 1.0 }
    }

    /// Makes a row active whose bound on one side is exceeded, and lets others go that are in its way. `false` where no point obeys
    /// this row and the active ones.
    fn enter(&mut self, row: usize, sign: f64, excess: f64) -> bool {
        let unit = self.unit(row);
        let mut entering = Active {
            row,
            sign,
            unit,
            lambda: 0.0,
        };
        let (mut excess, mut first) = (excess * unit, true);
        let g = self.direction(&entering);
        loop {
            let (h, z, slope) = self.split(&g);
            let r = self.combination(h);
            let shares = || self.active().iter().zip(r.map(f64::abs));
            // An only row is measured by nothing but itself.
            let least = if self.count == 0 {
                0.0
            } else {
                DEPENDENT * (1.0 + shares().map(|(_, r)| r).sum::<f64>())
            };
            let independent = self.count < P && libm::sqrt(slope) > least;
            if !independent && first {
                let sizes = shares().map(|(active, r)| r * self.size(active));
                if excess <= OBEYED * (self.size(&entering) + sizes.sum::<f64>()) {
                    self.implied[row] = true;
                    return true;
                }
            }
            let full = if independent {
                excess / slope
            } else {
                f64::INFINITY
            };
            let leaving = (0..self.count)
                .filter(|&j| r[j] > f64::EPSILON && !self.rows[self.active[j].row].equality())
                .map(|j| (self.active[j].lambda.max(0.0) / r[j], j))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let (t, leaves) = match leaving {
                Some((t, j)) if t < full => (t, Some(j)),
                _ => (full, None),
            };
            if t == f64::INFINITY {
                return false;
            }
            for (active, r) in self.active[..self.count].iter_mut().zip(r) {
                active.lambda -= t * r;
            }
            entering.lambda += t;
            let Some(j) = leaves else {
                self.push(entering, h, z, slope);
                if first {
                    self.go(&(z * -t));
                } else {
                    self.move_onto_active();
                }
                return true;
            };
            if independent {
                excess -= slope * t;
            }
            self.remove(j);
            first = false;
        }
    }
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
            // for what rounding left
            search.move_onto_active();
            rls.set_theta(search.theta)?;
            return Ok(search.theta != start);
        };
        next = violated;
    }
    let (row, _, violation) = next;
    Err(Error::NoCommonPoint { row, violation })
}
