//! One linear constraint on the parameters, `f' theta = chi` or `f' theta <= chi`, and its weight.

use ct_rls::{ContinuousRls, Integrator, MAX_REGRESSOR, RecursiveEstimator};
use nalgebra::SVector;

use crate::Error;

/// A tenth of the largest output error that the estimator accepts.
const MAX_CHI: f64 = 1e99;

/// Equality or inequality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Relation {
    /// `f' theta = chi`
    Equal,
    /// `f' theta <= chi`
    AtMost,
    /// `f' theta >= chi`
    AtLeast,
}

/// One linear constraint on `P` parameters. `f` and `chi` may vary in time: then pass the row again at each sample.
///
/// How large a weight? A row is soft. Over a second it pulls as `w`, the data as `c`, so an equality row wants `w` well above
/// `c |phi|^2/|f|^2`. A penalty, which leaves `P` as it is, wants `w` much above the mean squared error of the output: at 1 it
/// may be useless where 1e3 holds. [`project`](crate::project) has no weight.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Row<const P: usize> {
    f: SVector<f64, P>,
    chi: f64,
    weight: f64,
    gamma: f64,
    relation: Relation,
}

impl<const P: usize> Row<P> {
    /// A row of any relation.
    ///
    /// - `f`: coefficients, one for each parameter; no longer than [`MAX_REGRESSOR`].
    /// - `chi`: right-hand side, unit of `f' theta`; at most 1e99 in size, so that the row's error stays in the range of the estimator.
    /// - `weight`: 1/(s unit(chi)^2) where the data's weight `c` is per unit(y)^2; at least 0, 0 switches the row off.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::TooLarge`], [`Error::Weight`].
    pub fn new(relation: Relation, f: [f64; P], chi: f64, weight: f64) -> Result<Self, Error> {
        let not_finite = |what, value| Err(Error::NotFinite { what, value });
        if let Some(&value) = f.iter().find(|x| !x.is_finite()) {
            return not_finite("a coefficient", value);
        }
        if !chi.is_finite() {
            return not_finite("chi", chi);
        }
        let f = SVector::from(f);
        // A row beyond the estimator's range would be left out of every step.
        for (what, value, limit) in [
            ("the length of f", f.norm(), MAX_REGRESSOR),
            ("chi", chi.abs(), MAX_CHI),
        ] {
            if value > limit {
                return Err(Error::TooLarge { what, value, limit });
            }
        }
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(Error::Weight { weight });
        }
        Ok(Self {
            f,
            chi,
            weight,
            gamma: Self::least_squares_gamma(relation, weight),
            relation,
        })
    }

    /// `w` of an equality, 0 of a penalty: with these the criterion (3.5) is minimised.
    fn least_squares_gamma(relation: Relation, weight: f64) -> f64 {
        match relation {
            Relation::Equal => weight,
            Relation::AtMost | Relation::AtLeast => 0.0,
        }
    }

    /// The same equality with another entry `gamma` of `Gamma` (3.9b of the paper), how fast the row makes `Q` shrink; a new row has
    /// `gamma = w`. Unit of the weight; at least 0, below `2 w`, and 0 where `w` is: then `V` falls, (3.8).
    ///
    /// With a `gamma` other than `w` no criterion is minimised, not even (3.5), and the row needs
    /// [`ConstrainedRls::with_free_gamma`](crate::ConstrainedRls::with_free_gamma). Below `w` the row keeps its influence for longer than
    /// its information, which is useful for a varying `chi`; above `w` its information exceeds its influence.
    ///
    /// # Errors
    /// [`Error::Gamma`] out of this range; [`Error::PenaltyGamma`] for an inequality and a `gamma` other than 0.
    pub fn with_gamma(self, gamma: f64) -> Result<Self, Error> {
        let weight = self.weight;
        if self.relation != Relation::Equal && gamma != 0.0 {
            return Err(Error::PenaltyGamma { gamma });
        }
        if !(gamma == 0.0 || (gamma > 0.0 && gamma < 2.0 * weight)) {
            return Err(Error::Gamma { gamma, weight });
        }
        Ok(Self { gamma, ..self })
    }

    /// Equality `f' theta = chi` with a weight: see [`Row::new`].
    ///
    /// # Errors
    /// As of [`Row::new`].
    pub fn equal(f: [f64; P], chi: f64, weight: f64) -> Result<Self, Error> {
        Self::new(Relation::Equal, f, chi, weight)
    }

    /// Inequality `f' theta <= chi`, a penalty with a weight: see [`Row::new`].
    ///
    /// # Errors
    /// As of [`Row::new`].
    pub fn at_most(f: [f64; P], chi: f64, weight: f64) -> Result<Self, Error> {
        Self::new(Relation::AtMost, f, chi, weight)
    }

    /// Inequality `f' theta >= chi`, a penalty with a weight: see [`Row::new`].
    ///
    /// # Errors
    /// As of [`Row::new`].
    pub fn at_least(f: [f64; P], chi: f64, weight: f64) -> Result<Self, Error> {
        Self::new(Relation::AtLeast, f, chi, weight)
    }

    /// Coefficients.
    pub fn f(&self) -> &SVector<f64, P> {
        &self.f
    }

    /// Right-hand side.
    pub fn chi(&self) -> f64 {
        self.chi
    }

    /// Weight.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Entry of the row in `Gamma`: the weight for an equality, unless [`with_gamma`](Self::with_gamma) was used; 0 for a penalty.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// Whether the row's `gamma` is that of the minimum of (3.5).
    pub(crate) fn is_least_squares(&self) -> bool {
        self.gamma == Self::least_squares_gamma(self.relation, self.weight)
    }

    /// Whether the row is an equality or an inequality.
    pub fn relation(&self) -> Relation {
        self.relation
    }

    /// `f' theta - chi` where the row is violated, 0 where it is obeyed; unit of `chi`.
    pub fn violation(&self, theta: &SVector<f64, P>) -> f64 {
        let r = self.f.dot(theta) - self.chi;
        match self.relation {
            Relation::Equal => r,
            Relation::AtMost => r.max(0.0),
            Relation::AtLeast => r.min(0.0),
        }
    }

    /// If the row is violated, pulls the estimates towards it for `dt` seconds with its weight, exactly. `P` does not change.
    pub fn penalize<I: Integrator>(&self, rls: &mut ContinuousRls<P, I>, dt: f64) {
        if self.violation(rls.theta()) != 0.0 {
            rls.relax(&self.f, self.chi, self.weight * dt);
        }
    }
}
