//! Error ladder: the believed model, then one effect after the other, so that the fall of the error is visible.

use greybox::Noise;
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        minima::around,
        node::{Node, ROUGH, refine},
        proposal::place,
    },
};

/// Further starts of every step, because its minimum must not depend on the path of the search: this many, ...
const STARTS_AROUND: usize = 6;
/// ... and the same number again until the minimum is found twice; largest number of rounds for intermediate models and for the last one.
/// The model that names the effects has to meet the same condition as the believed one.
const ROUNDS: (u64, u64) = (2, 4);

/// The believed model, then one effect after the other, each time the one that lowers the error most.
pub(crate) fn ladder<'a>(
    base: &Node<'a>,
    last: &Node<'a>,
    noise: &Noise,
) -> Result<Vec<Node<'a>>, Error> {
    let mut ladder = vec![refine(base, noise, &[])?];
    ladder[0].fit = ladder[0].fit.clone().continuing(&base.fit);
    for k in 0..last.added.len() {
        let parent = &ladder[k];
        let remaining = last.added.iter().filter(|on| !parent.added.contains(on));
        let nodes: Vec<Node> = remaining
            .copied()
            .collect::<Vec<Placed>>()
            .into_par_iter()
            .filter_map(|placed| place(parent, placed, last, noise, ROUGH))
            .collect();
        let least = |a: &Node, b: &Node| a.fit.mean_rmse().total_cmp(&b.fit.mean_rmse());
        let Some(first) = nodes.into_iter().min_by(least) else {
            break;
        };
        let mut node = refine(&first, noise, &[])?;
        // Starts from the search are not counted: how often the minimum is found is counted over the starts around it.
        (node.fit.starts, node.fit.agree) = (0, 0);
        let rounds = if k + 1 == last.added.len() {
            ROUNDS.1
        } else {
            ROUNDS.0
        };
        for round in 0..rounds {
            if node.fit.agree < 2 && !node.setup.leaves_out("further starts of the final models") {
                around(&mut node, STARTS_AROUND, noise, 100 * k as u64 + round)?;
            }
        }
        ladder.push(node);
    }
    // If the time limit is reached, intermediate models may have a higher cost than the final set.
    if let Some(end) = ladder.last_mut()
        && end.added.len() == last.added.len()
        && end.added.iter().all(|placed| last.added.contains(placed))
    {
        let known = refine(last, noise, &[])?;
        if known.fit.cost < end.fit.cost {
            end.fit = known.fit.continuing(&end.fit);
            end.setup = known.setup;
        }
    }
    Ok(ladder)
}
