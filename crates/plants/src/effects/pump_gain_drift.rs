//! `pump_gain_drift`: the pump's gain drifts over the record, linearly or exponentially as a pump that warms up.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pump_gain_drift",
    place: Place::Actuator,
    by_clock: true,
    physics: "The pump delivers more or less for the same command as the record goes on: it wears, or it warms up and settles.",
    general: Some("the gain of the actuator drifts"),
    at_ports: &["gain_drift(u)", "drift(k)"],
    equation: "k(t) = k (1 + r (1 - exp(-t/T_w))/(1 - exp(-T_rec/T_w))); T_w above T_rec: k (1 + r t/T_rec)",
    applies: any_plant,
    parameters,
    confused_with: &["valve_drift", "sensor_drift", "valve_step"],
    confirm: "Measure the inflow (a bucket and a watch) at one command, cold and after the length of the record.",
    source: "I. J. Karassik et al., Pump Handbook, 4th ed., ch. 2: slip and temperature.",
};

/// A warm-up with a time constant of this many record lengths is a straight line, to 1 % of the change.
const STRAIGHT: f64 = 10.0;

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let duration = site.duration();
    vec![
        ParameterInfo {
            name: "change",
            unit: Unit::ONE,
            meaning: "relative change of the gain over the record",
            absent: 0.0,
            lower: -0.9,
            upper: 2.0,
            starts: vec![0.01],
        },
        ParameterInfo {
            name: "time_constant",
            unit: Unit::TIME,
            meaning: "how long the pump takes to settle; ten records and more: an even drift",
            absent: f64::NAN,
            lower: 0.01 * duration,
            upper: STRAIGHT * duration,
            starts: vec![0.2 * duration, 2.0 * duration],
        },
    ]
}

struct PumpGainDrift<T> {
    /// The change after an infinite time.
    final_change: T,
    time_constant: T,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let (change, time_constant) = (parameters[0], parameters[1]);
    let reached = -(T::constant(-site.duration()) / time_constant).exp() + 1.0;
    PumpGainDrift { final_change: change / reached, time_constant }
}

impl<T: Scalar> Law<T> for PumpGainDrift<T> {
    fn gain(&self, t: T) -> Option<T> {
        Some(self.final_change * (-(-(t / self.time_constant)).exp() + 1.0) + 1.0)
    }
}
