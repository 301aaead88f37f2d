//! `overflow`: the level cannot rise above the rim; the overflow is lost, or a part of it reaches the next tank.

use super::{EffectInfo, Place, any_plant, spread};
use crate::{Law, ParameterInfo, Rim, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "overflow",
    place: Place::Vessel,
    by_clock: false,
    physics: "The vessel overflows at its rim; what spills is lost, or a part of it reaches the next tank.",
    general: None,
    at_ports: &["limit(h)", "overflow(h,h)"],
    equation: "H <= h_rim; at the rim the spill is the net inflow, and a fraction of it runs into the next tank",
    applies: any_plant,
    parameters,
    confused_with: &["sensor_saturation", "pump_saturation"],
    confirm: "Look whether water runs over the rim when the level is highest.",
    source: "M. Schoukens et al., Cascaded tanks benchmark combining soft and hard nonlinearities, 2016.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.level();
    let span = high - low;
    let mut parameters = vec![ParameterInfo {
        name: "rim",
        unit: Unit::LEVEL,
        meaning: "height of the rim",
        absent: f64::INFINITY,
        lower: low - 0.5 * span,
        upper: site.highest_place(),
        starts: spread(low + 0.4 * span, high, 4),
    }];
    if site.is_above_another() {
        parameters.push(ParameterInfo {
            name: "fraction",
            unit: Unit::ONE,
            meaning: "share of the spill that reaches the next tank",
            absent: 0.0,
            lower: 0.0,
            upper: 1.0,
            starts: vec![0.5],
        });
    }
    parameters
}

struct Overflow<T>(Rim<T>);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let fraction = parameters.get(1).copied().unwrap_or(T::constant(0.0));
    Overflow(Rim { level: parameters[0], fraction })
}

impl<T: Scalar> Law<T> for Overflow<T> {
    fn rim(&self) -> Option<Rim<T>> {
        Some(self.0)
    }
}
