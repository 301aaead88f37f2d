//! `valve_drift`: the outflow coefficient drifts over the record, because the outlet clogs or wears.

use super::{EffectInfo, Place, any_plant, fully_shut};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "valve_drift",
    place: Place::Vessel,
    by_clock: true,
    physics: "The outlet slowly clogs, or opens, over the record.",
    general: Some("the loss coefficient drifts"),
    at_ports: &["drift(q)"],
    equation: "Q_out(t) = (1 + r t/T_rec) Q_out; clogging: r < 0",
    applies: any_plant,
    parameters,
    confused_with: &["pump_gain_drift", "sensor_drift", "valve_step"],
    confirm: "Repeat a run-out of the tank at the beginning and at the end, and compare the times.",
    source: "R. Isermann, Fault-Diagnosis Systems, 2006: drifting parameters of a process.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    vec![ParameterInfo {
        name: "change",
        unit: Unit::ONE,
        meaning: "relative change of the outflow over the record",
        absent: 0.0,
        lower: fully_shut(site, -0.9),
        upper: 2.0,
        starts: vec![0.01],
    }]
}

struct ValveDrift<T> {
    change: T,
    duration: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    ValveDrift { change: parameters[0], duration: site.duration() }
}

impl<T: Scalar> Law<T> for ValveDrift<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Outflow)
    }
    fn outflow(&self, _head: &T, outflow: &mut T, t: &T) {
        *outflow = *outflow * (self.change * *t * (1.0 / self.duration) + 1.0);
    }
}
