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
//! The response of an unstable `P0` would grow. It follows the residual with a gain, as a Kalman filter does: the residual is then the
//! innovation, `v` through an all-pass filter with the unstable eigenvalues and their inverses. What was said above holds for it too.
//!
//! **Assumptions**: `y[k]` is read before `u[k]` acts; the command is held; the reference is not constant; `r` is independent of
//! `v`.
//!
//! **Cost**: one step of the controller for every simulated sample, `O((p + 1) n^2)` for the filter of a row.
//!
//! **References**: I. D. Landau, A. Karimi, Recursive algorithms for identification in closed loop, Automatica 33 (1997)
//! 1499-1523; M. Gilson, P. Van den Hof, Instrumental variable methods for closed-loop system identification, Automatica
//! 41 (2005) 241-249; U. Forssell, L. Ljung, Closed-loop identification revisited, Automatica 35 (1999) 1215-1241.

mod replay;
mod response;

use std::sync::Arc;

use ct_signals::Record;
use plants::controller::Controller;
use plants::{Command, Dual, MAX_VESSELS, Scalar, Simulator, Structure};

pub use self::replay::{Replay, replay};
pub(crate) use self::replay::{fitting, replay_of, require_moving_reference, step};
pub use self::response::spectral_radius;
pub(crate) use self::response::{LinearResponse, Response};
use crate::Error;

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

impl LinearPlant {
    /// The largest magnitude of the eigenvalues of the plant in a loop with a controller, over one sampling interval \[s\]: above one the
    /// loop is unstable.
    #[must_use]
    pub fn radius_in_loop(self, controller: &Controller, interval: f64) -> f64 {
        spectral_radius(&self.response().in_loop([controller], interval))
    }

    fn response(self) -> LinearResponse {
        LinearResponse {
            outputs: self
                .outputs
                .iter()
                .map(|&level| vec![(level, 1.0)])
                .collect(),
            a: self.a,
            b: vec![self.b],
            gain: Vec::new(),
        }
    }
}

/// A controller around the setup's plant.
#[derive(Debug, Clone)]
pub(crate) struct Feedback {
    pub controller: Controller,
    pub replays: Arc<Vec<Replay>>,
    /// The controller's initial states are fitted.
    pub released: bool,
    response: Arc<LinearResponse>,
}

impl Feedback {
    pub(crate) fn new(
        controller: &Controller,
        records: &[Record],
        plant: LinearPlant,
    ) -> Result<Self, Error> {
        for record in records {
            require_moving_reference(record)?;
        }
        let (controller, replays) = fitting(controller, |controller| {
            records
                .iter()
                .map(|record| replay(controller, record))
                .collect()
        })?;
        Ok(Self {
            controller,
            replays: Arc::new(replays),
            released: false,
            response: Arc::new(plant.response()),
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
        Response::new(self.response.clone(), columns)
    }
}
