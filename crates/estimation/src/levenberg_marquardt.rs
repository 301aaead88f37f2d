//! Levenberg-Marquardt with bounds.
//!
//! Minimises `|r(x)|^2` over a box. The step solves `min |J d - r|^2 + mu |D d|^2`, `D` the column norms of `J`
//! (Marquardt's scaling, so that units do not matter), over the parameters that are not held at a bound by the
//! gradient; it is clipped to the box. `mu` follows the gain ratio (H. B. Nielsen, Damping parameter in Marquardt's
//! method, 1999).

use serde::{Deserialize, Serialize};

use crate::Triangle;

/// Stopping criteria.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stopping {
    /// Largest number of evaluations.
    pub evaluations: usize,
    /// Least relative fall of the cost: a fit ends if an undamped step has a smaller predicted reduction, or if two successive steps
    /// reached a smaller one and an undamped step does not promise much more: at most a thousand times this, and at most 1 %.
    pub cost: f64,
}

/// Reason why the iteration stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Stop {
    /// The cost does not fall any more, and the predicted reduction of a Gauss-Newton step is negligible.
    Converged,
    /// The cost does not fall any more although its slope is not zero: the simulation is not smooth here.
    Stuck,
    /// The largest number of evaluations, or the time limit, was reached.
    Evaluations,
    /// The simulation is not finite at the start.
    NotFinite,
}

/// Small steps end a fit only if the predicted relative reduction of an undamped step is at most this, however coarse the criteria are.
const MUCH_MORE: f64 = 0.01;

pub(crate) struct Minimum {
    pub x: Vec<f64>,
    pub triangle: Triangle,
    pub stop: Stop,
}

/// The nearest value between two bounds. Unlike `clamp` it accepts bounds in any order; NaN stays NaN.
pub fn within(x: f64, (lower, upper): (f64, f64)) -> f64 {
    if x < lower {
        lower
    } else if x > upper {
        upper
    } else {
        x
    }
}

/// Whether a parameter is at a bound and its gradient points outwards.
pub(crate) fn held(x: f64, (lower, upper): (f64, f64), descent: f64) -> bool {
    // With only one bound, the width is infinite, and every value would be within a share of the width.
    let width = upper - lower;
    let room = if width.is_finite() {
        1e-12 * width
    } else {
        0.0
    };
    (x <= lower + room && descent <= 0.0) || (x >= upper - room && descent >= 0.0)
}

/// Minimises from `x`, which is within the bounds, and its Jacobian `at`, if known. `evaluate` gives the R factor of `[J, r]`, `r` =
/// measured minus model, and may return nothing if the cost is above its second argument; `worse` tests this condition without derivatives,
/// and so much faster. After `out_of_time` no step is taken.
pub(crate) fn minimise(
    mut x: Vec<f64>,
    at: Option<Triangle>,
    bounds: &[(f64, f64)],
    stopping: Stopping,
    evaluate: impl Fn(&[f64], f64) -> Option<Triangle>,
    worse: impl Fn(&[f64], f64) -> bool,
    out_of_time: impl Fn() -> bool,
) -> Minimum {
    let p = x.len();
    let at = at.or_else(|| evaluate(&x, f64::INFINITY));
    let Some(mut at) = at.filter(|at| at.cost().is_finite()) else {
        return Minimum {
            x,
            triangle: Triangle::new(p + 1),
            stop: Stop::NotFinite,
        };
    };
    // The predicted reduction of an undamped step shows whether this is a minimum; a small step alone can be caused by the damping.
    let reduction = |at: &Triangle, free: &[usize]| {
        let step = at.solve(free, &vec![1.0; p], 0.0);
        (at.cost() - at.predicted(&step)) / at.cost()
    };
    let end = |reduction: f64| {
        if reduction <= (1e3 * stopping.cost).min(MUCH_MORE) {
            Stop::Converged
        } else {
            Stop::Stuck
        }
    };
    let (mut damping, mut growth) = (1e-3, 2.0);
    let mut evaluations = 1;
    let mut small_steps = 0;
    while evaluations < stopping.evaluations && !out_of_time() {
        let cost = at.cost();
        let free: Vec<usize> = (0..p)
            .filter(|&j| !held(x[j], bounds[j], at.descent(j)))
            .collect();
        let here = reduction(&at, &free);
        if free.is_empty() || cost == 0.0 || here <= stopping.cost {
            return Minimum {
                x,
                triangle: at,
                stop: Stop::Converged,
            };
        }
        let scale: Vec<f64> = (0..p)
            .map(|j| at.column_norm(j).max(f64::MIN_POSITIVE))
            .collect();
        let step = at.solve(&free, &scale, damping);
        let trial: Vec<f64> = x
            .iter()
            .zip(&step)
            .zip(bounds)
            .map(|((x, d), &(lower, upper))| {
                // A positive parameter is reduced by at most four fifths in one step.
                let lower = if lower > 0.0 {
                    lower.max(0.2 * x)
                } else {
                    lower
                };
                within(x + d, (lower, upper.max(lower)))
            })
            .collect();
        let moved: Vec<f64> = trial.iter().zip(&x).map(|(to, from)| to - from).collect();
        let predicted = cost - at.predicted(&moved);
        if moved.iter().all(|d| *d == 0.0) || predicted.abs() <= 1e-15 * cost {
            return Minimum {
                x,
                triangle: at,
                stop: end(here),
            };
        }
        evaluations += 1;
        // A trial after a failed one fails in half of the cases; other trials rarely fail.
        let doubtful = growth > 2.0;
        let next = (!(doubtful && worse(&trial, cost)))
            .then(|| evaluate(&trial, cost))
            .flatten()
            .filter(|next| next.cost() < cost);
        if let Some(next) = next {
            let fall = cost - next.cost();
            let ratio = fall / predicted;
            damping =
                (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0)).max(1e-12);
            growth = 2.0;
            x = trial;
            at = next;
            small_steps = if fall <= stopping.cost * cost {
                small_steps + 1
            } else {
                0
            };
            if small_steps >= 2 && end(reduction(&at, &free)) == Stop::Converged {
                return Minimum {
                    x,
                    triangle: at,
                    stop: Stop::Converged,
                };
            }
        } else {
            if damping > 1e12 || predicted.abs() <= 1e-3 * stopping.cost * cost {
                return Minimum {
                    x,
                    triangle: at,
                    stop: end(here),
                };
            }
            damping *= growth;
            growth *= 2.0;
        }
    }
    Minimum {
        x,
        triangle: at,
        stop: Stop::Evaluations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a curved valley every step is small beside the reduction that an undamped step promises.
    #[test]
    fn a_rough_fit_goes_on_along_a_curved_valley() {
        let rows = |x: &[f64]| {
            let steep = 1e4;
            [
                [-2.0 * steep * x[0], steep, -steep * (x[1] - x[0] * x[0])],
                [1.0, 0.0, 1.0 - x[0]],
                [0.0, 0.0, 0.5],
            ]
        };
        let evaluate = |x: &[f64], _: f64| {
            let mut triangle = Triangle::new(3);
            for row in rows(x) {
                triangle.push(&row);
            }
            triangle.finish();
            Some(triangle)
        };
        let stopping = Stopping {
            evaluations: 2000,
            cost: 1e-3,
        };
        let bounds = [(f64::NEG_INFINITY, f64::INFINITY); 2];
        let begin = vec![-3.0, 9.0];
        let found = minimise(
            begin,
            None,
            &bounds,
            stopping,
            evaluate,
            |_, _| false,
            || false,
        );
        assert!(
            found.stop == Stop::Converged && (found.x[0] - 1.0).abs() < 0.05,
            "{:?}",
            found.x
        );
    }

    #[test]
    fn a_parameter_with_one_bound_is_held_at_that_bound_alone() {
        let (above, below) = ((0.0, f64::INFINITY), (f64::NEG_INFINITY, 2.0));
        for descent in [-1.0, 1.0] {
            assert!(!held(0.3, above, descent));
            assert!(!held(0.3, below, descent));
        }
        assert!(held(0.0, above, -1.0) && !held(0.0, above, 1.0));
        assert!(held(2.0, below, 1.0) && !held(2.0, below, -1.0));
        assert!(held(1.0, (0.0, 1.0), 1.0) && !held(1.0, (0.0, 1.0), -1.0));
    }
}
