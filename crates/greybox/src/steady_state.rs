//! Steady state of a plant under the first inputs of a record.
//!
//! The plant is simulated on these inputs over steps that double until its levels stay where they are. A plant that integrates, or that is
//! driven by the clock, comes to no rest.

use plants::{Command, Simulator};

use crate::{Setup, at_rest, levels_from_readings};

/// Largest number of doublings of the step, from the sampling interval on.
const DOUBLINGS: usize = 24;
/// Levels are at rest if they change by less than this share of the largest level over two steps.
const STILL: f64 = 1e-12;

/// The initial states of the first record of a setup at rest under its first inputs \[units of the levels\], for these parameters; `None`
/// if the plant has no equilibrium.
#[must_use]
pub fn steady_state(setup: &Setup, parameters: &[f64]) -> Option<Vec<f64>> {
    let record = setup.records.first()?;
    let vessels = setup.structure.plant.vessels();
    let inputs = at_rest(record);
    let commands = inputs.map(Command::held);
    let own = setup.plant_states_of(0).len();
    let mut states = levels_from_readings(setup, parameters);
    states.truncate(own);
    // A level that is not measured begins at zero, where an outlet by a square root has no slope.
    let largest = states
        .iter()
        .take(vessels)
        .fold(0.0, |m: f64, v| m.max(v.abs()));
    let begin = if largest > 0.0 { largest } else { 1.0 };
    states
        .iter_mut()
        .take(vessels)
        .filter(|level| **level <= 0.0)
        .for_each(|level| *level = begin);
    let mut simulator =
        Simulator::starting_at(0.0, &setup.structure, parameters, &states, inputs).ok()?;
    simulator.set_substeps(setup.substeps);
    let mut h = record.sample_interval();
    let mut before = simulator.levels();
    let mut still = 0;
    for _ in 0..DOUBLINGS {
        simulator.advance_both(commands, h);
        let levels = simulator.levels();
        let levels = &levels[..vessels];
        if !levels.iter().all(|level| level.is_finite()) {
            return None;
        }
        let size = levels.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        let moved = levels.iter().zip(&before).map(|(a, b)| (a - b).abs());
        still = if moved.fold(0.0, f64::max) <= STILL * size {
            still + 1
        } else {
            0
        };
        before[..vessels].copy_from_slice(levels);
        if still == 2 {
            states[..vessels].copy_from_slice(levels);
            return Some(states);
        }
        h *= 2.0;
    }
    None
}
