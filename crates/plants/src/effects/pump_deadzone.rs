//! `pump_deadzone`: a command below a threshold has no effect.

use super::{EffectInfo, Place, any_plant, spread};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pump_deadzone",
    place: Place::Actuator,
    by_clock: false,
    physics: "The pump delivers nothing below a threshold of the command: it must first overcome friction and head.",
    general: Some("the actuator does nothing below a threshold"),
    at_ports: &["dead_zone(u)"],
    equation: "q = k max(u - u_dz, 0)   (odd in u)",
    applies: any_plant,
    parameters,
    confused_with: &["const_leak", "sensor_offset", "pump_nonlinearity", "laminar_outflow"],
    confirm: "Raise the command slowly from zero and read at which value water begins to flow.",
    source: "G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.input();
    let mut starts = if low >= 0.0 {
        [0.1, 0.3, 0.5].map(|share| site.input_quantile(share)).to_vec()
    } else {
        spread(0.0, 0.6 * high.max(-low), 3)
    };
    let (low, high) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
    starts.insert(0, 0.5 * low);
    vec![ParameterInfo {
        name: "threshold",
        unit: Unit::INPUT,
        meaning: "command below which nothing flows",
        absent: 0.0,
        lower: 0.0,
        upper: 0.95 * high,
        starts,
    }]
}

struct PumpDeadzone<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PumpDeadzone(parameters[0])
}

impl<T: Scalar> Law<T> for PumpDeadzone<T> {
    fn command(&mut self, u: T, _t: f64) -> T {
        // An odd function, so that it is the identity at a threshold of zero for commands of either sign.
        if u.value() >= 0.0 {
            (u - self.0).max(T::constant(0.0))
        } else {
            (u + self.0).min(T::constant(0.0))
        }
    }
    fn corners(&self) -> [Option<T>; 2] {
        if self.0.value() > 0.0 {
            [Some(self.0), Some(-self.0)]
        } else {
            [None; 2]
        }
    }
}
