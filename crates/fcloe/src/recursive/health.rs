//! State of the recursive estimator, including condition (14).

use ct_rls::RecursiveEstimator;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::RecursiveFcloe;
use crate::{ClosedLoop, Condition, Error, PlantModel};

/// State of the estimator for an operator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoopHealth {
    /// The least squares inside, in the relative parameters `delta = theta/scale - 1`: the smallest eigenvalue of the
    /// information matrix \[unit of y^2\], the trace, and the counts of samples.
    pub least_squares: ct_rls::Health,
    /// Root mean square of the output error over the memory, unit of y.
    pub residual_rms: f64,
    /// Steps that were halved because P^ would not have been stable, or a parameter would have left its range.
    pub shortened: u64,
    /// Steps that were rejected for these reasons.
    pub refused: u64,
    /// Steps that were cut to the step limit.
    pub limited: u64,
    /// Condition (14) between the filter and the plausible plants, the worst of them: the present estimates, and those two standard
    /// deviations away along each column of a square root of the covariance.
    pub plausible: Condition,
}

impl RecursiveFcloe {
    /// The state of the estimator, with condition (14). The call computes roots of some polynomials: use it only now and then.
    ///
    /// # Errors
    /// [`Error::Rls`] where the least squares inside have stopped; [`Error::Lti`] for numbers out of range.
    pub fn loop_health(&self) -> Result<LoopHealth, Error> {
        let mut worst = self.condition(&self.plant()?)?;
        for plant in self.plausible_plants() {
            let condition = self.condition(&plant)?;
            if condition.verdict > worst.verdict
                || (condition.verdict == worst.verdict && condition.least < worst.least)
            {
                worst = condition;
            }
        }
        let [shortened, refused, limited] = self.counts();
        Ok(LoopHealth {
            least_squares: self.least_squares().health()?,
            residual_rms: self.residual_rms(),
            shortened,
            refused,
            limited,
            plausible: worst,
        })
    }

    /// Condition (14) between the present filter and a plant that is assumed to be the true one.
    ///
    /// # Errors
    /// As [`Condition::new`].
    pub fn condition(&self, truth: &PlantModel) -> Result<Condition, Error> {
        let truth = ClosedLoop::new(truth, self.controller())?;
        Condition::new(&self.filter_polynomial()?, truth.characteristic())
    }

    /// `theta +- 2 sd` along the columns of a Cholesky factor of the covariance; invalid plants are left out.
    fn plausible_plants(&self) -> Vec<PlantModel> {
        let covariance: DMatrix<f64> =
            self.least_squares().covariance() * self.residual_rms().powi(2);
        let Some(root) = covariance.cholesky() else {
            return Vec::new();
        };
        let root = root.l();
        let theta = self.theta();
        let at = |column: usize, sign: f64| {
            let moved: Vec<f64> = (0..theta.len())
                .map(|i| theta[i] + sign * 2.0 * root[(i, column)] * self.scale()[i])
                .collect();
            PlantModel::from_theta(self.orders(), &moved).ok()
        };
        let columns = 0..theta.len();
        columns
            .flat_map(|column| [at(column, 1.0), at(column, -1.0)])
            .flatten()
            .collect()
    }
}
