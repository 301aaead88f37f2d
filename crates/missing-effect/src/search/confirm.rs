//! Backward elimination: removes effects of a set that the noise explains as well.

use greybox::Noise;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        criterion::{BIC_MARGIN, beyond_chance},
        node::{FINE, Node, best_first, without},
    },
    search::swap::{NEAR, swaps},
};

/// Number of the best swap steps that are refitted; ...
const EXCHANGES: usize = 6;
/// ... a swap to the same number of effects is accepted if the criterion falls by this.
const CLEARLY: f64 = 1.0;

/// Removes, one by one, effects that the noise explains as well, the least significant first.
pub(crate) fn confirm<'a>(mut node: Node<'a>, noise: &Noise) -> Result<Node<'a>, Error> {
    loop {
        // Each effect is tested with a share of the significance level: a significant weakest effect does not imply that the others are
        // significant.
        let lacking = each_lacking(&node, noise)?.into_iter();
        let doubtful = lacking.filter(|lacking| {
            node.gain_over(lacking) <= BIC_MARGIN || !beyond_chance(&node, lacking)
        });
        let Some(least) = least_bic(doubtful) else {
            return Ok(node);
        };
        node = least;
    }
}

/// Swaps effects for others while this makes another effect superfluous, or lowers the criterion.
///
/// Among sets that explain the same part of a residual the search extends one, and a nearly right effect needs a further effect as a
/// correction: on the emulated rig of a closed loop a raised outlet replaced the pump's dead zone, and a nonlinear pump the difference.
/// With the dead zone the nonlinearity is not needed.
pub(crate) fn improve<'a>(mut node: Node<'a>, noise: &Noise) -> Result<Node<'a>, Error> {
    // Every round ends with fewer effects, or with a lower criterion for the same number.
    while node.added.len() > 1 {
        let mut others: Vec<Node<'a>> = (0..node.added.len())
            .into_par_iter()
            .map(|position| swaps(&node, position, noise, None))
            .collect::<Result<Vec<_>, _>>()?
            .concat();
        others.retain(|other| other.gain_over(&node) > -NEAR && other.plausible());
        let mut others = best_first(others);
        others.truncate(EXCHANGES);
        let others = others
            .into_par_iter()
            .map(|other| confirm(other, noise))
            .collect::<Result<Vec<_>, _>>()?;
        let better = |other: &Node| {
            let margin = if other.added.len() < node.added.len() {
                BIC_MARGIN
            } else {
                -CLEARLY
            };
            other.fit.bic() - node.fit.bic() < margin
        };
        let Some(best) = others
            .into_iter()
            .filter(|other| other.added.len() <= node.added.len() && better(other))
            .min_by(|a, b| {
                let key = |node: &Node| (node.added.len(), node.fit.bic());
                key(a)
                    .partial_cmp(&key(b))
                    .unwrap_or(std::cmp::Ordering::Equal)
            })
        else {
            break;
        };
        node = best;
    }
    Ok(node)
}

/// The model without the effect whose removal costs least; `None` without effects.
pub(crate) fn least_useful<'a>(node: &Node<'a>, noise: &Noise) -> Result<Option<Node<'a>>, Error> {
    Ok(least_bic(each_lacking(node, noise)?.into_iter()))
}

/// The node without each of its effects.
fn each_lacking<'a>(node: &Node<'a>, noise: &Noise) -> Result<Vec<Node<'a>>, Error> {
    (0..node.added.len())
        .into_par_iter()
        .map(|position| without(node, position, noise, FINE))
        .collect()
}

fn least_bic<'a>(nodes: impl Iterator<Item = Node<'a>>) -> Option<Node<'a>> {
    nodes.min_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()))
}
