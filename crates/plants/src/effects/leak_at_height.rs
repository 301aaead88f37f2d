//! `leak_at_height`: a hole in the wall, through which water flows out when the level is above the hole.

use super::{EffectInfo, Place, any_plant, spread};
use crate::{Balance, Law, Outlet, ParameterInfo, Scalar, Site, Unit, vessels::square_root};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "leak_at_height",
    place: Place::Vessel,
    by_clock: false,
    physics: "Water leaves through a hole in the wall, or over a side outlet, once the level stands above it.",
    general: None,
    at_ports: &["leak_at_height(h)"],
    equation: "S dH/dt = ... - c sqrt(max(H - h_leak, 0))",
    applies: any_plant,
    parameters,
    confused_with: &["overflow", "const_leak", "sqrt_outflow"],
    confirm: "Fill the tank with the outlet shut and watch at which level it begins to fall by itself.",
    source: "E. Torricelli, De motu gravium, 1643.",
};

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.level();
    let span = (high - low).max(f64::MIN_POSITIVE);
    // In a tank, a hole at half height through which half the throughput flows would have been noticed. A linear plant may be a store of
    // any kind: above a threshold, a second outlet may take a flow as large as the inflow.
    let whole = site.scales.flow.abs() / (0.5 * span).sqrt();
    let (most, coefficients) = match site.plant.outlet() {
        Outlet::Torricelli => (0.5, vec![0.05 * whole]),
        Outlet::Linear => (100.0, vec![0.05 * whole, 3.0 * whole]),
    };
    let mut starts = spread(low, high, 5);
    let mut lowest = low - 0.5 * span;
    if site.is_joined_to_next() {
        // A joined tank may leak at its bottom. In a tank with its own outlet such a leak is a part of the outlet's flow.
        starts.push(0.0);
        lowest = lowest.min(0.0);
    }
    vec![
        ParameterInfo {
            name: "coefficient",
            unit: Unit { level_halves: 1, area: 1, time: -1, ..Unit::ONE },
            meaning: "outflow through the hole at one unit of level above it",
            absent: 0.0,
            lower: 0.0,
            upper: most * whole,
            starts: coefficients,
        },
        ParameterInfo {
            name: "height",
            unit: Unit::LEVEL,
            meaning: "level from which on it leaks",
            absent: f64::NAN,
            lower: lowest,
            upper: site.highest_place(),
            starts,
        },
    ]
}

struct LeakAtHeight<T> {
    coefficient: T,
    height: T,
}

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    LeakAtHeight { coefficient: parameters[0], height: parameters[1] }
}

impl<T: Scalar> Law<T> for LeakAtHeight<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::NetByLevel)
    }
    fn net(&self, level: &T, net: &mut T, _t: &T) {
        *net = *net - self.coefficient * square_root(*level - self.height);
    }
}
