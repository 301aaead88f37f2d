//! Path in parameter space from a model without an effect to one with it, by its size.

use greybox::Setup;
use plants::{ParameterInfo, Placed};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

use super::{beside, between, without_noise};
use crate::Rig;

/// The sizes of an effect in a rig, from absent at 0 to the end of the plausible range at 1.
pub(super) struct Path {
    placed: Placed,
    /// For each parameter its value at 0 and at 1.
    ends: Vec<(f64, f64)>,
}

impl Path {
    pub(super) fn draw(rig: &Rig, placed: Placed, seed: u64, rng: &mut ChaCha8Rng) -> Option<Self> {
        let records = [without_noise(rig, seed)];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, BTreeMap::new()).ok()?;
        let mut structure = setup.structure.clone();
        let x = [rig.theta.as_slice(), &rig.levels].concat();
        structure.scales = setup.scales_at(&x).ok()?;
        let parameters = structure.effect_parameters(placed);
        let leading = parameters.first()?;
        // Sine and cosine of an oscillation are one size, in a direction of their own.
        let sized = |p: &ParameterInfo| p.unit == leading.unit && p.absent == leading.absent;
        let several = parameters.iter().filter(|p| sized(p)).count() > 1;
        let ends = parameters.iter().map(|p| {
            if !sized(p) {
                let value = beside(p, rng);
                (value, value)
            } else if p.absent.is_finite() {
                let end = if p.lower < p.absent && rng.random() {
                    p.lower
                } else {
                    p.upper
                };
                let part = if several {
                    between(rng, 0.1..=1.0)
                } else {
                    1.0
                };
                (p.absent, p.absent + part * (end - p.absent))
            } else {
                // A threshold starts slightly outside the range of the believed model.
                let first = p.starts.iter().copied().fold(p.lower, f64::max);
                let beyond = first + 0.2 * (first - p.lower);
                (beyond.min(p.upper), p.lower)
            }
        });
        Some(Self {
            placed,
            ends: ends.collect(),
        })
    }

    pub(super) fn at(&self, rig: &Rig, size: f64) -> Rig {
        let values = self
            .ends
            .iter()
            .map(|(from, to)| from + size * (to - from))
            .collect();
        Rig {
            hidden: vec![(self.placed.effect.id, self.placed.vessel, values)],
            ..rig.clone()
        }
    }
}
