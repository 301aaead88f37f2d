//! `valve_step`: the outflow coefficient changes at one instant.

use super::{EffectInfo, Place, any_plant, fully_shut, spread};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "valve_step",
    place: Place::Vessel,
    by_clock: true,
    physics: "At one instant the outlet changes: the valve was turned, or something lodged in it.",
    general: Some("the loss coefficient changes at one instant"),
    at_ports: &["step(q)"],
    equation: "Q_out(t) = (1 + s) Q_out from t_s on",
    applies: any_plant,
    parameters,
    confused_with: &["valve_drift", "pump_gain_drift"],
    confirm: "Ask who was at the valve at that time; look into the outlet.",
    source: "M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let duration = site.duration();
    let mut changes = vec![0.01];
    if site.is_joined_to_next() {
        // A tank behind a closed valve fills and empties alone; a fit that starts from a small change does not reach this solution.
        changes.push(-0.9);
    }
    vec![
        ParameterInfo {
            name: "change",
            unit: Unit::ONE,
            meaning: "relative change of the outflow",
            absent: 0.0,
            lower: fully_shut(site, -0.9),
            upper: 2.0,
            starts: changes,
        },
        ParameterInfo {
            name: "time",
            unit: Unit::TIME,
            meaning: "when it changed, since the record began",
            absent: f64::NAN,
            lower: 0.0,
            upper: duration,
            starts: spread(0.0, duration, 8),
        },
    ]
}

struct ValveStep<T> {
    change: T,
    time: T,
    past: bool,
}

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    ValveStep { change: parameters[0], time: parameters[1], past: false }
}

impl<T: Scalar> Law<T> for ValveStep<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Outflow)
    }
    fn outflow(&self, _head: &T, outflow: &mut T, _t: &T) {
        if self.past {
            *outflow = *outflow * (self.change + 1.0);
        }
    }
    fn switch(&self) -> Option<T> {
        // A change of zero needs no cut of the step, unless its derivative is wanted.
        let none = T::constant(0.0);
        let shows = self.change.value() != 0.0 || !self.change.same_derivatives(none);
        shows.then_some(self.time)
    }
    fn switch_over(&mut self) {
        self.past = true;
    }
}
