//! `sensor_saturation`: the reading has an upper limit.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_saturation",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading does not rise above a limit: the end of the sensor's or the converter's range.",
    general: Some("the sensor saturates"),
    at_ports: &["saturation(y)"],
    equation: "y = min(H, y_max)",
    applies: any_plant,
    parameters,
    confused_with: &["overflow"],
    confirm: "Look at the level itself while the reading stands at its limit.",
    source: "J. Fraden, Handbook of Modern Sensors, 5th ed., ch. 3.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.measured_level();
    let span = high - low;
    let mut starts = [0.5, 0.8].map(|share| site.measured_quantile(share)).to_vec();
    starts.push(high);
    vec![ParameterInfo {
        name: "limit",
        unit: Unit::LEVEL,
        meaning: "largest reading",
        absent: f64::INFINITY,
        lower: low + 0.02 * span,
        upper: high + 0.05 * span,
        starts,
    }]
}

struct SensorSaturation<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    SensorSaturation(parameters[0])
}

impl<T: Scalar> Law<T> for SensorSaturation<T> {
    fn reading(&mut self, y: T, _t: f64) -> T {
        y.min(self.0)
    }
}
