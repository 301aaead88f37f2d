//! The methods for a loop: regressions, and closed-loop output error, batch and recursive. Without a controller they identify in open loop.

mod batch;
mod levels;
mod recursion;
mod regression;

use ct_signals::Record;
use fcloe::{
    ClosedLoop, Condition, Controller, LoopHealth, LoopRecord, LoopSimulator, Mismatch, NoisePath,
    Offsets, Orders, PlantModel, Problem, Stop,
};

use missing_effect::Parameter;
use serde::Serialize;

use crate::{
    Error, Identification, Method, Order, Request, Shown, Trajectory, Warning,
    checks::positive,
    parameters::{names, plant, poles},
    residual::{deviation, errors, rms},
    warning::{doubtful, too_fast},
};
pub use levels::LevelChoice;

/// Number of points of the plot of condition (14).
const POINTS: usize = 240;
/// A controller whose output differs from the command by more than this share causes a warning.
const MISSED: f64 = 0.03;
/// A command at its limits in more than this share of the rows causes a warning.
const LIMITED: f64 = 0.01;

/// A simulation error below this share of the output's standard deviation is not compared.
const SURELY_GOOD: f64 = 0.02;
/// If the recursion's final model has a simulation error above the batch fit's times this factor, the final model is not the plant of the
/// record.
const MUCH_WORSE: f64 = 1.5;

/// Results of a method for a loop, in addition to the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InLoop {
    /// R of the controller from the constant on, in s; empty in open loop.
    pub r: Vec<f64>,
    /// S of the controller.
    pub s: Vec<f64>,
    /// Source of the zero of the signals.
    pub levels_from: LevelChoice,
    /// The levels: of the reference (of the input in open loop), and of the output.
    pub levels: [f64; 2],
    /// Difference between the controller's output and the measured command, if it is measured.
    pub mismatch: Option<Mismatch>,
    /// Start of the fit or the recursion.
    pub start: Start,
    /// Result of a batch fit.
    pub batch: Option<Batch>,
    /// Memory of a recursion, `1/eta`, s.
    pub memory: Option<f64>,
    /// State of a recursion at its end.
    pub health: Option<LoopHealth>,
    /// Condition (14) of a recursion with the filter of the start, if the estimates are the true plant; none if this is doubtful.
    pub convergence: Option<Convergence>,
}

/// Start of an estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Start {
    /// Source of the start.
    pub from: &'static str,
    /// Bandwidth of the filter that it began with, 1/s.
    pub bandwidth: f64,
    /// a_1 to a_n, b_0 to b_m.
    pub theta: Vec<f64>,
}

/// End of a batch fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// Why.
    pub stop: Stop,
    /// Steps.
    pub iterations: usize,
    /// Starts that were tried.
    pub starts: usize,
    /// Point where the noise enters, according to the residual.
    pub noise: NoisePath,
    /// Standard errors for a residual that is white, for comparison.
    pub white_std_errors: Vec<f64>,
}

/// Convergence condition (14), with P^ of the initial model and P of the estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// The answer.
    #[serde(flatten)]
    pub condition: Condition,
    /// `P^/P - 1/2`: frequency in rad/s, real and imaginary part.
    pub locus: Vec<(f64, f64, f64)>,
}

/// A record, its loop, and the request.
struct Task<'a> {
    record: &'a Record,
    request: &'a Request,
    controller: Controller,
    orders: Orders,
}

/// Result of a method.
struct Found {
    plant: PlantModel,
    std_errors: Vec<Option<f64>>,
    record: LoopRecord,
    levels: [f64; 2],
    levels_from: LevelChoice,
    start: Start,
    batch: Option<Batch>,
    recursion: Option<Run>,
    warnings: Vec<Warning>,
}

/// Result of a recursion.
struct Run {
    trajectory: Trajectory,
    health: LoopHealth,
    memory: f64,
}

/// Identifies. Errors: those of [`crate::identify()`] and of `fcloe`.
pub(super) fn identify(record: &Record, request: &Request) -> Result<Identification, Error> {
    positive("memory", "s", request.memory)?;
    positive("bandwidth", "1/s", request.bandwidth)?;
    let Order { n, m } = request.order;
    let task = Task {
        record,
        request,
        controller: request.controller.clone().unwrap_or_else(Controller::none),
        orders: Orders { n, m },
    };
    task.identify().map_err(|error| task.named(error))
}

impl Task<'_> {
    fn identify(&self) -> Result<Identification, Error> {
        // The checks are the same for all methods.
        let centred = self.centred(self.offsets_at_rest()?)?;
        let problem = Problem::new(
            std::slice::from_ref(&centred),
            &self.controller,
            self.orders,
        )?;
        let mismatch = problem.mismatches().first().copied().flatten();
        let found = match self.request.method {
            Method::Ls => self.regression(centred, false)?,
            Method::Iv => self.regression(centred, true)?,
            Method::RecursiveFcloe => self.recursion(centred)?,
            _ => self.batch(centred)?,
        };
        self.result(found, mismatch)
    }

    fn centred(&self, offsets: Offsets) -> Result<LoopRecord, Error> {
        Ok(LoopRecord::from_record(self.record, offsets)?)
    }

    /// Simulation of the loop with a plant.
    fn simulated(
        &self,
        record: &LoopRecord,
        plant: &PlantModel,
        [level, y_level]: [f64; 2],
    ) -> Result<Vec<f64>, Error> {
        ClosedLoop::new(plant, &self.controller)?.require_stable()?;
        let (drive, hold) = record.drive(&self.controller)?;
        let drive: Vec<f64> = drive.iter().map(|v| v - level).collect();
        let mut model = LoopSimulator::new(plant, &self.controller, hold, record.step)?;
        let (y, _) = model.outputs_and_inputs(&drive);
        Ok(y.iter().map(|y| y + y_level).collect())
    }

    fn result(&self, found: Found, mismatch: Option<Mismatch>) -> Result<Identification, Error> {
        let (record, order) = (self.record, self.request.order);
        let simulated = self.simulated(&found.record, &found.plant, found.levels)?;
        let named = names(order, record).into_iter().zip(found.plant.theta());
        let parameters: Vec<Parameter> = named
            .zip(&found.std_errors)
            .map(|(((name, unit), value), std_error)| Parameter {
                prior: None,
                name,
                unit,
                value: *value,
                std_error: *std_error,
            })
            .collect();
        let plant = plant(&parameters, order);
        let (time_constants, oscillations) = poles(&plant.a)?;
        let output = &record.outputs[0];
        let rmse = rms(errors(output, &simulated));
        let deviation = deviation(output);
        let mut warnings = found.warnings;
        if self.request.levels == LevelChoice::Auto && found.levels_from == LevelChoice::Mean {
            warnings.push(Warning::MeanLevels);
        }
        warnings.extend(mismatch.and_then(|mismatch| missed(&mismatch)));
        warnings.extend(limited(record, self.request.limits));
        warnings.extend(doubtful(&parameters, order));
        warnings.extend(too_fast(&time_constants, record, order));
        let doubt = found
            .recursion
            .as_ref()
            .and_then(|run| self.astray(&run.health, rmse, deviation, &record.outputs[0].unit));
        let convergence = match self.request.method {
            Method::Ls | Method::Iv => None,
            _ if doubt.is_some() => None,
            _ => Some(self.convergence(&found.start, &found.plant)?),
        };
        warnings.extend(doubt);
        let memory = found.recursion.as_ref().map(|run| run.memory);
        let recursion = found.recursion.map(|run| (run.trajectory, run.health));
        let (trajectory, health) = recursion.unzip();
        let of = |polynomial: &ct_lti::Polynomial| polynomial.coefficients().to_vec();
        Ok(Identification {
            schema: 2,
            method: self.request.method,
            order,
            record: record.name.clone(),
            settings: None,
            parameters,
            time_constants,
            oscillations,
            simulation_rmse: rmse,
            fit_percent: 100.0 * (1.0 - rmse / deviation),
            warnings,
            trajectory,
            in_loop: Some(InLoop {
                r: of(self.controller.r()),
                s: of(self.controller.s()),
                levels_from: found.levels_from,
                levels: found.levels,
                mismatch,
                start: found.start,
                batch: found.batch,
                memory,
                health,
                convergence,
            }),
            refined: None,
            gaps: None,
            drift: None,
            plant,
            shown: Shown {
                time: record.time.clone(),
                input: record.inputs[0].clone(),
                output: record.outputs[0].clone(),
                simulated,
            },
        })
    }

    /// Reason why the end of a recursion is not reliable, if there is one: its loop was nearly unstable, or one model for the whole record
    /// has a much smaller simulation error.
    fn astray(
        &self,
        health: &LoopHealth,
        rmse: f64,
        deviation: f64,
        unit: &str,
    ) -> Option<Warning> {
        if health.refused > 0 {
            return Some(Warning::StepsRefused {
                steps: health.refused,
            });
        }
        if rmse <= SURELY_GOOD * deviation {
            return None;
        }
        let centred = self.centred(self.offsets_at_rest().ok()?).ok()?;
        let batch = self.batch(centred).ok()?;
        let simulated = self
            .simulated(&batch.record, &batch.plant, batch.levels)
            .ok()?;
        let best = rms(errors(&self.record.outputs[0], &simulated));
        (rmse > MUCH_WORSE * best).then(|| Warning::BatchBetter {
            batch_rmse: best,
            rmse,
            unit: unit.to_owned(),
        })
    }

    /// Condition (14) of a recursion with the filter of the start, if the final estimates are the true plant.
    fn convergence(&self, start: &Start, end: &PlantModel) -> Result<Convergence, Error> {
        let start = PlantModel::from_theta(self.orders, &start.theta)?;
        let of = |plant| ClosedLoop::new(plant, &self.controller);
        let (filter, truth) = (of(&start)?, of(end)?);
        let (filter, truth) = (filter.characteristic(), truth.characteristic());
        Ok(Convergence {
            condition: Condition::new(filter, truth)?,
            locus: fcloe::locus(filter, truth, POINTS)?,
        })
    }

    /// Adds the record's name to an error of the crate, which does not always know the name.
    fn named(&self, error: Error) -> Error {
        match error {
            Error::Loop(fcloe::Error::ControllerMismatch { mismatch, size, .. }) => {
                Error::ControllerMismatch {
                    record: self.record.name.clone(),
                    mismatch,
                    size,
                    unit: self.record.inputs[0].unit.clone(),
                }
            }
            Error::Loop(fcloe::Error::Gaps {
                missing,
                left,
                rows,
                ..
            }) => Error::MissingReadings {
                record: self.record.name.clone(),
                output: self.record.outputs[0].name.clone(),
                missing,
                left,
                rows,
                method: self.request.method,
            },
            Error::Loop(what) => {
                let what = what.to_string();
                let name = format!("{}: ", self.record.name);
                Error::InRecord {
                    record: self.record.name.clone(),
                    what: what.strip_prefix(&name).unwrap_or(&what).to_owned(),
                }
            }
            other => other,
        }
    }
}

/// Warning about a small difference between controller and command.
fn missed(mismatch: &Mismatch) -> Option<Warning> {
    let share = mismatch.systematic / mismatch.size;
    (share > MISSED).then_some(Warning::ControllerMismatch { share })
}

/// The command is at its limits, where the loop is not linear.
fn limited(record: &Record, (low, high): (f64, f64)) -> Option<Warning> {
    let values = &record.inputs[0].values;
    let at = values.iter().filter(|u| **u <= low || **u >= high).count();
    let share = at as f64 / values.len().max(1) as f64;
    (share > LIMITED).then_some(Warning::CommandAtLimits { low, high, share })
}
