//! Tests whether a minimum is the lowest, by comparison with the minima from other starts.

use greybox::{Fit, Noise, Start, fit_onward, keep_best_simulated, starts_around};
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        hidden_step::step_of,
        node::{FINE, Node, ROUGH},
        period::period_of,
        starts::grid,
    },
};

/// After a first, second and third rough fit, a minimum is hopeless if the cost exceeds the least cost by this factor.
const HOPELESS: [f64; 3] = [1.5, 1.15, 1.05];

/// Compares the minimum with those from this number of starts around it.
pub(crate) fn around(node: &mut Node, count: usize, noise: &Noise, seed: u64) -> Result<(), Error> {
    let mut starts = starts_around(&node.setup, &node.fit.x, count, seed);
    // Every spectral line is a separate minimum, and so is every quantisation step; the strongest was selected, and the starts keep it.
    for picked in [period_of(&node.setup), step_of(&node.setup)]
        .into_iter()
        .flatten()
    {
        for start in &mut starts {
            start[picked] = node.fit.x[picked];
        }
    }
    descend(node, starts, noise)
}

/// Compares the minimum with those that each of these effects reaches from its own starts, the other effects unchanged.
///
/// While a set grows, an effect first explains the remaining error. On the measured Cascaded Tanks data that is a leak a little
/// below the rim; once the sensor's play and limit are there, one near the bottom lowers the error by an eighth.
pub(crate) fn begun_again(node: &mut Node, effects: &[Placed], noise: &Noise) -> Result<(), Error> {
    let starts = effects.iter();
    let starts = starts.flat_map(|placed| {
        let mut starts = grid(node, &node.setup, *placed);
        keep_best_simulated(&node.setup, *placed, &mut starts, noise);
        starts
    });
    let starts = starts.collect();
    descend(node, starts, noise)
}

/// Continues the starts while they may reach the minimum.
fn descend(node: &mut Node, starts: Vec<Vec<f64>>, noise: &Noise) -> Result<(), Error> {
    if node.setup.leaves_out("further starts of the final models") {
        return Ok(());
    }
    let count = starts.len();
    let mut starts: Vec<Start> = starts.into_iter().map(Start::from).collect();
    for hopeless in HOPELESS {
        let rough: Vec<Fit> = starts
            .into_par_iter()
            .filter_map(|start| fit_onward(&node.setup, vec![start], noise, ROUGH).ok())
            .collect();
        // Fits far above the least cost end in another minimum.
        let least = rough
            .iter()
            .map(|fit| fit.cost)
            .fold(node.fit.cost, f64::min);
        starts = rough
            .into_iter()
            .filter(|fit| fit.cost <= hopeless * least)
            .map(|fit| Start::at_end(&fit, noise))
            .collect();
    }
    if starts.is_empty() {
        node.fit.starts += count;
        return Ok(());
    }
    let mut fit = fit_onward(&node.setup, starts, noise, FINE)?;
    fit.starts = count;
    node.fit = node.fit.clone().or_better(fit);
    Ok(())
}
