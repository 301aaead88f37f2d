//! Dual active-set method: rows enter the active set, and rows that block a step leave it.

use nalgebra::{SMatrix, SVector};

use super::{Active, DEPENDENT, Interval, OBEYED, WAY, most_violated};

pub(super) struct Search<'a, const P: usize, const N: usize> {
    rows: &'a [Interval<P>; N],
    start: SVector<f64, P>,
    pub(super) theta: SVector<f64, P>,
    /// Scale for the rounding errors of `theta`. With a bound of 0 the entries themselves are no scale; the terms that they were computed
    /// from are.
    entries: SVector<f64, P>,
    /// Distance from the start, in the metric.
    way: f64,
    /// `L`
    root: SMatrix<f64, P, P>,
    /// `sqrt(P_ii)`
    spread: SVector<f64, P>,
    active: [Active; P],
    /// Number of active rows.
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
    pub(super) fn new(
        rows: &'a [Interval<P>; N],
        start: SVector<f64, P>,
        root: SMatrix<f64, P, P>,
    ) -> Self {
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

    pub(super) fn next(&self) -> Option<(usize, f64, f64)> {
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
            // repeat the projection after strong cancellation, so that rounding errors do not dominate
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

    /// Removes a row from the active set and restarts.
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

    /// Moves `theta` by the shortest distance onto the set where the active rows are satisfied.
    pub(super) fn move_onto_active(&mut self) {
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

    /// 1 over the row's length in the metric, as the sum of its terms' absolute values; 1 if this length is zero.
    pub(super) fn unit(&self, row: usize) -> f64 {
        let scale = self.rows[row].f.abs().dot(&self.spread);
        if scale > 0.0 { 1.0 / scale } else { 1.0 }
    }

    /// Makes a row active that is violated on one side, and removes rows that block the step. `false` if no point satisfies this row and
    /// the active ones.
    pub(super) fn enter(&mut self, row: usize, sign: f64, excess: f64) -> bool {
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
            // For a single row, only the row itself is a scale.
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
