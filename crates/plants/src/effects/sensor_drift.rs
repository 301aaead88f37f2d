//! `sensor_drift`: the zero of the sensor drifts over the record.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_drift",
    place: Place::Sensor,
    by_clock: true,
    physics: "The zero of the sensor drifts over the record, with temperature or with dirt.",
    general: Some("the zero of the sensor drifts"),
    at_ports: &["drift(y)"],
    equation: "y = H + D t/T_rec",
    applies: any_plant,
    parameters,
    confused_with: &["valve_drift", "pump_gain_drift"],
    confirm: "Read the level with a rule at the beginning and at the end, and compare with the sensor.",
    source: "J. Fraden, Handbook of Modern Sensors, 5th ed., ch. 3.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    // A larger drift of a sensor would have been noticed.
    let most = (0.3 * low.abs().max(high.abs())).max(high - low);
    vec![ParameterInfo {
        name: "change",
        unit: Unit::LEVEL,
        meaning: "by how much the reading has drifted at the end of the record",
        absent: 0.0,
        lower: -most,
        upper: most,
        starts: vec![0.03 * most],
    }]
}

struct SensorDrift<T> {
    change: T,
    duration: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    SensorDrift { change: parameters[0], duration: site.duration() }
}

impl<T: Scalar> Law<T> for SensorDrift<T> {
    fn reading(&mut self, y: T, t: f64) -> T {
        y + self.change * (t / self.duration)
    }
}
