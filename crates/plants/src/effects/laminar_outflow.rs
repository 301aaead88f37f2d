//! `laminar_outflow`: a part of the outflow is proportional to the level.

use super::{EffectInfo, Place, torricelli_plant};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "laminar_outflow",
    place: Place::Vessel,
    by_clock: false,
    physics: "A part of the outflow is laminar and grows in proportion to the level, as through a long thin pipe.",
    general: None,
    at_ports: &["loss(h)"],
    equation: "Q_out = a H + b sqrt(H)",
    applies: torricelli_plant,
    parameters,
    confused_with: &["const_leak", "pump_deadzone", "pump_nonlinearity", "sensor_offset"],
    confirm: "Let the tank run out and plot the outflow against the level: a laminar part shows as a straight rise.",
    source: "F. M. White, Fluid Mechanics, 7th ed., ch. 6: laminar pipe flow.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let slope = site.scales.flow.abs() / site.operating_level().abs().max(1e-12);
    vec![ParameterInfo {
        name: "slope",
        unit: Unit { area: 1, time: -1, ..Unit::ONE },
        meaning: "outflow for one unit of level",
        absent: 0.0,
        lower: 0.0,
        upper: 10.0 * slope,
        starts: vec![0.1 * slope],
    }]
}

struct LaminarOutflow<T> {
    slope: T,
    both_ways: bool,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    LaminarOutflow { slope: parameters[0], both_ways: site.is_joined_to_next() }
}

impl<T: Scalar> Law<T> for LaminarOutflow<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Outflow)
    }
    fn outflow(&self, level: &T, outflow: &mut T, _t: &T) {
        // A stage of a step may have a level below the bottom, where the flow is zero; through a valve between two tanks the flow is
        // negative for a negative head.
        let head = if self.both_ways { *level } else { level.max(T::constant(0.0)) };
        *outflow = *outflow + self.slope * head;
    }
}
