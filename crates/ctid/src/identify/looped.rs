//! The methods that have to do with a loop: regressions, and closed-loop output error, batch and recursive. Without a controller they
//! identify in open loop.

use ct_rls::RecursiveEstimator;
use ct_signals::Record;
use fcloe::start::{self, PipelineSettings, Stage};
use fcloe::{
    ClosedLoop, Condition, Controller, LoopHealth, LoopRecord, LoopSample, LoopSimulator, Mismatch,
    NoisePath, Offsets, OperatingPoint, Orders, PlantModel, Problem, RecursiveFcloe,
    RecursiveSettings, Stop,
};
use missing_effect::Parameter;
use serde::Serialize;

use super::{Identification, Method, Order, Request, Shown, Trajectory, names, poles, rms};
use crate::Error;

/// A loop rests in the first rows if there are so many in which the drive stands still, and the output's means over their two halves
/// are no further apart than this share of its range.
const ROWS_AT_REST: usize = 6;
const MOVES: f64 = 0.03;
/// The part of the record that a recursion is started from.
const BEGINNING: f64 = 0.3;
/// Renewals of instruments with a filter that stays, and of both.
const INSTRUMENTS: usize = 3;
const REFINEMENTS: usize = 10;
/// Points of the picture of condition (14).
const POINTS: usize = 240;
/// A controller that misses more than this share of the command is said.
const MISSED: f64 = 0.03;
/// A command at its limits for more than this share of the rows is said.
const LIMITED: f64 = 0.01;

/// Where zero of reference, input and output is. The loop has to rest there when the record begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LevelChoice {
    /// Estimated by fcloe; else the rows before the reference moves first, or the means
    #[default]
    Auto,
    /// Estimated with the parameters, by fcloe alone
    Estimated,
    /// Means of the first rows, in which the reference stands still
    Rest,
    /// Means of the record
    Mean,
    /// The signals are deviations already
    Zero,
}

/// What a method that has to do with the loop says besides the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InLoop {
    /// R of the controller from the constant on, in s; empty in open loop.
    pub r: Vec<f64>,
    /// S of the controller.
    pub s: Vec<f64>,
    /// What the zero of the signals was taken from.
    pub levels_from: LevelChoice,
    /// The levels: of the reference (of the input in open loop), and of the output.
    pub levels: [f64; 2],
    /// How far the controller is from the command that was measured, if it is.
    pub mismatch: Option<Mismatch>,
    /// Where the fit or the recursion began.
    pub start: Start,
    /// Of a batch fit.
    pub batch: Option<Batch>,
    /// Of a recursion, at its end.
    pub health: Option<LoopHealth>,
    /// Condition (14) of a recursion with the filter of the start.
    pub convergence: Option<Convergence>,
}

/// Where an estimate began.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Start {
    /// What gave it.
    pub from: &'static str,
    /// Bandwidth of the filter that it began with, 1/s.
    pub bandwidth: f64,
    /// a_1 to a_n, b_0 to b_m.
    pub theta: Vec<f64>,
}

/// How a batch fit ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// Why.
    pub stop: Stop,
    /// Steps.
    pub iterations: usize,
    /// Starts that were tried.
    pub starts: usize,
    /// Where the noise enters, as the residual tells.
    pub noise: NoisePath,
    /// Standard errors for a residual that is white, for comparison.
    pub white_std_errors: Vec<f64>,
}

/// Condition (14) between P^ of a start and P of an end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// The answer.
    #[serde(flatten)]
    pub condition: Condition,
    /// `P^/P - 1/2`: frequency in rad/s, real and imaginary part.
    pub locus: Vec<(f64, f64, f64)>,
}

/// A record, its loop, and what is asked.
struct Task<'a> {
    record: &'a Record,
    request: &'a Request,
    controller: Controller,
    orders: Orders,
}

/// What a method gives.
struct Found {
    plant: PlantModel,
    std_errors: Vec<Option<f64>>,
    record: LoopRecord,
    levels: [f64; 2],
    levels_from: LevelChoice,
    start: Start,
    batch: Option<Batch>,
    recursion: Option<(Trajectory, LoopHealth)>,
    warnings: Vec<String>,
}

/// Identifies; everything that [`super::identify`] refuses, and what `fcloe` refuses.
pub(super) fn identify(record: &Record, request: &Request) -> Result<Identification, Error> {
    super::positive("--memory", "s", request.memory)?;
    super::positive("--bandwidth", "1/s", request.bandwidth)?;
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
        // What is refused is the same for all methods.
        let centred = self.centred(self.offsets_at_rest()?)?;
        let problem = Problem::new(&[centred.clone()], &self.controller, self.orders)?;
        let mismatch = problem.mismatches().first().copied().flatten();
        let found = match self.request.method {
            Method::Ls => self.regression(centred, false)?,
            Method::Iv => self.regression(centred, true)?,
            Method::RecursiveFcloe => self.recursion(centred)?,
            _ => self.batch(centred)?,
        };
        self.result(found, mismatch)
    }

    /// The whole record's fit, from the best few starts.
    fn batch(&self, centred: LoopRecord) -> Result<Found, Error> {
        let choice = self.request.levels;
        let free = matches!(choice, LevelChoice::Auto | LevelChoice::Estimated);
        let offsets = if free {
            Offsets::Estimated
        } else {
            centred.offsets
        };
        let record = LoopRecord {
            offsets,
            ..centred.clone()
        };
        let problem = Problem::new(&[record.clone()], &self.controller, self.orders)?;
        let candidates = self.pipeline(&centred)?;
        let starts = candidates.len();
        let mut best: Option<(fcloe::Fit, start::Candidate)> = None;
        let mut last = None;
        for candidate in candidates {
            match problem.fit(&candidate.plant, &fcloe::Settings::default()) {
                Ok(fit) if best.as_ref().is_none_or(|(best, _)| fit.cost < best.cost) => {
                    best = Some((fit, candidate));
                }
                Ok(_) => {}
                Err(error) => last = Some(error),
            }
        }
        let (fit, candidate) = match (best, last) {
            (Some(best), _) => best,
            (None, Some(error)) => return Err(error.into()),
            (None, None) => return Err(fcloe::Error::NoStart { tried: starts }.into()),
        };
        let uncertainty = problem.uncertainty(&fit, None)?;
        let mut warnings = Vec::new();
        if !fit.stop.was_successful() {
            warnings.push(stopped(fit.stop).to_owned());
        }
        let levels = fit.levels.first().map_or([f64::NAN; 2], |l| [l.drive, l.y]);
        Ok(Found {
            std_errors: uncertainty.std_errors.iter().map(|e| Some(*e)).collect(),
            start: Start {
                from: name(candidate.stage),
                bandwidth: candidate.lambda,
                theta: candidate.plant.theta().to_vec(),
            },
            batch: Some(Batch {
                stop: fit.stop,
                iterations: fit.iterations,
                starts,
                noise: uncertainty.noise.path,
                white_std_errors: uncertainty.white_std_errors,
            }),
            plant: fit.plant,
            recursion: None,
            levels_from: chosen(&record),
            record,
            levels,
            warnings,
        })
    }

    fn pipeline(&self, record: &LoopRecord) -> Result<Vec<start::Candidate>, Error> {
        let settings = PipelineSettings {
            lambdas: self.request.bandwidth.into_iter().collect(),
            ..PipelineSettings::default()
        };
        let records = std::slice::from_ref(record);
        Ok(start::pipeline(
            records,
            &self.controller,
            self.orders,
            &settings,
        )?)
    }

    /// The regression whose loop gives the record best, over the bandwidths.
    fn regression(&self, record: LoopRecord, with_instruments: bool) -> Result<Found, Error> {
        let records = std::slice::from_ref(&record);
        let lambdas = match self.request.bandwidth {
            Some(lambda) => vec![lambda],
            None => start::lambda_ladder(records, &self.controller, None)?,
        };
        let mut best: Option<(f64, PlantModel, Start)> = None;
        for &lambda in &lambdas {
            let filter = ct_lti::Polynomial::new([lambda, 1.0])?.pow(self.orders.n);
            let least_squares =
                start::least_squares(records, &self.controller, self.orders, &filter);
            let Ok(mut plant) = least_squares else {
                continue;
            };
            let mut stage = Stage::LeastSquares;
            if with_instruments {
                let Ok((better, its)) = self.instruments(records, &filter, &plant) else {
                    continue;
                };
                (plant, stage) = (better, its);
            }
            let Ok(simulated) = self.simulated(&record, &plant, levels_of(&record, self)) else {
                continue;
            };
            let error = rms(record.y.iter().zip(&simulated).map(|(y, model)| y - model));
            if error.is_finite() && best.as_ref().is_none_or(|(least, ..)| error < *least) {
                let start = Start {
                    from: name(stage),
                    bandwidth: lambda,
                    theta: plant.theta().to_vec(),
                };
                best = Some((error, plant, start));
            }
        }
        let tried = lambdas.len();
        let (_, plant, start) = best.ok_or(fcloe::Error::NoStart { tried })?;
        Ok(Found {
            std_errors: vec![None; plant.theta().len()],
            levels: levels_of(&record, self),
            levels_from: chosen(&record),
            plant,
            start,
            batch: None,
            recursion: None,
            record,
            warnings: vec![
                "a regression gives no standard errors here: --method fcloe starts from it and does".to_owned(),
            ],
        })
    }

    /// Instruments with the filter that stays, then with one that is renewed.
    fn instruments(
        &self,
        records: &[LoopRecord],
        filter: &ct_lti::Polynomial,
        first: &PlantModel,
    ) -> Result<(PlantModel, Stage), Error> {
        let mut plant = first.clone();
        for _ in 0..INSTRUMENTS {
            plant = start::instruments(records, &self.controller, filter, &plant)?;
        }
        let refined = start::refine(records, &self.controller, &plant, REFINEMENTS)?;
        Ok(if refined.rests {
            (refined.plant, Stage::Refined)
        } else {
            (plant, Stage::Instruments)
        })
    }

    /// Sample by sample, from what the beginning of the record gives.
    fn recursion(&self, record: LoopRecord) -> Result<Found, Error> {
        let rows = ((BEGINNING * record.len() as f64) as usize).max(1);
        let part =
            |signal: &Option<Vec<f64>>| signal.as_ref().map(|v| v[..rows.min(v.len())].to_vec());
        let beginning = LoopRecord {
            r: part(&record.r),
            u: part(&record.u),
            y: record.y[..rows.min(record.len())].to_vec(),
            ..record.clone()
        };
        let mut warnings = Vec::new();
        let begun = Problem::new(&[beginning.clone()], &self.controller, self.orders)
            .map_err(Error::from)
            .and_then(|_| self.begun(beginning));
        let begun = match begun {
            Ok(begun) => begun,
            Err(_) => {
                warnings.push(
                    "the first rows do not tell a start: it was taken from the whole record, so the recursion knows what it has not seen yet"
                        .to_owned(),
                );
                self.begun(record.clone())?
            }
        };
        let [drive_level, y_level] = begun.levels;
        let point = OperatingPoint {
            r: drive_level,
            u: drive_level,
            y: y_level,
        };
        let record = LoopRecord {
            offsets: Offsets::Known(point),
            ..record
        };
        let start = begun.plant;
        let settings = self.recursive_settings(&record, &start, point)?;
        let mut estimator = RecursiveFcloe::new(&start, &self.controller, settings)?;
        let parameters = start.theta().len();
        let mut trajectory = Trajectory {
            time: Vec::with_capacity(record.len()),
            samples: Vec::with_capacity(record.len()),
            values: vec![Vec::with_capacity(record.len()); parameters],
            std_errors: vec![Vec::with_capacity(record.len()); parameters],
        };
        let (drive, _) = record.drive(&self.controller)?;
        for (k, (&drive, &y)) in drive.iter().zip(&record.y).enumerate() {
            estimator.update(&LoopSample { drive, y }, record.step);
            trajectory.time.push(self.record.time[k]);
            trajectory.samples.push(k);
            let (covariance, rms) = (estimator.covariance(), estimator.residual_rms());
            for (i, theta) in estimator.theta().iter().enumerate() {
                trajectory.values[i].push(*theta);
                trajectory.std_errors[i].push(covariance[(i, i)].max(0.0).sqrt() * rms);
            }
        }
        let last = |errors: &Vec<f64>| errors.last().copied().filter(|e| e.is_finite());
        Ok(Found {
            plant: estimator.plant()?,
            std_errors: trajectory.std_errors.iter().map(last).collect(),
            levels: begun.levels,
            levels_from: begun.levels_from,
            start: Start {
                theta: start.theta().to_vec(),
                ..begun.start
            },
            batch: None,
            recursion: Some((trajectory, estimator.loop_health()?)),
            record,
            warnings,
        })
    }

    /// What a recursion starts from: the batch fit where it has to find the levels too, else the best regression.
    fn begun(&self, record: LoopRecord) -> Result<Found, Error> {
        if record.offsets == Offsets::Means && self.request.levels == LevelChoice::Auto {
            let mut found = self.batch(record)?;
            found.start.from = "output error of the first rows";
            return Ok(found);
        }
        self.regression(record, true)
    }

    /// Those of `fcloe`, for the amplitude and the speed of this loop.
    fn recursive_settings(
        &self,
        record: &LoopRecord,
        start: &PlantModel,
        point: OperatingPoint,
    ) -> Result<RecursiveSettings, Error> {
        let (drive, _) = record.drive(&self.controller)?;
        let mean = drive.iter().sum::<f64>() / drive.len().max(1) as f64;
        let power = rms(drive.iter().map(|v| v - mean)).powi(2);
        let closed = ClosedLoop::new(start, &self.controller)?;
        let p = closed.characteristic();
        let degree = p.degree().unwrap_or(1).max(1) as f64;
        let pole = (p.coefficient(0) / p.leading()).abs().powf(1.0 / degree);
        // They were tried on a loop with poles about 0.01 rad/s.
        let speed = pole / 0.01;
        let first_order = self.orders.n == 1;
        let (gain, factor, fading, step_limit) = if first_order {
            (10.0, 0.98_f64, 300.0, 0.05)
        } else {
            (1.0, 0.995, 1000.0, 0.02)
        };
        let (forgetting, fading) = match self.request.memory {
            Some(memory) => (1.0 / memory, f64::INFINITY),
            None => (-factor.ln() * speed, fading / speed),
        };
        Ok(RecursiveSettings {
            operating_point: point,
            ..RecursiveSettings::new(gain / power, forgetting, fading, step_limit)
        })
    }

    fn centred(&self, offsets: Offsets) -> Result<LoopRecord, Error> {
        Ok(LoopRecord::from_record(self.record, offsets)?)
    }

    /// Where zero is for what cannot estimate it.
    fn offsets_at_rest(&self) -> Result<Offsets, Error> {
        let zero = self.centred(Offsets::Deviations)?;
        let (drive, _) = zero.drive(&self.controller)?;
        let still = drive
            .iter()
            .take_while(|v| Some(*v) == drive.first())
            .count();
        Ok(match self.request.levels {
            LevelChoice::Zero => Offsets::Deviations,
            LevelChoice::Mean => Offsets::Means,
            LevelChoice::Rest => Offsets::FirstRows(still),
            LevelChoice::Estimated if self.request.method != Method::Fcloe => {
                return Err(Error::Usage(format!(
                    "--levels estimated is of --method fcloe; {} takes them from the record: rest, mean or zero",
                    self.request.method.id()
                )));
            }
            _ if rests(&zero.y, still) => Offsets::FirstRows(still),
            _ => Offsets::Means,
        })
    }

    /// What the loop does with a plant in it.
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
                name,
                unit,
                value: *value,
                std_error: *std_error,
            })
            .collect();
        let (time_constants, oscillations) = poles(&parameters, order)?;
        let output = &record.output.values;
        let rmse = rms(output.iter().zip(&simulated).map(|(y, model)| y - model));
        let mean = output.iter().sum::<f64>() / output.len().max(1) as f64;
        let deviation = rms(output.iter().map(|y| y - mean));
        let mut warnings = found.warnings;
        if self.request.levels == LevelChoice::Auto && found.levels_from == LevelChoice::Mean {
            warnings.push(
                "the record does not begin at rest: its means were taken for the levels, which biases the estimates; --method fcloe estimates the levels, --levels says them"
                    .to_owned(),
            );
        }
        warnings.extend(mismatch.and_then(|mismatch| missed(&mismatch)));
        warnings.extend(limited(record, self.request.limits));
        warnings.extend(super::doubtful(&parameters, order));
        warnings.extend(super::too_fast(&time_constants, record, order));
        let convergence = match self.request.method {
            Method::Ls | Method::Iv => None,
            _ => Some(self.convergence(&found.start, &found.plant)?),
        };
        let (trajectory, health) = found.recursion.unzip();
        let of = |polynomial: &ct_lti::Polynomial| polynomial.coefficients().to_vec();
        Ok(Identification {
            schema: 1,
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
                health,
                convergence,
            }),
            drift: None,
            shown: Shown {
                time: record.time.clone(),
                input: record.input.clone(),
                output: record.output.clone(),
                simulated,
            },
        })
    }

    /// Condition (14) of a recursion with the filter of the start, if the end is the truth.
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

    /// The record's name before what the crate says, which does not always know it.
    fn named(&self, error: Error) -> Error {
        match error {
            Error::Loop(what) => {
                let what = what.to_string();
                let name = format!("{}: ", self.record.name);
                Error::File {
                    file: self.record.name.clone(),
                    what: what.strip_prefix(&name).unwrap_or(&what).to_owned(),
                }
            }
            other => other,
        }
    }
}

/// Whether the output stands still too while the drive does.
fn rests(y: &[f64], still: usize) -> bool {
    let (first, second) = y[..still].split_at(still / 2);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (low, high) = crate::plot::limits([y]);
    still >= ROWS_AT_REST
        && still < y.len()
        && (mean(second) - mean(first)).abs() <= MOVES * (high - low)
}

/// The levels of drive and output that are subtracted.
fn levels_of(record: &LoopRecord, task: &Task) -> [f64; 2] {
    let point = record.operating_point();
    if task.controller.is_open_loop() {
        [point.u, point.y]
    } else {
        [point.r, point.y]
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::LeastSquares => "least squares",
        Stage::Instruments => "instruments",
        Stage::Refined => "instruments, filter renewed",
        Stage::Guess => "a guess",
    }
}

/// Where the levels of a record come from.
fn chosen(record: &LoopRecord) -> LevelChoice {
    match record.offsets {
        Offsets::Estimated => LevelChoice::Estimated,
        Offsets::FirstRows(_) => LevelChoice::Rest,
        Offsets::Means => LevelChoice::Mean,
        _ => LevelChoice::Zero,
    }
}

/// Why a fit is not to be trusted.
fn stopped(stop: Stop) -> &'static str {
    match stop {
        Stop::StabilityBorder => {
            "the fit ended where the loop would become unstable: the data ask for a plant that this controller does not stabilise; check the controller, or the orders"
        }
        Stop::Iterations => "the fit ran out of iterations: try a lower --order",
        _ => "the fit did not come to a minimum: try a lower --order",
    }
}

/// The controller is a little off.
fn missed(mismatch: &Mismatch) -> Option<String> {
    let share = mismatch.systematic / mismatch.size;
    (share > MISSED).then(|| {
        format!(
            "the controller misses {:.0} % of what the measured command does with the reference: its errors go straight into the estimates; check gain and integral_time",
            100.0 * share
        )
    })
}

/// The command stands at its limits, where the loop is not linear.
fn limited(record: &Record, (low, high): (f64, f64)) -> Option<String> {
    let values = &record.input.values;
    let at = values.iter().filter(|u| **u <= low || **u >= high).count();
    let share = at as f64 / values.len().max(1) as f64;
    (share > LIMITED).then(|| {
        format!(
            "the command is at its limits of {low} and {high} in {:.0} % of the rows: there the loop is not linear, and the estimates are biased",
            100.0 * share
        )
    })
}
