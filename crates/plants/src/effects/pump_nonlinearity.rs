//! `pump_nonlinearity`: the inflow is not proportional to the command.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pump_nonlinearity",
    place: Place::Actuator,
    by_clock: false,
    physics: "The inflow bends away from proportional to the command; it is right at both ends of the range.",
    general: Some("the actuator's characteristic is bent"),
    at_ports: &["nonlinearity(u)", "varies_with(k,u)"],
    equation: "q = k (u + b u (u - u_range)/u_range)",
    applies: any_plant,
    parameters,
    confused_with: &["pump_deadzone", "const_leak", "pump_saturation"],
    confirm: "Measure the inflow (a bucket and a watch) at five commands and see whether the points lie on a line.",
    source: "I. J. Karassik et al., Pump Handbook, 4th ed., ch. 2: head and flow against speed.",
};

fn parameters(_: &Site) -> Vec<ParameterInfo> {
    vec![ParameterInfo {
        name: "bend",
        unit: Unit::ONE,
        meaning: "curvature: above zero the inflow bends upwards",
        absent: 0.0,
        lower: -1.0,
        upper: 1.0,
        starts: vec![0.05],
    }]
}

struct PumpNonlinearity<T> {
    bend: T,
    range: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PumpNonlinearity { bend: parameters[0], range: site.scales.input_range }
}

impl<T: Scalar> Law<T> for PumpNonlinearity<T> {
    fn command(&mut self, u: T, _t: f64) -> T {
        u + self.bend * u * (u - self.range) * (1.0 / self.range)
    }
}
