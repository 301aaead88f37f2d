//! `pipe_height`: a vertical outlet pipe below the tank adds its height to the head that drives the outflow.

use super::{EffectInfo, Place, torricelli_plant};
use crate::{Balance, Law, ParameterInfo, Plant, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "pipe_height",
    place: Place::Vessel,
    by_clock: false,
    physics: "The outlet pipe leads down: its height adds to the level that drives the outflow.",
    general: None,
    at_ports: &["offset(y)"],
    equation: "Q_out = alpha sqrt(H + h_pipe)",
    applies: measured_vessel,
    parameters,
    confused_with: &["sensor_offset", "laminar_outflow", "const_leak"],
    confirm: "Measure from the bottom of the tank down to the open end of the pipe.",
    source: "E. Torricelli, De motu gravium, 1643.",
};

/// Not identifiable in a vessel whose level is not measured: there the height only shifts the level.
fn measured_vessel(plant: Plant, vessel: usize) -> bool {
    torricelli_plant(plant, vessel) && vessel + 1 == plant.vessels()
}

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.level();
    let most = low.abs().max(high.abs());
    vec![ParameterInfo {
        name: "height",
        unit: Unit::LEVEL,
        meaning: "height from the bottom of the tank to the end of the pipe",
        absent: 0.0,
        lower: 0.0,
        // A pipe longer than the largest level would have been noticed.
        upper: most,
        starts: vec![0.1 * most],
    }]
}

/// Levels up to this one count as zero.
const NEGLIGIBLE: f64 = 1e-100;

struct PipeHeight<T>(T);

pub(super) fn bind<T: Scalar>(_: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    PipeHeight(parameters[0])
}

impl<T: Scalar> Law<T> for PipeHeight<T> {
    fn changes(&self) -> Option<Balance> {
        Some(Balance::Outflow)
    }
    fn outflow(&self, level: &T, outflow: &mut T, _t: &T) {
        // An empty tank has no outflow, whatever the pipe's height. The threshold also keeps the square of a level from underflow.
        if level.value() > NEGLIGIBLE {
            // alpha sqrt(H) sqrt(1 + h/H): the factor is exactly one at h = 0.
            *outflow = *outflow * (self.0 / *level + 1.0).sqrt();
        }
    }
}
