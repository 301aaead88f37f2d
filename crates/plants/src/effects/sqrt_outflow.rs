//! `sqrt_outflow`: the outflow of a vessel with a nominally linear outflow law follows Torricelli's square root.

use super::{EffectInfo, Place, linear_plant};
use crate::{Balance, Law, ParameterInfo, Scalar, Site, Unit, vessels::square_root};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sqrt_outflow",
    place: Place::Vessel,
    by_clock: false,
    physics: "The outflow grows with the square root of the level (Torricelli), where the model has it grow in proportion.",
    general: None,
    at_ports: &["varies_with(q,h)"],
    equation: "Q_out = Q_lin + c (2 sqrt(H_op) (sqrt(H) - sqrt(H_op)) - (H - H_op)); c = 1 is the square root",
    applies: linear_plant,
    parameters,
    confused_with: &["area_varies"],
    confirm: "Let the tank run out and time it: the level falls along a parabola, not an exponential.",
    source: "E. Torricelli, De motu gravium, 1643; EQUATIONS of the plants in this catalogue.",
};

fn parameters(_: &Site) -> Vec<ParameterInfo> {
    vec![ParameterInfo {
        name: "curvature",
        unit: Unit::ONE,
        meaning: "0: proportional, 1: square root",
        absent: 0.0,
        lower: 0.0,
        upper: 3.0,
        starts: vec![1.0],
    }]
}

struct SqrtOutflow<T> {
    curvature: T,
    operating_level: f64,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    SqrtOutflow { curvature: parameters[0], operating_level: site.operating_level().max(f64::MIN_POSITIVE) }
}

impl<T: Scalar> Law<T> for SqrtOutflow<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Outflow)
    }
    fn outflow(&self, level: &T, outflow: &mut T, _t: &T) {
        let root = self.operating_level.sqrt();
        // With more curvature than a square root, the outflow would decrease above some level, which no outlet does. Above that level the
        // added flow keeps its value there; below empty it keeps its value at empty.
        let excess = self.curvature - 1.0;
        let mut level = level.max(T::constant(0.0));
        if excess.value() > 0.0 {
            let share = self.curvature / excess;
            level = level.min(share * share * self.operating_level);
        }
        *outflow = *outflow
            + self.curvature * ((square_root(level) - root) * (2.0 * root) - (level - self.operating_level))
    }
}
