//! `pump_saturation`: the inflow does not increase for commands above a limit.

use super::{EffectInfo, Place, any_plant, spread};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pump_saturation",
    place: Place::Actuator,
    by_clock: false,
    physics: "The pump delivers no more above a limit of the command, which lies below the largest recorded one.",
    general: Some("the actuator saturates"),
    at_ports: &["saturation(u)"],
    equation: "q = k min(u, u_max)",
    applies: any_plant,
    parameters,
    confused_with: &["pump_nonlinearity", "overflow"],
    confirm: "Step the command between two high values and see whether the inflow changes.",
    source: "G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.input();
    // Starts over the whole range, over the most frequent commands, and near the maximum.
    let mut starts = spread(low, high, 4);
    starts.extend([0.3, 0.7, 0.9, 0.97].map(|share| site.input_quantile(share)));
    vec![ParameterInfo {
        name: "limit",
        unit: Unit::INPUT,
        meaning: "command above which the inflow no longer rises",
        absent: f64::INFINITY,
        lower: low + 0.02 * (high - low),
        upper: high,
        starts,
    }]
}

struct PumpSaturation<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PumpSaturation(parameters[0])
}

impl<T: Scalar> Law<T> for PumpSaturation<T> {
    fn command(&mut self, u: T, _t: f64) -> T {
        u.min(self.0)
    }
    fn corners(&self) -> [Option<T>; 2] {
        [Some(self.0).filter(|limit| limit.value().is_finite()), None]
    }
}
