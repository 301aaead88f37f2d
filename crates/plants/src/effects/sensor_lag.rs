//! `sensor_lag`: the reading follows the level with a first-order lag.

use super::{EffectInfo, Place, any_plant, lag};
use crate::{Law, ParameterInfo, Scalar, Site};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor_lag",
    place: Place::Sensor,
    by_clock: false,
    physics: "The reading follows the level with a time constant: a filter in the transmitter, or a stilling tube.",
    general: Some("the sensor lags behind what it measures"),
    at_ports: &["lag(y)"],
    equation: "T dy/dt = H - y",
    applies: any_plant,
    parameters,
    confused_with: &["pump_lag", "transport_delay"],
    confirm: "Lift the sensor by a known height and time how long the reading takes to settle.",
    source: "K. J. Astrom, R. M. Murray, Feedback Systems, 2nd ed., ch. 3.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    lag(site, "time constant of the sensor")
}

struct SensorLag<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    SensorLag(parameters[0])
}

impl<T: Scalar> Law<T> for SensorLag<T> {
    fn sensor_lag(&self) -> Option<T> {
        Some(self.0)
    }
}
