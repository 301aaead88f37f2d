//! Corrections of an update: rows, bounds and a stable filter.

use ct_constrained::Relation;
use ct_rls::{Innovation, Outcome};
use nalgebra::SVector;

use super::{HALVINGS, SHORTEST_LAG, StabilizedOe};
use crate::hurwitz::is_hurwitz;
use crate::integrator::sealed::ModelRule;
use crate::limits::default_bounds;
use crate::{Derivatives, Error, Gain};

impl<const N: usize, const P: usize, G: Gain<N, P>, D: Derivatives<N>, const R: usize>
    StabilizedOe<N, P, G, D, R>
{
    pub(super) fn unused(outcome: Outcome) -> Innovation {
        Innovation {
            epsilon: f64::NAN,
            s: f64::NAN,
            outcome,
        }
    }

    /// Equalities, then penalties.
    #[inline]
    pub(super) fn take_rows(&mut self, dt: f64) {
        for equality in [true, false] {
            for row in &self.rows {
                if (row.relation() == Relation::Equal) == equality && row.weight() > 0.0 {
                    self.gain.take_row(row, dt);
                }
            }
        }
    }

    /// Brings the estimates back to their bounds, and the model to stability.
    #[inline]
    pub(super) fn keep(&mut self, dt: f64) -> Result<(), Error> {
        let theta_bounds = match &self.theta_bounds {
            Some(bounds) => bounds,
            None => {
                self.shortest = self.shortest.min(dt);
                let (step, highest) = if <G::Integrator as ModelRule>::ANY_STEP {
                    let lag = SHORTEST_LAG * self.slower;
                    (self.shortest, lag * self.shortest)
                } else {
                    (dt, f64::INFINITY)
                };
                if self.default_bounds.0 != step {
                    self.default_bounds = (step, default_bounds::<N, P>(step, highest)?);
                }
                &self.default_bounds.1
            }
        };
        let [theta, filter] = self.gain.keep(theta_bounds, &self.filter_bounds, dt)?;
        self.bounded.theta += u64::from(theta);
        self.bounded.filter += u64::from(filter);
        let before = self.theta;
        self.theta = self.gain.theta();
        if !is_hurwitz::<N>(self.theta.as_slice()) {
            self.stabilize(before)?;
        }
        Ok(())
    }

    /// Reduces the last step of `theta^` so far that the model is stable.
    #[cold]
    fn stabilize(&mut self, before: SVector<f64, P>) -> Result<(), Error> {
        self.bounded.unstable += 1;
        let mut step = self.theta - before;
        self.theta = before;
        for _ in 0..HALVINGS {
            step *= 0.5;
            let theta = before + step;
            if is_hurwitz::<N>(theta.as_slice()) {
                self.theta = theta;
                break;
            }
        }
        self.gain.set_theta(self.theta)
    }
}
