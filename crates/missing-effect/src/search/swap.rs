//! Swap steps: sets in which one effect replaces another.

use greybox::Noise;
use plants::{Placed, Unit};
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        node::{FINE, Node, QUICK, ROUGH, best_first, fitted, refine, transfer, without},
        proposal::{Parent, Proposal, candidates, predicted_fall, propose, realise},
    },
};

/// A rough fit within this distance of the criterion may come within a group's margin.
pub(crate) const NEAR: f64 = 25.0;
/// Number of alternatives that are refitted for each effect: this many by predicted reduction, and this many after a few iterations.
const SWAPPED: usize = 12;
/// In larger sets half as many alternatives are refitted, and fewer for a few iterations, because a fit takes several times as long.
const LARGE: usize = 2;
const QUICKLY: usize = 16;
/// A swap that is worse by more than this share of an effect's own gain after a few steps is dropped.
const OUT_OF_REACH: f64 = 0.5;

/// Swap steps: the set with one of its effects replaced by each other candidate, refitted, best first.
///
/// `singles`: all single effects, fitted with the same noise model. They contain the swaps of a single effect.
pub(crate) fn swaps<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &Noise,
    singles: Option<&[Node<'a>]>,
) -> Result<Vec<Node<'a>>, Error> {
    if node.setup.leaves_out("swaps of confirmed effects") {
        return Ok(Vec::new());
    }
    let lacking = without(node, position, noise, FINE)?;
    let own = node.added[position];
    let reach = (4.0 * NEAR).max(OUT_OF_REACH * lacking.gain_over(node).abs());
    let begun = match singles {
        Some(singles) if node.added.len() == 1 => singles
            .iter()
            .filter(|single| single.added.last() != Some(&own))
            .cloned()
            .collect(),
        _ => begin_swaps(&lacking, node, own, noise),
    };
    let nodes = begun
        .into_par_iter()
        .filter_map(|begun| {
            let carried = carried(node, own, &begun);
            let near = carried.is_some() || node.gain_over(&begun) < reach;
            near.then(|| fitted(&begun, noise, ROUGH, carried.as_slice()).ok())?
        })
        .map(|rough| {
            // Alternatives near the margin are fitted to convergence: the margin is finer than the accuracy of a rough fit.
            if rough.fit.bic() - node.fit.bic() < NEAR {
                refine(&rough, noise, &[]).unwrap_or(rough)
            } else {
                rough
            }
        })
        .collect();
    Ok(best_first(nodes))
}

/// A start of an alternative whose size is of the same kind as that of the effect that it replaces: the same size.
///
/// What a lag of the pump is to the sensor's, a time constant that the data determine: from a grid of starts, with two more in
/// the tanks to get out of its way, a fit creeps towards it.
fn carried(node: &Node, own: Placed, stand_in: &Node) -> Option<Vec<f64>> {
    let added = *stand_in.added.last()?;
    let (from, at) = node.size_of(own)?;
    let (to, into) = stand_in.size_of(added)?;
    if from.unit != to.unit || from.unit == Unit::ONE {
        return None;
    }
    let mut x = transfer(node, &stand_in.setup);
    x[into] = node.fit.x[at].clamp(to.lower, to.upper);
    // The other parameters of the alternative keep their values.
    for (name, (value, fitted)) in stand_in
        .setup
        .names()
        .iter()
        .zip(x.iter_mut().zip(&stand_in.fit.x))
    {
        if !node.setup.names().contains(name) && *value == 0.0 {
            *value = *fitted;
        }
    }
    Some(x)
}

/// First fits of the candidates that may replace an effect; `lacking` is the node without it.
fn begin_swaps<'a>(
    lacking: &Node<'a>,
    node: &Node<'a>,
    own: Placed,
    noise: &Noise,
) -> Vec<Node<'a>> {
    let from = Parent::new(lacking);
    let mut proposals: Vec<Proposal> = candidates(lacking)
        .into_par_iter()
        .filter(|placed| *placed != own)
        .filter_map(|placed| {
            let mut proposal = propose(&from, placed, noise)?;
            proposal.starts.truncate(1);
            // In the model without the effect, the other parameters have changed to compensate for it, and a fit from there may miss the
            // minimum. With an equivalent alternative, the parameters have nearly the values that they have with the effect.
            if let Some((predicted, starts)) = predicted_fall(node, &proposal.setup, placed, noise)
            {
                proposal.starts.extend(starts.into_iter().take(1));
                proposal.predicted = proposal.predicted.min(predicted);
            }
            Some(proposal)
        })
        .collect();
    proposals.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
    let refitted = if lacking.added.len() < LARGE {
        SWAPPED
    } else {
        proposals.truncate(QUICKLY);
        SWAPPED / 2
    };
    // The predicted reduction is linear: with nonlinear parameters such as a time constant or a threshold, only a few iterations show the
    // actual reduction. If parameters are nearly collinear, a few iterations are too few, and the predicted reduction is used.
    let mut begun: Vec<(usize, Node)> = proposals
        .into_par_iter()
        .enumerate()
        .filter_map(|(predicted, proposal)| Some((predicted, realise(proposal, noise, QUICK)?)))
        .collect();
    begun.sort_by(|a, b| a.1.fit.bic().total_cmp(&b.1.fit.bic()));
    begun
        .into_iter()
        .enumerate()
        .filter(|(quick, (predicted, _))| *quick < refitted || *predicted < refitted)
        .map(|(_, (_, begun))| begun)
        .collect()
}
