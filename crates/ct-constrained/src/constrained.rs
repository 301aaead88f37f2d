//! Least squares with forgetting, equality rows and penalties.
//!
//! Model: `y = theta' phi` and rows `F theta = chi` or `F theta <= chi`; `M = [phi'; F]`, `z = [y; chi]`, `eps = z - M theta^`;
//! [U] 3.9, with the transpose that (3.9a) lacks:
//! ```text
//! dtheta^/dt = Q M' W eps
//! dQ/dt      = eta Q - Q M' Gamma M Q
//! ```
//! Assumptions: `phi`, `y`, `F`, `chi` and the weights are constant over the step; `W` is diagonal.
//!
//! - Data and equality rows have **`Gamma = W`**: for that, not for `Gamma = I`, the criterion (3.5) is minimised.
//! - A penalty is active where its row is violated, enters `theta` with its weight, and has **`Gamma = 0`**: with
//!   `Gamma = w` the Lyapunov function could grow, and `dQ/dt` would jump at every crossing.
//!
//! Equations: `Gamma` is diagonal, so that rows are taken one at a time and no matrix is inverted. With
//! `b = (1 - e^{-eta h})/eta` and the data taken in by the exact step of [`ct_rls::ExactHold`],
//! ```text
//! equality row i:           Q^-1 += w_i b f_i f_i',  theta^ the minimum          (in any order the same)
//! penalty row i, violated:  theta^ += Q f_i (chi_i - f_i'theta^) (1 - e^{-w_i h f_i'Q f_i})/(f_i'Q f_i)
//! ```
//! Data and equality rows are exact together; that penalties follow them is a splitting of first order in `h`, stable for any
//! `w h`. Where `theta` obeys the rows, `V = delta' Q^-1 delta` falls at least as `e^{-eta t}`:
//! `dV/dt <= -eta V - eps' (2 W - Gamma) eps`.
//!
//! [`ConstrainedRls::with_free_gamma`] takes data and rows with `gamma_i < 2 w_i` apart from `w_i`. `V` still falls, by (3.8) term by
//! term; but nothing is minimised, neither (3.5) nor, as the paper states, for `Gamma = I`. Each row is then exact alone,
//! ```text
//! equality row i:  Q^-1 += gamma_i b f_i f_i',   f_i'(theta - theta^) shrinks by (1 + gamma_i b f_i'Q f_i)^(-w_i/gamma_i)
//! ```
//! and one after the other a splitting of first order in `h`, stable for any step.
//!
//! Convergence: as without constraints, with the equality rows' part in the excitation: they need not be excited.
//!
//! Cost per update: `2 p^2` multiplications for the data and for each row that acts.
//!
//! Reference: A. J. Udink ten Cate, *Continuous-time constrained least-squares algorithms for recursive parameter estimation of stochastic
//! linear systems by a stabilized output error method*, WP-85-54, IIASA, Laxenburg, 1985, section 3.

use ct_rls::{ContinuousRls, Health, Innovation, Outcome, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};

use crate::{Error, Relation, Row};

/// Recursive least squares in continuous time for `P` parameters that obey `R` rows, no allocation.
///
/// ```
/// use ct_constrained::{ConstrainedRls, Row};
/// use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
/// use nalgebra::{SMatrix, SVector};
///
/// let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 100.0, Weights::least_squares(0.01)?)?;
/// // the parameters are known to sum to 1; the regressor alone does not determine them separately
/// let mut constrained = ConstrainedRls::new(rls, [Row::equal([1.0, 1.0], 1.0, 1e3)?])?;
/// for _ in 0..100 {
///     constrained.update(&Sample::new([2.0, -1.0], 0.5), 0.1);
/// }
/// assert!((constrained.theta()[0] - 0.5).abs() < 1e-3);
/// # Ok::<(), ct_constrained::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ConstrainedRls<const P: usize, const R: usize> {
    rls: ContinuousRls<P>,
    rows: [Row<P>; R],
    window: Window,
    /// Whether `Gamma` may differ from `W`.
    free_gamma: bool,
}

/// `b` of the last step; valid while `eta` and `h` do not change.
#[derive(Clone, Copy, Debug)]
struct Window {
    eta: f64,
    dt: f64,
    length: f64,
}

impl Window {
    fn length(&mut self, eta: f64, dt: f64) -> f64 {
        if self.eta != eta || self.dt != dt {
            let x = eta * dt;
            let length = if x < f64::EPSILON {
                dt
            } else {
                -libm::expm1(-x) / eta
            };
            *self = Self { eta, dt, length };
        }
        self.length
    }
}

impl<const P: usize, const R: usize> ConstrainedRls<P, R> {
    /// Adds rows to an estimator: least squares, `gamma = c` for the data and `Gamma = W` for the equality rows.
    ///
    /// # Errors
    /// [`Error::GammaNotWeight`], [`Error::RowGammaNotWeight`].
    pub fn new(rls: ContinuousRls<P>, rows: [Row<P>; R]) -> Result<Self, Error> {
        check_weights(&rls.weights())?;
        rows.iter().try_for_each(check_row)?;
        Ok(Self::made(rls, rows, false))
    }

    /// As [`new`](Self::new), for data and rows whose `gamma` is not their weight: [`Weights::new`] and [`Row::with_gamma`] hold them to
    /// `gamma_i < 2 w_i`, where `dV/dt = -eta V - eps' (2 W - Gamma) eps` is negative, (3.8) of the paper.
    ///
    /// The estimates are then **not** the minimum of (3.5), and depend on the order in which rows act, to first order in the step.
    pub fn with_free_gamma(rls: ContinuousRls<P>, rows: [Row<P>; R]) -> Self {
        Self::made(rls, rows, true)
    }

    fn made(rls: ContinuousRls<P>, rows: [Row<P>; R], free_gamma: bool) -> Self {
        let window = Window {
            eta: f64::NAN,
            dt: f64::NAN,
            length: 0.0,
        };
        Self {
            rls,
            rows,
            window,
            free_gamma,
        }
    }

    /// The rows.
    pub fn rows(&self) -> &[Row<P>; R] {
        &self.rows
    }

    /// Replaces row `index`, counted from 0: where `F` or `chi` vary in time.
    ///
    /// # Errors
    /// [`Error::NoSuchRow`]; [`Error::RowGammaNotWeight`] unless [`with_free_gamma`](Self::with_free_gamma) made this one.
    pub fn set_row(&mut self, index: usize, row: Row<P>) -> Result<(), Error> {
        if !self.free_gamma {
            check_row(&row)?;
        }
        match self.rows.get_mut(index) {
            Some(place) => {
                *place = row;
                Ok(())
            }
            None => Err(Error::NoSuchRow { index, rows: R }),
        }
    }

    /// Violation of each row; unit of its `chi`.
    pub fn violations(&self) -> [f64; R] {
        self.rows.map(|row| row.violation(self.rls.theta()))
    }

    /// The estimator inside.
    pub fn rls(&self) -> &ContinuousRls<P> {
        &self.rls
    }

    /// The estimator inside: to reset `P`, or to [`project`](crate::project).
    ///
    /// Weights with `gamma` other than `c` set through this are not checked, and give up the minimum.
    pub fn rls_mut(&mut self) -> &mut ContinuousRls<P> {
        &mut self.rls
    }

    /// [`update`](RecursiveEstimator::update) with weights for this step alone.
    ///
    /// # Errors
    /// [`Error::GammaNotWeight`] unless [`with_free_gamma`](Self::with_free_gamma) made this one; nothing is done then.
    pub fn update_with(
        &mut self,
        sample: &Sample<P>,
        dt: f64,
        weights: &Weights,
    ) -> Result<Innovation, Error> {
        if !self.free_gamma {
            check_weights(weights)?;
        }
        Ok(self.step(sample, dt, weights))
    }

    fn step(&mut self, sample: &Sample<P>, dt: f64, weights: &Weights) -> Innovation {
        let innovation = self.rls.update_with(sample, dt, weights);
        let length = match innovation.outcome {
            Outcome::Updated | Outcome::Capped => self.window.length(weights.eta(), dt),
            // without forgetting; the rows are enforced nevertheless
            Outcome::Silent => dt,
            _ => return innovation,
        };
        for row in &self.rows {
            if row.relation() == Relation::Equal && row.weight() > 0.0 {
                let ratio = row.gamma() / row.weight();
                let information = row.weight() * length;
                self.rls.absorb_with(row.f(), row.chi(), information, ratio);
            }
        }
        for row in &self.rows {
            if row.relation() != Relation::Equal {
                row.penalize(&mut self.rls, dt);
            }
        }
        innovation
    }
}

fn check_row<const P: usize>(row: &Row<P>) -> Result<(), Error> {
    if row.is_least_squares() {
        return Ok(());
    }
    Err(Error::RowGammaNotWeight {
        gamma: row.gamma(),
        weight: row.weight(),
    })
}

fn check_weights(weights: &Weights) -> Result<(), Error> {
    let (gamma, c) = (weights.gamma(), weights.c());
    if gamma != c {
        return Err(Error::GammaNotWeight { gamma, c });
    }
    Ok(())
}

impl<const P: usize, const R: usize> RecursiveEstimator for ConstrainedRls<P, R> {
    type Sample = Sample<P>;
    type Theta = SVector<f64, P>;
    type Covariance = SMatrix<f64, P, P>;
    type Error = Error;

    /// Uses the data, then the rows. A rejected sample changes nothing, and its rows are not used either; without a sensor signal, a zero
    /// sample (`phi = 0`, `y = 0`) applies the rows alone.
    fn update(&mut self, sample: &Sample<P>, dt: f64) -> Innovation {
        let weights = self.rls.weights();
        self.step(sample, dt, &weights)
    }

    fn theta(&self) -> &SVector<f64, P> {
        self.rls.theta()
    }

    /// `Q`
    fn covariance(&self) -> SMatrix<f64, P, P> {
        self.rls.covariance()
    }

    fn health(&self) -> Result<Health, Error> {
        Ok(self.rls.health()?)
    }
}
