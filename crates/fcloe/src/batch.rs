//! The batch fit: gradient, Gauss-Newton, Levenberg-Marquardt.
//!
//! Equations (Baysse, Carrillo, Habbadi, (6), (27) to (31)), with `J' = -2 J_s'e`, `J'' = 2 J_s'J_s`, `J_s` the matrix of
//! sensitivities:
//! ```text
//! gradient              theta+ = theta - rho J'                 rho by a line search (a unit step is far too long)
//! Gauss-Newton          theta+ = theta - rho J''^-1 J'          rho = 1, 1/2, 1/4, ..
//! Levenberg-Marquardt   theta+ = theta - (J'' + mu I)^-1 J'     or with mu diag(J'')
//! ```
//! each in theta, or in delta with `theta = theta0 (1 + delta)`, where a sensitivity is `theta0 sigma`. With `mu
//! diag(J'')` the two are the same to rounding; with `mu I` the steps in theta depend on the units of the signals and
//! of time. A step that raises J, or after which P^ is not Hurwitz, is refused: mu grows tenfold, or rho shrinks; a
//! step that is taken lets mu fall tenfold. A larger mu is slower and safer, never faster.
//!
//! Assumptions: the controller is known to its last digit, r is uncorrelated with the noise, the start gives a stable
//! loop. What is found is a minimum near the start, not always the lowest one.
//!
//! Cost: one pass over the records for each step tried.

use estimation::{Residuals, Triangle};
use serde::Serialize;

use crate::problem::Undefined;
use crate::{
    ClosedLoop, Coordinates, Damping, Error, Levels, Method, PlantModel, Problem, Settings,
};

/// If no step lowers J, a minimum within this distance counts as reached: J cannot be computed more accurately.
const AT_ROUNDING: f64 = 1e-5;

/// Reason why a fit has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// The last step was within the tolerance.
    Converged,
    /// No step lowers J by more than its rounding error.
    Rounding,
    /// All remaining steps make the loop unstable: the best fit is a plant that this controller does not stabilise. Check the controller,
    /// or the orders.
    StabilityBorder,
    /// No step lowers J, although the gradient is not zero.
    NoProgress,
    /// J'' is singular at a step of Gauss-Newton: the data do not determine all parameters. Lower the orders, or use
    /// Levenberg-Marquardt.
    Singular,
    /// The iterations have run out.
    Iterations,
}

impl Stop {
    /// Whether a minimum was reached.
    pub fn was_successful(self) -> bool {
        matches!(self, Self::Converged | Self::Rounding)
    }
}

/// One iterate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Iterate {
    /// The parameters.
    pub theta: Vec<f64>,
    /// Value of J.
    pub cost: f64,
}

/// The result.
#[derive(Debug, Clone, Serialize)]
pub struct Fit {
    /// The plant.
    pub plant: PlantModel,
    /// The levels of each record, given or estimated.
    pub levels: Vec<Levels>,
    /// `J = sum eps^2`.
    pub cost: f64,
    /// Samples in all records.
    pub samples: usize,
    /// Reason for the end.
    pub stop: Stop,
    /// Steps that were taken.
    pub iterations: usize,
    /// Number of simulations of the records: one for the start, and one for each tried step with a stable loop.
    pub evaluations: usize,
    /// Steps that were refused because P^ would not be Hurwitz.
    pub refused: usize,
    /// The start and the point after each step.
    pub way: Vec<Iterate>,
    /// theta, and the estimated levels' distances from their starts.
    #[serde(skip)]
    pub(crate) x: Vec<f64>,
}

impl Fit {
    /// Root mean square of the residual, unit of y.
    pub fn residual_rms(&self) -> f64 {
        (self.cost / self.samples as f64).sqrt()
    }
}

impl Problem {
    /// Fits the plant from a start.
    ///
    /// # Errors
    /// [`Error::Setting`]; [`Error::Length`] for a start of other orders; [`Error::UnstableLoop`] for a start whose
    /// loop is not stable; [`Error::ZeroStart`] in delta; [`Error::NotFiniteSimulation`].
    pub fn fit(&self, start: &PlantModel, settings: &Settings) -> Result<Fit, Error> {
        settings.check()?;
        let (expected, found) = (self.orders().parameters(), start.theta().len());
        if start.orders() != self.orders() {
            return Err(Error::Length {
                what: "the start",
                expected,
                found,
            });
        }
        ClosedLoop::new(start, self.controller())?.require_stable()?;
        let mut x = self.start(start);
        let scale = self.scale(start, settings.coordinates)?;
        let mut at = self
            .evaluate(&x, f64::INFINITY, true)
            .map_err(|_| Error::NotFiniteSimulation)?;
        let mut run = Run {
            mu: match settings.method {
                Method::LevenbergMarquardt { mu, .. } => mu,
                _ => 0.0,
            },
            tolerance: settings.tolerance,
            evaluations: 1,
            refused: 0,
        };
        let iterate = |x: &[f64], at: &Triangle| Iterate {
            theta: x[..expected].to_vec(),
            cost: at.cost(),
        };
        let mut way = vec![iterate(&x, &at)];
        let stop = loop {
            if way.len() > settings.max_iterations {
                break Stop::Iterations;
            }
            let (step, next) = match run.step(self, settings.method, &x, &at, &scale) {
                Ok(found) => found,
                Err(stop) => break stop,
            };
            let small = self.is_small(&x, &step, &at, settings.tolerance);
            x.iter_mut().zip(&step).for_each(|(x, step)| *x += step);
            at = next;
            way.push(iterate(&x, &at));
            if small {
                break Stop::Converged;
            }
        };
        Ok(Fit {
            plant: self.plant(&x)?,
            levels: self.levels(&x),
            cost: at.cost(),
            samples: self.samples(),
            stop,
            iterations: way.len() - 1,
            evaluations: run.evaluations,
            refused: run.refused,
            way,
            x,
        })
    }

    /// Scale of each coordinate.
    fn scale(&self, start: &PlantModel, coordinates: Coordinates) -> Result<Vec<f64>, Error> {
        if coordinates == Coordinates::Theta {
            return Ok(vec![1.0; self.columns()]);
        }
        if let Some(index) = start.theta().iter().position(|theta| *theta == 0.0) {
            return Err(Error::ZeroStart { index });
        }
        let mut scale = start.theta().to_vec();
        scale.extend(self.scales().iter().map(|s| s.max(f64::MIN_POSITIVE)));
        Ok(scale)
    }

    fn is_small(&self, x: &[f64], step: &[f64], at: &Triangle, tolerance: f64) -> bool {
        let parameters = self.orders().parameters();
        let changes = x.iter().zip(step).take(parameters);
        let relative = changes.clone().all(|(x, d)| d.abs() <= tolerance * x.abs())
            && self
                .scales()
                .iter()
                .zip(&step[parameters..])
                .all(|(scale, d)| d.abs() <= tolerance * scale);
        relative || at_minimum(at, tolerance)
    }
}

/// Whether the distance to the minimum of the linearised model is below this share of the residual, as root mean squares of y^. The step
/// itself is no measure, because damping makes it small far from any minimum too.
fn at_minimum(at: &Triangle, tolerance: f64) -> bool {
    let last = at.columns() - 1;
    // The residual's coordinates along the columns.
    let nearer: f64 = (0..last).map(|i| at.at(i, last).powi(2)).sum();
    at.determined() && nearer <= tolerance * tolerance * at.cost()
}

/// A step, and the triangle where it ends.
type Taken = (Vec<f64>, Triangle);

struct Run {
    mu: f64,
    tolerance: f64,
    evaluations: usize,
    refused: usize,
}

/// Result of a trial step.
enum Tried {
    Lower(Triangle),
    /// J changes by no more than its rounding error.
    Level,
    Higher,
    Unstable,
}

impl Run {
    /// The next step that lowers J.
    fn step(
        &mut self,
        problem: &Problem,
        method: Method,
        x: &[f64],
        at: &Triangle,
        scale: &[f64],
    ) -> Result<Taken, Stop> {
        match method {
            Method::Gradient => {
                // J' in the coordinates, back in x: scale^2 J'. The minimum of the linearised model along it.
                let along: Vec<f64> = scale
                    .iter()
                    .enumerate()
                    .map(|(i, s)| s * s * at.descent(i))
                    .collect();
                let slope: f64 = along
                    .iter()
                    .enumerate()
                    .map(|(i, d)| d * at.descent(i))
                    .sum();
                let curvature = at.squared_length(&along);
                if curvature.is_nan() || curvature <= 0.0 {
                    return Err(Stop::Rounding);
                }
                let rho = slope / curvature;
                let step: Vec<f64> = along.iter().map(|d| rho * d).collect();
                self.shortened(problem, x, at, step)
            }
            Method::GaussNewton => {
                if !at.determined() {
                    return Err(Stop::Singular);
                }
                self.shortened(problem, x, at, at.solve(problem.free(), &[], 0.0))
            }
            Method::LevenbergMarquardt { damping, .. } => {
                self.damped(problem, x, at, scale, damping)
            }
        }
    }

    /// Halves a step until J falls.
    fn shortened(
        &mut self,
        problem: &Problem,
        x: &[f64],
        at: &Triangle,
        mut step: Vec<f64>,
    ) -> Result<Taken, Stop> {
        let mut unstable = false;
        for _ in 0..60 {
            match self.try_step(problem, x, at, &step) {
                Tried::Lower(next) => return Ok((step, next)),
                Tried::Level => return Err(Stop::Rounding),
                Tried::Higher => unstable = false,
                Tried::Unstable => unstable = true,
            }
            step.iter_mut().for_each(|d| *d *= 0.5);
        }
        Err(if unstable {
            Stop::StabilityBorder
        } else {
            Stop::NoProgress
        })
    }

    /// Raises mu until J falls.
    fn damped(
        &mut self,
        problem: &Problem,
        x: &[f64],
        at: &Triangle,
        scale: &[f64],
        damping: Damping,
    ) -> Result<Taken, Stop> {
        // J'' = 2 R'R: halved, both.
        let (scale, part): (Vec<f64>, f64) = match damping {
            Damping::Identity => (scale.iter().map(|s| 1.0 / s).collect(), 0.5),
            Damping::Diagonal => ((0..x.len()).map(|i| at.column_norm(i)).collect(), 1.0),
        };
        let mut unstable = false;
        for _ in 0..40 {
            let step = at.solve(problem.free(), &scale, part * self.mu);
            match self.try_step(problem, x, at, &step) {
                Tried::Lower(next) => {
                    self.mu = (0.1 * self.mu).max(1e-20);
                    return Ok((step, next));
                }
                Tried::Level => return Err(Stop::Rounding),
                Tried::Higher => unstable = false,
                Tried::Unstable => unstable = true,
            }
            self.mu *= 10.0;
        }
        Err(if unstable {
            Stop::StabilityBorder
        } else {
            Stop::NoProgress
        })
    }

    fn try_step(&mut self, problem: &Problem, x: &[f64], at: &Triangle, step: &[f64]) -> Tried {
        let to: Vec<f64> = x.iter().zip(step).map(|(x, d)| x + d).collect();
        // The last step needs no derivatives.
        let last = problem.is_small(x, step, at, self.tolerance);
        match problem.evaluate(&to, at.cost(), !last) {
            Ok(next) if next.cost() < at.cost() => {
                self.evaluations += 1;
                Tried::Lower(next)
            }
            Ok(_) | Err(Undefined::Higher) => {
                self.evaluations += 1;
                // Reduction of J that the linearised model predicts.
                let slope: f64 = step
                    .iter()
                    .enumerate()
                    .map(|(i, d)| d * at.descent(i))
                    .sum();
                let predicted = 2.0 * slope - at.squared_length(step);
                if predicted <= 1e-13 * at.cost() && at_minimum(at, AT_ROUNDING) {
                    Tried::Level
                } else {
                    Tried::Higher
                }
            }
            Err(Undefined::Unstable) => {
                self.refused += 1;
                Tried::Unstable
            }
            Err(Undefined::NotFinite) => Tried::Higher,
        }
    }
}
