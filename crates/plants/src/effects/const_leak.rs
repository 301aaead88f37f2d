//! `const_leak`: an unmeasured constant flow leaves a vessel.

use super::{EffectInfo, Place, any_plant};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "const_leak",
    place: Place::Vessel,
    by_clock: false,
    physics: "A constant flow leaves the vessel beside the outlet: a leak, or a consumer that was not recorded.",
    general: Some("a constant unknown load acts on the process"),
    at_ports: &["constant(h)"],
    equation: "S dH/dt = ... - q0",
    applies: any_plant,
    parameters,
    confused_with: &["pump_deadzone", "sensor_offset", "laminar_outflow", "pump_nonlinearity"],
    confirm: "Shut the outlet and the pump and watch whether the level falls.",
    source: "Mass balance.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let flow = site.scales.flow.abs();
    vec![ParameterInfo {
        name: "flow",
        unit: Unit::FLOW,
        meaning: "flow that leaves unseen",
        absent: 0.0,
        lower: 0.0,
        // A larger leak of a measured vessel would have been noticed; a vessel whose level is not measured may lose the whole flow.
        upper: if site.is_measured() { 0.3 } else { 1.0 } * flow,
        starts: vec![0.05 * flow],
    }]
}

struct ConstLeak<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    ConstLeak(parameters[0])
}

impl<T: Scalar> Law<T> for ConstLeak<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Net)
    }
    fn net(&self, _level: &T, net: &mut T, _t: &T) {
        *net = *net - self.0;
    }
}
