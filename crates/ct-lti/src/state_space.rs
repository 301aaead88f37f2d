//! State space of one input and one output: `x' = A x + b u`, `y = c' x + d u`.

use alloc::{vec, vec::Vec};

use crate::error::finite;
use crate::matrix::dot;
use crate::phi::PhiFunctions;
use crate::transfer_function::loop_determinant;
use crate::{Error, Polynomial, TransferFunction};

/// `x' = A x + b u`, `y = c' x + d u`, with n states; n may be 0.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: f64,
}

impl StateSpace {
    /// From A, row by row, b, c and d. The length of b is the number of states.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`].
    pub fn new(
        a: impl Into<Vec<f64>>,
        b: impl Into<Vec<f64>>,
        c: impl Into<Vec<f64>>,
        d: f64,
    ) -> Result<Self, Error> {
        let (a, b, c) = (a.into(), b.into(), c.into());
        let n = b.len();
        for (what, found, expected) in [("A", a.len(), n * n), ("c", c.len(), n)] {
            if found != expected {
                return Err(Error::Length {
                    what,
                    expected,
                    found,
                });
            }
        }
        for (what, values) in [("A", &a[..]), ("b", &b), ("c", &c), ("d", &[d])] {
            finite(what, values)?;
        }
        Ok(Self { a, b, c, d })
    }

    /// Controllable canonical form: `x[i]` is the i-th derivative of `u/A(p)`, A made monic, so that
    /// `y = b[0] x[0] + b[1] x[1] + ..` for a strictly proper one.
    ///
    /// # Errors
    /// [`Error::Overflow`] where a coefficient over the leading one is out of range.
    pub fn controllable(system: &TransferFunction) -> Result<Self, Error> {
        let n = system.order();
        let leading = system.denominator().leading();
        let what = "a coefficient over the leading one";
        let over = |p: &Polynomial| {
            Polynomial::trimmed(p.coefficients().iter().map(|c| c / leading).collect())
                .checked(what)
        };
        let monic = over(system.denominator())?;
        let numerator = over(system.numerator())?;
        let d = numerator.coefficient(n);
        let mut a = vec![0.0; n * n];
        for i in 1..n {
            a[(i - 1) * n + i] = 1.0;
        }
        for j in 0..n {
            a[(n - 1) * n + j] = -monic.coefficient(j);
        }
        let mut b = vec![0.0; n];
        if let Some(last) = b.last_mut() {
            *last = 1.0;
        }
        let c = (0..n).map(|i| libm::fma(-d, monic.coefficient(i), numerator.coefficient(i)));
        Self::new(a, b, c.collect::<Vec<_>>(), d).map_err(|_| Error::Overflow {
            what,
            mend: "scale the time or the signals",
        })
    }

    /// n.
    pub fn order(&self) -> usize {
        self.b.len()
    }

    /// A, row by row, n*n entries \[1/time\].
    pub fn a(&self) -> &[f64] {
        &self.a
    }

    /// b, n entries.
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// c, n entries.
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// Direct term from u to y.
    pub fn d(&self) -> f64 {
        self.d
    }

    /// `y = c' x + d u`. Entries of x beyond n are not looked at, missing ones are 0.
    pub fn output(&self, x: &[f64], u: f64) -> f64 {
        dot(&self.c, x) + self.d * u
    }

    /// The output of self drives next; states are those of self, then those of next.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn series(&self, next: &Self) -> Result<Self, Error> {
        let mut a = self.beside(next);
        let (n, order) = (self.order(), self.order() + next.order());
        for (i, b) in next.b.iter().enumerate() {
            for (j, c) in self.c.iter().enumerate() {
                a[(n + i) * order + j] = b * c;
            }
        }
        let b = self
            .b
            .iter()
            .copied()
            .chain(next.b.iter().map(|b| b * self.d));
        let c = self
            .c
            .iter()
            .map(|c| next.d * c)
            .chain(next.c.iter().copied());
        Self::connected(a, b.collect(), c.collect(), next.d * self.d)
    }

    /// Parallel connection: one input drives both systems, and the outputs are added. The states of self come first, then those of other.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn parallel(&self, other: &Self) -> Result<Self, Error> {
        let join = |one: &[f64], two: &[f64]| one.iter().chain(two).copied().collect();
        let (b, c) = (join(&self.b, &other.b), join(&self.c, &other.c));
        Self::connected(self.beside(other), b, c, self.d + other.d)
    }

    /// Negative feedback `u = r - back y` around self, from r to the output of self; states are those of self, then
    /// those of back.
    ///
    /// # Errors
    /// [`Error::AlgebraicLoop`] where the direct terms leave the loop without a solution, [`Error::Overflow`].
    pub fn feedback(&self, back: &Self) -> Result<Self, Error> {
        // y = c1 x1 + d1 e, z = c2 x2 + d2 y, e = r - z: e = k (r - d2 c1 x1 - c2 x2) with k = 1/(1 + d1 d2).
        let k = 1.0 / loop_determinant(self.d, back.d)?;
        let (n, order) = (self.order(), self.order() + back.order());
        // e and y in the states and r.
        let join = |one: f64, two: f64| -> Vec<f64> {
            let one = self.c.iter().map(|c| one * c);
            one.chain(back.c.iter().map(|c| two * c)).collect()
        };
        let (e, y) = (join(-k * back.d, -k), join(k, -k * self.d));
        let mut a = self.beside(back);
        for i in 0..order {
            // Input of state i: e for the states of self, y for the states of back.
            let (gain, drive) = if i < n {
                (self.b[i], &e)
            } else {
                (back.b[i - n], &y)
            };
            for (j, drive) in drive.iter().enumerate() {
                a[i * order + j] += gain * drive;
            }
        }
        let b = self.b.iter().map(|b| b * k);
        let b = b.chain(back.b.iter().map(|b| b * k * self.d));
        Self::connected(a, b.collect(), y, k * self.d)
    }

    /// The two matrices A on the diagonal of one.
    fn beside(&self, other: &Self) -> Vec<f64> {
        let (n, order) = (self.order(), self.order() + other.order());
        let mut a = vec![0.0; order * order];
        for (system, at) in [(self, 0), (other, n)] {
            let m = system.order();
            for i in 0..m {
                let from = (at + i) * order + at;
                a[from..from + m].copy_from_slice(&system.a[i * m..(i + 1) * m]);
            }
        }
        a
    }

    fn connected(a: Vec<f64>, b: Vec<f64>, c: Vec<f64>, d: f64) -> Result<Self, Error> {
        Self::new(a, b, c, d).map_err(|_| Error::Overflow {
            what: "a connection of two systems",
            mend: "scale the time or the signals",
        })
    }

    /// As [`TransferFunction::step_response`].
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Overflow`] where an unstable one has grown out of range.
    pub fn step_response(&self, times: &[f64]) -> Result<Vec<f64>, Error> {
        finite("the times", times)?;
        let n = self.order();
        let mut functions = PhiFunctions::new(n, &self.a);
        let (mut phi1, mut phi2) = (vec![0.0; n], vec![0.0; n]);
        let response = times.iter().map(|&t| {
            if t < 0.0 {
                return Ok(0.0);
            }
            functions.compute(t)?;
            functions.phi12(&self.b, &mut phi1, &mut phi2);
            let y = t * dot(&self.c, &phi1) + self.d;
            let what = "a step response";
            let mend = "the system is unstable: choose earlier times";
            if y.is_finite() {
                Ok(y)
            } else {
                Err(Error::Overflow { what, mend })
            }
        });
        response.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn canonical_form_of_a_biproper_one() {
        let g = TransferFunction::from_coefficients(&[1.0, 2.0, 6.0], &[4.0, 8.0, 2.0]).unwrap();
        let s = StateSpace::controllable(&g).unwrap();
        assert_eq!(s.a(), [0.0, 1.0, -2.0, -4.0]);
        assert_eq!(s.b(), [0.0, 1.0]);
        assert_eq!(s.c(), [0.5 - 6.0, 1.0 - 12.0]);
        assert_eq!(s.d(), 3.0);
    }

    #[test]
    fn wrong_lengths_are_refused() {
        let wrong = StateSpace::new([1.0, 2.0], [1.0, 0.0], [1.0, 0.0], 0.0);
        let (what, expected, found) = ("A", 4, 2);
        assert_eq!(
            wrong,
            Err(Error::Length {
                what,
                expected,
                found
            })
        );
        assert!(StateSpace::new([f64::NAN], [1.0], [1.0], 0.0).is_err());
    }

    #[test]
    fn a_gain_has_no_states() {
        let g = TransferFunction::from_coefficients(&[3.0], &[2.0]).unwrap();
        assert_eq!(g.step_response(&[-1.0, 0.0, 5.0]).unwrap(), [0.0, 1.5, 1.5]);
        let s = StateSpace::controllable(&g).unwrap();
        assert_eq!(s.feedback(&s).unwrap().d(), 1.5 / (1.0 + 2.25));
    }
}
