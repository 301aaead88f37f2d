//! The trail: the believed model, then one effect after the other, so that the error can be watched falling.

use ct_signals::ArModel;
use greybox::{Fit, Start, fit_onward, starts_around};
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error,
    node::{FINE, Node, ROUGH, refine},
    proposal::place,
};

/// The parameter that has as many minima as a spectrum has lines.
const PERIOD: &str = "periodic_disturbance.period";
/// Further starts of every step: its minimum must not hang on where the search came from.
const STARTS_AROUND: usize = 12;
/// Rounds of as many more where the last model's minimum was not found twice.
const MORE_ROUNDS: u64 = 3;
/// After one rough fit, a second one and a third one, so many times the least cost is out of reach of its minimum.
const HOPELESS: [f64; 3] = [1.5, 1.15, 1.05];

/// The believed model, then one effect after the other, first what lowers the error most.
pub(crate) fn trail<'a>(
    base: &Node<'a>,
    last: &Node<'a>,
    noise: &ArModel,
) -> Result<Vec<Node<'a>>, Error> {
    let mut trail = vec![refine(base, noise, &[])?];
    trail[0].fit = trail[0].fit.clone().continuing(&base.fit);
    for k in 0..last.added.len() {
        let parent = &trail[k];
        let remaining = last.added.iter().filter(|on| !parent.added.contains(on));
        let nodes: Vec<Node> = remaining
            .copied()
            .collect::<Vec<Placed>>()
            .into_par_iter()
            .filter_map(|placed| place(parent, placed, last, noise, ROUGH))
            .collect();
        let least = |a: &Node, b: &Node| a.fit.rmse.total_cmp(&b.fit.rmse);
        let Some(first) = nodes.into_iter().min_by(least) else {
            break;
        };
        let mut node = refine(&first, noise, &[])?;
        // The end of the search has no vote: how often its minimum is found is counted over the starts around it.
        (node.fit.starts, node.fit.agree) = (0, 0);
        around(&mut node, noise, k as u64)?;
        // The model that names the effects is held to the same as the believed one: its minimum is to be found twice.
        for round in 1..=MORE_ROUNDS {
            if k + 1 == last.added.len() && node.fit.agree < 2 {
                around(&mut node, noise, 100 + round)?;
            }
        }
        trail.push(node);
    }
    Ok(trail)
}

/// The node's minimum against those that starts around it reach.
fn around(node: &mut Node, noise: &ArModel, seed: u64) -> Result<(), Error> {
    let mut starts = starts_around(&node.setup, &node.fit.x, STARTS_AROUND, seed);
    // Every line of a spectrum is a minimum of its own, and the strongest was picked: the starts stay on it.
    let names = node.setup.names();
    if let Some(period) = names.iter().position(|name| name == PERIOD) {
        for start in &mut starts {
            start[period] = node.fit.x[period];
        }
    }
    let mut starts: Vec<Start> = starts.into_iter().map(Start::from).collect();
    for hopeless in HOPELESS {
        let rough: Vec<Fit> = starts
            .into_par_iter()
            .filter_map(|start| fit_onward(&node.setup, vec![start], noise, ROUGH).ok())
            .collect();
        // What is far behind by then ends elsewhere.
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
        node.fit.starts += STARTS_AROUND;
        return Ok(());
    }
    let mut fit = fit_onward(&node.setup, starts, noise, FINE)?;
    fit.starts = STARTS_AROUND;
    node.fit = node.fit.clone().or_better(fit);
    Ok(())
}
