//! Settings of a batch fit.

use serde::Serialize;

use crate::Error;

/// Matrix that is added to J''.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damping {
    /// `mu I`: depends on the units.
    Identity,
    /// `mu diag(J'')`: does not.
    Diagonal,
}

/// Step rule.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Along the gradient; the first trial length leads to the minimum of the linearised model. Slow in a narrow valley: iterate in delta,
    /// and allow many iterations.
    Gradient,
    /// Step to the minimum of the linearised model, halved until J falls.
    GaussNewton,
    /// Damped.
    LevenbergMarquardt {
        /// The first mu, above 0. The paper uses 0.1, and 1 after a poor start.
        mu: f64,
        /// Matrix of the damping.
        damping: Damping,
    },
}

/// Coordinates of the iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordinates {
    /// The parameters.
    Theta,
    /// `theta = theta0 (1 + delta)`; estimated levels are scaled by the standard deviation of their signal.
    Delta,
}

/// Settings of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settings {
    /// Step rule.
    pub method: Method,
    /// Coordinates of the iteration.
    pub coordinates: Coordinates,
    /// The fit ends with a step that changes every parameter by at most this share of its value, or at a point where the minimum of the
    /// linearised model changes y^ by at most this share of the residual (root mean square both).
    pub tolerance: f64,
    /// Most steps that are taken.
    pub max_iterations: usize,
}

impl Default for Settings {
    /// Levenberg-Marquardt with `0.1 diag(J'')` in theta, to 1e-8.
    fn default() -> Self {
        Self {
            method: Method::LevenbergMarquardt {
                mu: 0.1,
                damping: Damping::Diagonal,
            },
            coordinates: Coordinates::Theta,
            tolerance: 1e-8,
            max_iterations: 100,
        }
    }
}

impl Settings {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let setting = |what, value, range| Err(Error::Setting { what, value, range });
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return setting("the tolerance", self.tolerance, "between 0 and 1");
        }
        match self.method {
            Method::LevenbergMarquardt { mu, .. } if !(mu > 0.0 && mu.is_finite()) => {
                setting("mu", mu, "finite and above 0")
            }
            _ => Ok(()),
        }
    }
}
