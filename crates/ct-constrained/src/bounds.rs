//! A box of bounds on the estimates, enforced at every step: by projection (hard), or by penalties (soft).

#[cfg(feature = "serde")]
mod saved;

use ct_rls::{ContinuousRls, Integrator, RecursiveEstimator};
use nalgebra::SVector;

use crate::projection::check_box;
use crate::{Error, Relation, Row, project_box};

/// How the estimates are kept within their bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Keep {
    /// Projection to the nearest point of the box in the metric of `P`: [`project_box`].
    Projection,
    /// Clipping: each entry outside its bounds is set to the bound, and the others do not change. Literature on simulations uses this rule.
    /// The Lyapunov function may grow, and correlated parameters are not corrected.
    Clamp,
    /// A penalty for each violated bound, relaxed exactly over the step.
    Penalty {
        /// Weight of the penalty, as of a [`Row`]: choose it well above the mean squared error of the output. For example 1e3 times this
        /// error works, and 1 times does not.
        weight: f64,
    },
}

/// The box `lower <= theta <= upper`, entry by entry, and how it is enforced. An infinite bound means no bound, and is saved as `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const P: usize> {
    lower: SVector<f64, P>,
    upper: SVector<f64, P>,
    keep: Keep,
}

impl<const P: usize> Bounds<P> {
    /// A box that is enforced by projection.
    ///
    /// # Errors
    /// [`Error::Bounds`] where a lower bound is above its upper one, or either is NaN.
    pub fn new(lower: [f64; P], upper: [f64; P]) -> Result<Self, Error> {
        let (lower, upper) = (SVector::from(lower), SVector::from(upper));
        check_box(&lower, &upper)?;
        Ok(Self {
            lower,
            upper,
            keep: Keep::Projection,
        })
    }

    /// No bounds.
    pub fn none() -> Self {
        Self {
            lower: SVector::from([f64::NEG_INFINITY; P]),
            upper: SVector::from([f64::INFINITY; P]),
            keep: Keep::Projection,
        }
    }

    /// The same box with another way of enforcing it.
    ///
    /// # Errors
    /// [`Error::Weight`] if the weight of a penalty is negative or not finite.
    pub fn kept_by(self, keep: Keep) -> Result<Self, Error> {
        match keep {
            Keep::Penalty { weight } if !(weight >= 0.0 && weight.is_finite()) => {
                Err(Error::Weight { weight })
            }
            _ => Ok(Self { keep, ..self }),
        }
    }

    /// Lower bounds.
    pub fn lower(&self) -> &SVector<f64, P> {
        &self.lower
    }

    /// Upper bounds.
    pub fn upper(&self) -> &SVector<f64, P> {
        &self.upper
    }

    /// How the box is enforced.
    pub fn keep(&self) -> Keep {
        self.keep
    }

    /// Whether `theta` is inside the box.
    pub fn contains(&self, theta: &SVector<f64, P>) -> bool {
        let mut bounds = self.lower.iter().zip(&self.upper);
        theta
            .iter()
            .all(|x| bounds.next().is_some_and(|(l, u)| (l..=u).contains(&x)))
    }

    /// Enforces the box after a step of `dt` seconds; returns whether the estimates changed.
    ///
    /// # Errors
    /// As of [`project_box`].
    #[inline]
    pub fn enforce<I: Integrator>(
        &self,
        rls: &mut ContinuousRls<P, I>,
        dt: f64,
    ) -> Result<bool, Error> {
        if self.contains(rls.theta()) {
            return Ok(false);
        }
        match self.keep {
            Keep::Projection => project_box(rls, &self.lower, &self.upper),
            Keep::Clamp => {
                let lifted = rls.theta().zip_map(&self.lower, f64::max);
                rls.set_theta(lifted.zip_map(&self.upper, f64::min))?;
                Ok(true)
            }
            Keep::Penalty { weight } => self.pull(rls, weight, dt),
        }
    }

    fn pull<I: Integrator>(
        &self,
        rls: &mut ContinuousRls<P, I>,
        weight: f64,
        dt: f64,
    ) -> Result<bool, Error> {
        let bounds = [
            (Relation::AtLeast, self.lower),
            (Relation::AtMost, self.upper),
        ];
        for (relation, bound) in bounds {
            for (entry, &chi) in bound.iter().enumerate() {
                if chi.is_finite() {
                    let mut f = [0.0; P];
                    f[entry] = 1.0;
                    Row::new(relation, f, chi, weight)?.penalize(rls, dt);
                }
            }
        }
        Ok(true)
    }
}
