//! `transport_delay`: the inflow follows the command after a dead time, for example the time of flow through a pipe.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "transport_delay",
    place: Place::Actuator,
    by_clock: false,
    physics: "The inflow follows the command after a dead time: the water takes time to run through the pipe.",
    general: Some("a dead time passes before the input acts"),
    at_ports: &["delay(u)"],
    equation: "q(t) = k u(t - delay)",
    applies: any_plant,
    parameters,
    confused_with: &["pump_lag", "sensor_lag"],
    confirm: "Step the pump up and time how long the inflow takes to begin to change.",
    source: "S. Skogestad, I. Postlethwaite, Multivariable Feedback Control, 2nd ed., ch. 2.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (sample, duration) = (site.scales.sample_interval, site.scales.duration);
    let longest = (60.0 * sample).min(0.2 * duration);
    vec![ParameterInfo {
        name: "delay",
        unit: Unit::TIME,
        meaning: "dead time",
        absent: 0.0,
        lower: 0.0,
        upper: longest,
        starts: vec![0.4 * sample, 2.4 * sample, 6.4 * sample, (20.4 * sample).min(0.7 * longest)],
    }]
}

struct TransportDelay<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    TransportDelay(parameters[0])
}

impl<T: Scalar> Law<T> for TransportDelay<T> {
    fn delay(&self) -> Option<T> {
        Some(self.0)
    }
}
