//! Whether a minimum is the lowest: it is held against those that other starts reach.

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

/// The node's minimum against those that so many starts around it reach.
pub(crate) fn around(node: &mut Node, count: usize, noise: &Noise, seed: u64) -> Result<(), Error> {
    let mut starts = starts_around(&node.setup, &node.fit.x, count, seed);
    // Every line of a spectrum is a minimum of its own, and so is every step of a reading; the strongest was picked: the starts
    // stay on it.
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

/// The node's minimum against those that each of these effects of it reaches from its own starts, beside the others as they
/// are.
///
/// While a set grows, an effect takes the place that is free. On the measured Cascaded Tanks data that is a leak a little
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

/// Follows the starts down as long as they promise to come as low as the node's minimum.
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
