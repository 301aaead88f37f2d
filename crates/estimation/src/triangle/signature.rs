//! Signature of a parameter that is zero in the model, and the smallest size that a test would detect.
//!
//! **Model**: `y = J theta + j c + e`, the innovations `e` white with standard deviation `sigma`, and `c` the size of an effect that the
//! model lacks. With `p` the part of `j` that is orthogonal to the columns of `J`, the least-squares estimate of `c` has the standard error
//! `sigma/|p|`. A two-sided test of `c = 0` with false alarm rate `a` has power `1 - b` if `c = (z_{a/2} + z_b) sigma/|p|`.
//!
//! **Reference**: L. L. Scharf, B. Friedlander, IEEE Trans. Signal Processing 42 (1994) 2146-2157 (matched subspace detectors).

use super::Triangle;

/// The sum of the normal quantiles of a two-sided false alarm rate of 1 % and of a power of 90 %: minimum detectable size in standard errors.
const DETECTABLE: f64 = 2.576 + 1.282;

/// Influence of a parameter on all rows, in standard deviations of the innovations per unit of the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signature {
    /// Length of the part of the column that no other parameter compensates for.
    pub own: f64,
    /// Length of the whole column.
    pub whole: f64,
}

impl Signature {
    /// The share that no other parameter compensates for, 0 to 1; zero for a parameter without influence.
    #[must_use]
    pub fn visibility(self) -> f64 {
        if self.whole > 0.0 {
            self.own / self.whole
        } else {
            0.0
        }
    }

    /// The size that a test with a false alarm rate of 1 % detects with a power of 90 % \[unit of the parameter\]; `None` if the visibility
    /// is not above `absorbed`, the share that rounding errors and those of the simulation leave.
    #[must_use]
    pub fn smallest_detectable(self, absorbed: f64) -> Option<f64> {
        (self.own > absorbed * self.whole).then(|| DETECTABLE / self.own)
    }
}

impl Triangle {
    /// Signature of the parameter of a `column`; the parameters of the `others` may compensate for it. `sigma`: standard deviation of the
    /// innovations in the unit of the rows.
    #[must_use]
    pub fn signature(&self, column: usize, others: &[usize], sigma: f64) -> Signature {
        // A column that depends on earlier ones leaves rounding errors, whose direction compensates for nothing.
        let (mut order, _) = self.independent_among(others);
        order.push(column);
        let chosen = self.select(&order);
        let last = order.len() - 1;
        Signature {
            own: chosen.at(last, last).abs() / sigma,
            whole: chosen.column_norm(last) / sigma,
        }
    }
}
