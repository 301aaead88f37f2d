//! Knots of a polyline: distributed over the values of a variable in the records.

use greybox::{at_rest, commands};
use plants::{Simulator, Variable};

use super::smooth::{Smoothed, carrier};
use crate::{Error, fit::node::Node};

/// Knots of a polyline.
const KNOTS: usize = 16;

/// Sorted values of a variable along the smoothed path, over all records.
pub(super) fn visited(
    node: &Node,
    smoothed: &Smoothed,
    variable: Variable,
) -> Result<Vec<f64>, Error> {
    let setup = &node.setup;
    let spot = smoothed.spot;
    let mut values = Vec::with_capacity(setup.samples());
    for (record, path) in setup.records.iter().zip(&smoothed.paths) {
        if variable == Variable::Input {
            values.extend(&record.inputs[0].values);
            continue;
        }
        let structure = setup
            .structure
            .with_term(carrier(spot, &path.time, &path.value))?;
        let mut theta = node.fit.x[..setup.parameter_count()].to_vec();
        theta.extend(&path.value);
        let mut simulator =
            Simulator::<f64>::with_inputs(&structure, &theta, &path.states, at_rest(record))?;
        simulator.set_substeps(setup.substeps);
        let vessel = match spot.place {
            plants::Place::Sensor => setup.structure.scales.outputs[spot.vessel].vessel,
            _ => spot.vessel,
        };
        let area = setup.structure.scales.area[vessel];
        let mut before: Option<(f64, f64)> = None;
        for k in 0..record.len() {
            let (t, level) = (record.time[k], simulator.levels()[vessel]);
            match (variable, before) {
                (Variable::Level, _) => values.push(level),
                // The net inflow, as the mean over the sampling interval.
                (_, Some((t0, level0))) => values.push(area * (level - level0) / (t - t0)),
                _ => {}
            }
            before = Some((t, level));
            if k + 1 < record.len() {
                simulator.advance_both(commands(record, k), record.time[k + 1] - t);
            }
        }
    }
    values.sort_unstable_by(f64::total_cmp);
    Ok(values)
}

/// Knots over the visited range: a compromise between equal distances and equal numbers of samples.
pub(super) fn knots(sorted: &[f64]) -> Vec<f64> {
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    let (low, high) = (at(0.002), at(0.998));
    let room = 0.02 * (high - low);
    let mut knots: Vec<f64> = Vec::with_capacity(KNOTS);
    for i in 0..KNOTS {
        let share = i as f64 / (KNOTS - 1) as f64;
        let knot = 0.5 * (low + share * (high - low)) + 0.5 * at(0.002 + 0.996 * share);
        if knots.last().is_none_or(|last| knot - last > room) {
            knots.push(knot);
        }
    }
    knots
}
