//! `sensor_offset`: the reading has a constant error.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_offset",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading is shifted: the sensor's zero is not the level of the outlet.",
    general: Some("the zero of the sensor is shifted"),
    at_ports: &["offset(y)"],
    equation: "y = H + b",
    applies: any_plant,
    parameters,
    confused_with: &["const_leak", "pump_deadzone", "laminar_outflow"],
    confirm: "Empty the tank to the outlet and read the sensor.",
    source: "J. Fraden, Handbook of Modern Sensors, 5th ed., ch. 3.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    // A sensor with a live zero (4 to 20 mA, 2 to 10 V) reads a fifth of the range for an empty tank; a larger offset would have been
    // noticed.
    let most = 0.25 * low.abs().max(high.abs());
    vec![ParameterInfo {
        name: "offset",
        unit: Unit::LEVEL,
        meaning: "reading at a level of zero",
        absent: 0.0,
        lower: -most,
        upper: most,
        starts: vec![0.1 * most],
    }]
}

struct SensorOffset<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    SensorOffset(parameters[0])
}

impl<T: Scalar> Law<T> for SensorOffset<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        y + self.0
    }
}
