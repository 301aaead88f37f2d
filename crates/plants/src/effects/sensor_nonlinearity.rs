//! `sensor_nonlinearity`: the reading is a curved function of the level, exact at both ends of the range.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_nonlinearity",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading bends away from the level; it is right when empty and at the highest level.",
    general: Some("the sensor's characteristic is bent"),
    at_ports: &["curved_reading(y)", "nonlinearity(y)"],
    equation: "y = H + g H (H/h_range - 1), h_range the highest level of the record",
    applies: any_plant,
    parameters,
    confused_with: &["sqrt_outflow", "pump_nonlinearity", "laminar_outflow", "sensor_offset"],
    confirm: "Compare the sensor with a rule at five levels and see whether the differences lie on a line.",
    source: "J. Fraden, Handbook of Modern Sensors, 5th ed., ch. 3.",
};

fn parameters(_: &Site) -> Vec<ParameterInfo> {
    vec![ParameterInfo {
        name: "bend",
        unit: Unit::ONE,
        meaning: "curvature: above zero the reading bends upwards",
        absent: 0.0,
        // An error of 1/8 of the range at its middle; no usable level sensor has a larger one.
        lower: -0.5,
        upper: 0.5,
        starts: vec![0.02],
    }]
}

struct SensorNonlinearity<T> {
    bend: T,
    range: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let (low, high) = site.measured_level();
    SensorNonlinearity { bend: parameters[0], range: low.abs().max(high.abs()).max(f64::MIN_POSITIVE) }
}

impl<T: Scalar> Law<T> for SensorNonlinearity<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        y + self.bend * y * (y * (1.0 / self.range) - 1.0)
    }
}
