//! Simulation of plant and controller in a loop, from the reference.
//!
//! **Model**: `y = P u + v`, `u = C (r - y) + d`, with the limits of the controller; `v` is any disturbance, `d` a known
//! signal that was added to the command: the measured command less the output of the controller for the measured reading. The loop is
//! simulated from `r` and `d` only, `ym = P um`, `um = C (r - ym) + d`, so that neither the model's output nor its derivatives contain noise
//! that is fed back through `u`. At the true parameters
//! ```text
//! y - ym = v / (1 + P C),   v = (1 + P C) (y - ym)
//! ```
//! Integral action in `C` removes the slow part of `y - ym`, and with it the information on static parameters. So the action of the loop is
//! removed: with `P0` the plant linearised once at a first fit, `y - ym + P0 (um - u)` at every output is `v` itself, also when limits act;
//! the noise model is fitted to it. Without limits it equals `y - ym` filtered by `1 + P0 C`. The derivatives are filtered in the same way
//! and contain no noise, so the estimate is an instrumental-variable estimate: unbiased for any spectrum of `v` and any `P0`, which affects
//! the variance only. The determinant of the map from `y` to `v` is one, so likelihoods can be compared.
//!
//! **Assumptions**: `y[k]` is read before `u[k]` acts; the command is held; the reference is not constant; `r` is independent of
//! `v`.
//!
//! **Cost**: one step of the controller for every simulated sample, `O((p + 1) n^2)` for the filter of a row.
//!
//! **References**: I. D. Landau, A. Karimi, Recursive algorithms for identification in closed loop, Automatica 33 (1997)
//! 1499-1523; M. Gilson, P. Van den Hof, Instrumental variable methods for closed-loop system identification, Automatica
//! 41 (2005) 241-249; U. Forssell, L. Ljung, Closed-loop identification revisited, Automatica 35 (1999) 1215-1241.

use std::sync::Arc;

use ct_signals::{Hold, Record};
use plants::controller::{Controller, MAX_CONTROLLER_STATES};
use plants::{Command, Dual, MAX_VESSELS, Scalar, Simulator, Structure};

use estimation::Triangle;

use crate::Error;

/// The controller simulated on the measured signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// The controller's states when the record begins, those that fit the measured command best.
    pub states: Vec<f64>,
    /// The measured command less the controller's \[input unit\].
    pub beside: Vec<f64>,
    /// Root mean square of the additional input \[input unit\].
    pub rms: f64,
    /// Standard deviation of the measured command \[input unit\].
    pub moves: f64,
}

/// Rounds of the fit of initial states: without limits the first one is exact.
const ROUNDS: usize = 6;

/// Runs a controller on the measured reference and reading of a record, and compares the measured command with its own.
///
/// # Errors
/// Where the record has no reference, or its command is not held.
pub fn replay(controller: &Controller, record: &Record) -> Result<Replay, Error> {
    let Some(reference) = record.references.first() else {
        return Err(Error::NoReference {
            record: record.name.clone(),
        });
    };
    if record.hold() != Hold::Zero {
        return Err(Error::CommandNotHeld {
            record: record.name.clone(),
        });
    }
    record.validate()?;
    // The controller used readings that the record lacks; they are interpolated linearly.
    let Some(read) = record.outputs.get(controller.output()) else {
        return Err(Error::Outputs {
            record: record.name.clone(),
            given: record.outputs.len(),
            needed: controller.output() + 1,
        });
    };
    let y = &read.interpolated();
    let (r, u) = (&reference.values, &record.inputs[0].values);
    let n = controller.states();
    let run = |states: &[f64]| {
        let duals: Vec<Dual<MAX_CONTROLLER_STATES>> = states
            .iter()
            .enumerate()
            .map(|(lane, value)| Dual::variable(*value, lane))
            .collect();
        let mut regulator = controller.start(&duals);
        let mut triangle = Triangle::new(n + 1);
        let mut row = vec![0.0; n + 1];
        let mut beside = Vec::with_capacity(r.len());
        for k in 0..r.len() {
            let given = regulator.command(r[k], Dual::constant(y[k]), step(record, k));
            row[..n].copy_from_slice(&given.eps[..n]);
            row[n] = u[k] - given.re;
            triangle.push(&row);
            beside.push(row[n]);
        }
        triangle.finish();
        let rms = (beside.iter().map(|d| d * d).sum::<f64>() / r.len().max(1) as f64).sqrt();
        (triangle, beside, rms)
    };
    let free: Vec<usize> = (0..n).collect();
    // Command at zero control error, for the state before saturation.
    let seen = controller.linear(1.0).c;
    let mut states: Vec<f64> = seen
        .iter()
        .map(|c| {
            c * (u[0] - controller.direct() * (r[0] - y[0])) / seen.iter().sum::<f64>().max(1.0)
        })
        .collect();
    let mut best = run(&states);
    for _ in 0..ROUNDS {
        let step = best.0.solve(&free, &[], 0.0);
        let moved: Vec<f64> = states.iter().zip(&step).map(|(x, d)| x + d).collect();
        let next = run(&moved);
        if next.2 >= best.2 || next.2.is_nan() {
            break;
        }
        (states, best) = (moved, next);
    }
    let mean = u.iter().sum::<f64>() / u.len() as f64;
    let moves = (u.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / u.len() as f64).sqrt();
    Ok(Replay {
        states,
        beside: best.1,
        rms: best.2,
        moves,
    })
}

/// The time from sample `k` to the next one, the last one as long as the one before.
pub(crate) fn step(record: &Record, k: usize) -> f64 {
    let k = k.min(record.len().saturating_sub(2));
    record
        .time
        .get(k + 1)
        .map_or(1.0, |next| next - record.time[k])
}

/// A plant linearised over one sampling interval: `x+ = A x + b u`; of two pumps `u` is the command to the first one.
///
/// What an effect adds as memory (dead time, lags) is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPlant {
    /// A, row by row.
    pub a: Vec<Vec<f64>>,
    /// b.
    pub b: Vec<f64>,
    /// Level of each output.
    pub outputs: Vec<usize>,
}

impl LinearPlant {
    /// At the operating levels of the structure's scales and a command.
    ///
    /// # Errors
    /// Where there are not as many parameters as the structure has.
    pub fn at(structure: &Structure, theta: &[f64], command: f64) -> Result<Self, Error> {
        const LANES: usize = MAX_VESSELS + 1;
        let n = structure.plant.vessels();
        let theta: Vec<Dual<LANES>> = theta.iter().map(|value| Dual::constant(*value)).collect();
        let levels: Vec<Dual<LANES>> = structure.scales.operating_level[..n]
            .iter()
            .enumerate()
            .map(|(i, value)| Dual::variable(*value, i))
            .collect();
        // The second pump at the middle of its range.
        let second = structure
            .scales
            .input_2
            .map_or(0.0, |(low, high)| 0.5 * (low + high));
        let mut simulator = Simulator::with_inputs(structure, &theta, &levels, [command, second])?;
        let interval = structure.scales.sample_interval;
        let moved = Dual::variable(command, n);
        simulator.advance_held(moved, Command::held(second), interval);
        let next = simulator.levels();
        Ok(Self {
            a: (0..n).map(|i| next[i].eps[..n].to_vec()).collect(),
            b: (0..n).map(|i| next[i].eps[n]).collect(),
            outputs: structure.scales.outputs.iter().map(|o| o.vessel).collect(),
        })
    }
}

/// A controller around the setup's plant.
#[derive(Debug, Clone)]
pub(crate) struct Feedback {
    pub controller: Controller,
    pub replays: Arc<Vec<Replay>>,
    /// The controller's initial states are fitted.
    pub released: bool,
    plant: Arc<LinearPlant>,
}

impl Feedback {
    pub(crate) fn new(
        controller: &Controller,
        records: &[Record],
        plant: LinearPlant,
    ) -> Result<Self, Error> {
        for record in records {
            if let Some(reference) = record.references.first() {
                let (low, high) = reference.range();
                if low >= high {
                    return Err(Error::ConstantReference {
                        record: record.name.clone(),
                        value: low,
                    });
                }
            }
        }
        let replays = records
            .iter()
            .map(|record| replay(controller, record))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            controller: controller.clone(),
            replays: Arc::new(replays),
            released: false,
            plant: Arc::new(plant),
        })
    }

    /// Names and bounds of the controller's states in a record: within ten times the range of the command.
    pub(crate) fn entries(&self, record: usize, input: (f64, f64)) -> Vec<(String, (f64, f64))> {
        let room = 10.0 * (input.1 - input.0);
        let several = self.controller.states() > 1;
        self.replays[record]
            .states
            .iter()
            .enumerate()
            .map(|(i, state)| {
                let name = if several {
                    format!("controller_{}(0)", i + 1)
                } else {
                    "controller(0)".to_string()
                };
                (name, (state - room, state + room))
            })
            .collect()
    }

    /// Response of the plant to the controller's commands, for rows with this number of columns.
    pub(crate) fn response(&self, columns: usize) -> Response {
        Response {
            plant: self.plant.clone(),
            levels: vec![0.0; columns * self.plant.b.len()],
        }
    }
}

/// `P0` on the columns of rows. Levels are kept row by row, a column beside the other, so that all columns take a step at
/// once.
pub(crate) struct Response {
    plant: Arc<LinearPlant>,
    levels: Vec<f64>,
}

impl Response {
    /// A record begins: its initial states have separate columns.
    pub(crate) fn reset(&mut self) {
        self.levels.fill(0.0);
    }

    /// Adds the effect of earlier commands to a row of an output.
    pub(crate) fn add_to(&self, output: usize, row: &mut [f64]) {
        let read = self.plant.outputs[output] * row.len();
        for (value, level) in row.iter_mut().zip(&self.levels[read..]) {
            *value += level;
        }
    }

    /// A step under the commands of a row.
    pub(crate) fn advance(&mut self, commands: &[f64]) {
        let (a, b) = (&self.plant.a, &self.plant.b);
        // A single loop over the columns: rows are short, and the overhead of a loop exceeds the cost of its sums.
        if let [b0, b1] = b[..] {
            let [[a00, a01], [a10, a11]] = [[a[0][0], a[0][1]], [a[1][0], a[1][1]]];
            let (first, second) = self.levels.split_at_mut(commands.len());
            for ((x0, x1), u) in first.iter_mut().zip(second).zip(commands) {
                let (before0, before1) = (*x0, *x1);
                *x0 = a00 * before0 + a01 * before1 + b0 * u;
                *x1 = a10 * before0 + a11 * before1 + b1 * u;
            }
        } else if let [b0] = b[..] {
            for (x, u) in self.levels.iter_mut().zip(commands) {
                *x = a[0][0] * *x + b0 * u;
            }
        } else {
            let (n, columns) = (b.len(), commands.len());
            let mut before = [0.0; MAX_VESSELS];
            for (column, u) in commands.iter().enumerate() {
                for (i, level) in before.iter_mut().enumerate().take(n) {
                    *level = self.levels[i * columns + column];
                }
                for i in 0..n {
                    let moved: f64 = a[i].iter().zip(&before).map(|(a, x)| a * x).sum();
                    self.levels[i * columns + column] = moved + b[i] * u;
                }
            }
        }
    }
}
