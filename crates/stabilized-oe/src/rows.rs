//! Rows over the parameters of the model and of the error filter, `f' theta + f_c' c = chi` or `<= chi`.
//!
//! Model: [U] 4.14 to 4.18 with the signs put right; `M1 = [phi_m'; F]`, `M2 = [-e1'; F_c]`,
//! `eps~ = (e + c^'e1, chi - F theta^ - F_c c^)`, block-diagonal gain:
//! ```text
//! dtheta^/dt = Q1 M1' W eps~        dQ1/dt = eta1 Q1 - Q1 M1' Gamma1 M1 Q1
//! dc^/dt     = Q2 M2' W eps~        dQ2/dt = eta2 Q2 - Q2 M2' Gamma2 M2 Q2
//! ```
//! The data's entry of `W` is the gain's `c`. Over a step each row acts alone, with `h` or `b_i = (1 - e^{-eta_i h})/eta_i`:
//! ```text
//! equality    Q_i^-1 += (gamma_i/c_i) w b_i f_i f_i',  the two blocks share the error: ct_rls::absorb_blocks
//! violated    theta^ += Q1 f r,  c^ += Q2 f_c r,  r = (chi - f'theta^ - f_c'c^) (1 - e^{-w h s})/s,  s = f'Q1 f + f_c'Q2 f_c
//! ```
//! - An equality has the ratio `Gamma/W` of the data: `Gamma = W` for least squares, 0 for the constant gain, which stays constant.
//!   A penalty has `Gamma = 0`.
//! - An equality alone is exact for `eta1 = eta2`, to second order in `h` otherwise: the blocks have no common clock then.
//! - Data and rows one after the other are a splitting of first order in `h`, stable for any `w h`. For the full gain with `gamma = c`
//!   data and equality rows together are exact.
//!
//! Convergence: the full and the constant gain keep their proof where the true `(theta, a)` obeys the rows, `dV/dt <= -eta V - (2 c -
//! gamma) eps~^2 - sum (2 w_i - gamma_i) eps_i^2`. The adaptive block-diagonal gain has none, with rows or without.
//!
//! Reference: A. J. Udink ten Cate, WP-85-54, IIASA, Laxenburg, 1985, section 4.

use ct_constrained::{Relation, Row, project};
use ct_rls::{ContinuousRls, Weights};
use nalgebra::{SMatrix, SVector};

use crate::Error;

/// One linear constraint on `theta = (a_1, .., b_m)` and `c = (c_1, .., c_n)`: a row of `F` and `F_c` in (4.14) of the paper.
///
/// `K = b_0` is such a row, and without noise `c_i = a_i`. With noise a row that couples the two draws `theta^` to where noise draws `c^`:
/// `c_1 >= a_1/2` takes `a_1` from 10.3 (truth 10) to 1.8, where `c_1 >= 8` leaves 10.9 (`cargo test -p stabilized-oe --test all rows::`).
/// Bound `c^` by rows with `f = 0`, or by [`Bounds`](ct_constrained::Bounds).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct CoupledRow<const N: usize, const P: usize> {
    theta: Row<P>,
    f_c: SVector<f64, N>,
}

impl<const N: usize, const P: usize> CoupledRow<N, P> {
    /// A row of any relation.
    ///
    /// - `f`, `f_c`: coefficients of `theta` and of `c`, neither longer than [`MAX_REGRESSOR`](ct_rls::MAX_REGRESSOR), not all of them 0.
    /// - `chi`: right-hand side, unit of `f' theta`; at most 1e99 in size.
    /// - `weight`: 1/(s unit(chi)^2) where the gain's `c` is per unit(y)^2; at least 0, 0 switches the row off. How large: see [`Row`].
    ///
    /// # Errors
    /// [`Error::ZeroRow`], and [`Error::Constrained`] with those of [`Row::new`].
    pub fn new(
        relation: Relation,
        f: [f64; P],
        f_c: [f64; N],
        chi: f64,
        weight: f64,
    ) -> Result<Self, Error> {
        let theta = Row::new(relation, f, chi, weight)?;
        let filter = Row::new(relation, f_c, chi, weight)?;
        if f.iter().chain(&f_c).all(|x| *x == 0.0) {
            return Err(Error::ZeroRow { chi });
        }
        Ok(Self {
            theta,
            f_c: *filter.f(),
        })
    }

    /// Coefficients of `theta`.
    pub fn f(&self) -> &SVector<f64, P> {
        self.theta.f()
    }

    /// Coefficients of `c`.
    pub fn f_c(&self) -> &SVector<f64, N> {
        &self.f_c
    }

    /// Right-hand side.
    pub fn chi(&self) -> f64 {
        self.theta.chi()
    }

    /// Weight.
    pub fn weight(&self) -> f64 {
        self.theta.weight()
    }

    /// Equality or inequality.
    pub fn relation(&self) -> Relation {
        self.theta.relation()
    }

    /// `f' theta + f_c' c - chi` where the row is violated, 0 where it is obeyed; unit of `chi`.
    pub fn violation(&self, theta: &SVector<f64, P>, c: &SVector<f64, N>) -> f64 {
        let r = self.f().dot(theta) + self.f_c.dot(c) - self.chi();
        match self.relation() {
            Relation::Equal => r,
            Relation::AtMost => r.max(0.0),
            Relation::AtLeast => r.min(0.0),
        }
    }
}

/// `(1 - e^{-eta h})/eta`: what a row's weight is multiplied by where `P` has grown by `e^{eta h}` before it; `h` where nothing was
/// forgotten.
pub(crate) fn window(weights: Weights, dt: f64) -> f64 {
    let x = weights.eta() * dt;
    if x < f64::EPSILON {
        dt
    } else {
        -libm::expm1(-x) / weights.eta()
    }
}

/// Value that means no bound in the check.
const FAR: f64 = 1e90;

/// Whether some `(theta, c)` satisfies all rows.
///
/// The shortest one, if there is one, is a combination of the rows, `x = sum mu_j m_j`; so the rows are feasible where those of their
/// Gram matrix, in `mu`, are.
pub(crate) fn check_rows<const N: usize, const P: usize, const R: usize>(
    rows: &[CoupledRow<N, P>; R],
) -> Result<(), Error> {
    if R == 0 {
        return Ok(());
    }
    let lengths = rows.map(|row| libm::hypot(row.f().norm(), row.f_c.norm()));
    let mut unit = [Row::<R>::at_most([0.0; R], 0.0, 0.0)?; R];
    for (i, row) in rows.iter().enumerate() {
        let gram = core::array::from_fn(|j| {
            let other = &rows[j];
            let theta = (row.f() / lengths[i]).dot(&(other.f() / lengths[j]));
            theta + (row.f_c / lengths[i]).dot(&(other.f_c / lengths[j]))
        });
        let (relation, chi) = if row.weight() > 0.0 {
            (row.relation(), row.chi() / lengths[i])
        } else {
            (Relation::AtMost, FAR)
        };
        unit[i] = Row::new(relation, gram, chi, 1.0)?;
    }
    let start = Weights::least_squares(0.0)?;
    let mut mu = ContinuousRls::<R>::new(SVector::zeros(), SMatrix::identity(), start)?;
    match project(&mut mu, &unit) {
        Ok(_) => Ok(()),
        Err(ct_constrained::Error::NoCommonPoint { row, violation }) => {
            let violation = violation * lengths[row];
            Err(ct_constrained::Error::NoCommonPoint { row, violation }.into())
        }
        Err(error) => Err(error.into()),
    }
}
