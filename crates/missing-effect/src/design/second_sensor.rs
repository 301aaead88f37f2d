//! What a sensor in the other tank would add: its level measured too, with the same noise.

use ct_signals::Record;
use greybox::{Setup, Triangle, at_rest, commands};
use plants::{Outlet, Plant, Simulator};

use super::{
    play::Played,
    separation::{Metric, imagined, least, unlooped, vector},
};
use crate::node::Node;

/// Step of a central difference, as a part of the value or of the typical size of its like.
const STEP: f64 = 1e-5;

/// The vessel that it would stand in: the first one, or the last where the first is the measured one.
pub(crate) fn place(plant: Plant, measured: usize) -> usize {
    if measured == 0 {
        plant.vessels() - 1
    } else {
        0
    }
}

/// The level of that vessel at every sample.
fn other_level(setup: &Setup, x: &[f64]) -> Option<Vec<Vec<f64>>> {
    let theta = &x[..setup.parameter_count()];
    let other = place(setup.structure.plant, setup.structure.scales.measured);
    let run = |(r, record): (usize, &Record)| {
        let n = record.len();
        let states = &x[setup.plant_states_of(r)];
        let mut simulator =
            Simulator::<f64>::with_inputs(&setup.structure, theta, states, at_rest(record)).ok()?;
        simulator.set_substeps(setup.substeps);
        let mut levels = Vec::with_capacity(n);
        for k in 0..n {
            levels.push(simulator.levels()[other]);
            simulator.read();
            if k + 1 < n {
                let h = record.time[k + 1] - record.time[k];
                simulator.advance_both(commands(record, k), h);
            }
        }
        Some(levels)
    };
    setup.records.iter().enumerate().map(run).collect()
}

/// The rows of the sensor that there is and of the one that there might be, `truth` what the latter shows.
///
/// Where the areas are not known, a level of the other tank is known in units of its own alone: then its sensor's scale and zero are
/// fitted too.
fn rows(setup: &Setup, x: &[f64], truth: &[Vec<f64>], metric: &Metric) -> Option<Triangle> {
    let free = setup.free();
    let structure = &setup.structure;
    let known = structure.plant.outlet() == Outlet::Torricelli && structure.known.area[0].is_some();
    let own = free.len();
    let columns = own + if known { 0 } else { 2 } + 1;
    let level = other_level(setup, x)?;
    let size = structure.scales.largest_level();
    let mut derivatives = Vec::with_capacity(own);
    for &i in free {
        let step = STEP
            * if x[i] == 0.0 {
                size.max(1e-3)
            } else {
                x[i].abs()
            };
        let at = |moved: f64| {
            let mut x = x.to_vec();
            x[i] += moved;
            other_level(setup, &x)
        };
        let (above, below) = (at(step)?, at(-step)?);
        let difference = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter()
                .zip(b)
                .map(|(a, b)| (a - b) / (2.0 * step))
                .collect()
        };
        derivatives.push(above.iter().zip(&below).map(difference).collect::<Vec<_>>());
    }
    let measured = setup.rows(x)?;
    let mut triangle = Triangle::new(columns);
    let mut whitener = metric.noise.whitener(columns);
    let mut row = vec![0.0; columns];
    for (r, record) in measured.records().enumerate() {
        whitener.reset();
        for values in record.chunks_exact(own + 1) {
            row.fill(0.0);
            row[..own].copy_from_slice(&values[..own]);
            row[columns - 1] = values[own];
            whitener.push(&mut row);
            triangle.push(&row);
        }
        whitener.reset();
        for k in 0..level[r].len() {
            row.fill(0.0);
            for (to, derivative) in row.iter_mut().zip(&derivatives) {
                *to = derivative[r][k];
            }
            if !known {
                (row[own], row[own + 1]) = (level[r][k], 1.0);
            }
            row[columns - 1] = truth[r][k] - level[r][k];
            if !row.iter().all(|value| value.is_finite()) {
                return None;
            }
            whitener.push(&mut row);
            triangle.push(&row);
        }
    }
    triangle.finish();
    Some(triangle)
}

/// The separation in records like the existing ones, with the other level measured too.
pub(crate) fn in_existing(truth: &Node, stand_in: &Node, metric: &Metric) -> Option<f64> {
    let records = imagined(truth).ok()?;
    let own = truth.setup.with_records(&records).ok()?;
    let shown = other_level(&own, &unlooped(truth))?;
    let setup = stand_in.setup.with_records(&records).ok()?;
    let rows = rows(&setup, &unlooped(stand_in), &shown, metric)?;
    Some(least(&rows, &Triangle::new(0)) / metric.variance)
}

/// The separation in an experiment that was played on the truth, with the other level measured too.
pub(crate) fn in_experiment(
    played: &Played,
    truth: &Node,
    stand_in: &Node,
    known: &Triangle,
    metric: &Metric,
) -> Option<f64> {
    let records = std::slice::from_ref(&played.record);
    let own = truth.setup.with_records(records).ok()?;
    let shown = other_level(&own, &vector(truth, &own, played))?;
    let setup = stand_in.setup.with_records(records).ok()?;
    let rows = rows(&setup, &vector(stand_in, &setup, played), &shown, metric)?;
    Some(least(&rows, known) / metric.variance)
}
