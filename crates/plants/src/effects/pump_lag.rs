//! `pump_lag`: the inflow follows the command with a first-order lag.

use super::{EffectInfo, Place, any_plant, lag};
use crate::{Law, ParameterInfo, Scalar, Site};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pump_lag",
    place: Place::Actuator,
    by_clock: false,
    physics: "The inflow follows the command with a time constant: the pump has to spin up.",
    general: Some("the actuator lags behind the input"),
    at_ports: &["lag(u)"],
    equation: "T dq/dt = k u - q",
    applies: any_plant,
    parameters,
    confused_with: &["sensor_lag", "transport_delay"],
    confirm: "Step the pump and watch the jet: does the inflow reach its new value at once?",
    source: "K. J. Astrom, R. M. Murray, Feedback Systems, 2nd ed., ch. 3.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    lag(site, "time constant of the pump")
}

struct PumpLag<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PumpLag(parameters[0])
}

impl<T: Scalar> Law<T> for PumpLag<T> {
    fn actuator_lag(&self) -> Option<T> {
        Some(self.0)
    }
}
