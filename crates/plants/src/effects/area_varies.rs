//! `area_varies`: the vessel's surface changes with the level, as in a conical tank.

use super::{EffectInfo, Place, any_plant};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "area_varies",
    place: Place::Vessel,
    by_clock: false,
    physics: "The vessel widens or narrows with the level, as a cone does.",
    general: None,
    at_ports: &["varies_with(s,h)"],
    equation: "S(H) = S (1 + c (H - H_op)/H_op)^2",
    applies: any_plant,
    parameters,
    confused_with: &["sqrt_outflow"],
    confirm: "Measure the vessel's width at two heights.",
    source: "K. H. Johansson, The quadruple-tank process, IEEE Trans. CST 8(3), 2000, for the balance.",
};

fn parameters(_: &Site) -> Vec<ParameterInfo> {
    vec![ParameterInfo {
        name: "taper",
        unit: Unit::ONE,
        meaning: "relative widening for a relative rise of the level",
        absent: 0.0,
        lower: -0.9,
        upper: 3.0,
        starts: vec![0.1],
    }]
}

struct AreaVaries<T> {
    taper: T,
    operating_level: f64,
    /// Reference for the change of level: normally the operating level.
    scale: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    // If the level's zero is near the operating level, the operating level is no useful reference; the range of the level is used instead.
    let (low, high) = site.level();
    let operating_level = site.operating_level();
    let scale = if operating_level.abs() > 1e-3 * (high - low) { operating_level } else { (high - low).max(f64::MIN_POSITIVE) };
    AreaVaries { taper: parameters[0], operating_level, scale }
}

impl<T: Scalar> Law<T> for AreaVaries<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Area)
    }
    fn area(&self, level: &T, area: &mut T) {
        let width = self.taper * (*level - self.operating_level) * (1.0 / self.scale) + 1.0;
        // The relative width is bounded below by 0.1, so that the surface is never zero.
        let width = width.max(T::constant(0.1));
        *area = *area * width * width;
    }
}
