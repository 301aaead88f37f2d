//! Sets of many effects: one effect at a time, from several small sets, and exchanges within the best (floating search).
//!
//! **Reference**: P. Pudil, J. Novovicova, J. Kittler, Floating search methods in feature selection, Pattern Recognition Letters 15 (1994)
//! 1119-1125.

use ct_signals::ArModel;
use rayon::prelude::*;

use crate::{
    Error,
    confirm::BIC_MARGIN,
    node::{Node, ROUGH, best_first, refine, roughly_without, without},
    proposal::realise_all,
    search::{Grown, PAIR, by_clock, extensions},
};

/// Sets of two effects, and of three, from each of which one is grown.
const SEEDS: usize = 3;
/// Effects that are refitted for each more, the most promising.
const FOLLOWED: usize = 10;

/// Larger sets, grown one effect at a time from each of the best small ones, the best of them improved by exchanges.
///
/// Of small sets that take nearly the same out of a residual, the one that is right is not the best as long as much is missing: each is
/// followed for itself. On the measured Cascaded Tanks data a leak of the lower tank stands for the pump's dead zone, until the end of
/// the sensor's range is in the set.
pub(crate) fn follow<'a>(
    base: &Node<'a>,
    grown: &mut Grown<'a>,
    noise: &ArModel,
    most: usize,
) -> Result<(), Error> {
    let seeds: Vec<Node<'a>> = (PAIR..grown.sizes.len())
        .flat_map(|size| {
            let timeless = grown.sizes[size].iter().filter(|node| !by_clock(node));
            timeless.take(SEEDS).cloned()
        })
        .collect();
    let ends = seeds
        .into_par_iter()
        .map(|seed| one_at_a_time(base, seed, noise, most))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(end) = best_first(ends).into_iter().next() {
        grown.take_in(within_bounds(exchanged(base, end, noise, most)?, noise)?);
    }
    Ok(())
}

/// A set, fitted to the end, without the effects whose sizes end at a bound.
fn within_bounds<'a>(node: Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    let mut node = refine(&node, noise, &[])?;
    let at_the_edge = |node: &Node| node.added.iter().position(|on| node.at_the_edge(*on));
    while let Some(position) = at_the_edge(&node) {
        node = without(&node, position, noise)?;
    }
    Ok(node)
}

/// A set with one effect more, and one more, as long as that pays.
fn one_at_a_time<'a>(
    base: &Node<'a>,
    mut node: Node<'a>,
    noise: &ArModel,
    most: usize,
) -> Result<Node<'a>, Error> {
    while node.added.len() < most && !node.setup.leaves_out("larger sets of effects") {
        let mut proposals = extensions(base, std::slice::from_ref(&node), 1, noise)?;
        proposals.retain(|proposal| proposal.added.iter().all(|placed| !placed.effect.by_clock));
        proposals.truncate(FOLLOWED);
        let mut larger = best_first(realise_all(proposals, noise, ROUGH));
        larger.retain(Node::possible);
        match larger.into_iter().next() {
            Some(best) if best.gain_over(&node) > BIC_MARGIN => node = best,
            _ => break,
        }
    }
    Ok(node)
}

/// Exchanges an effect of a set for another, or adds one, as long as that pays.
fn exchanged<'a>(
    base: &Node<'a>,
    mut node: Node<'a>,
    noise: &ArModel,
    most: usize,
) -> Result<Node<'a>, Error> {
    loop {
        if node.setup.leaves_out("exchanges within sets of effects") {
            return Ok(node);
        }
        let others: Vec<Node<'a>> = (0..node.added.len())
            .into_par_iter()
            .map(|position| {
                let own = node.added[position];
                let lacking = roughly_without(&node, position, noise)?;
                let mut proposals = extensions(base, std::slice::from_ref(&lacking), 1, noise)?;
                proposals.retain(|proposal| {
                    let added = proposal.added.last();
                    added.is_some_and(|placed| *placed != own && !placed.effect.by_clock)
                });
                proposals.truncate(FOLLOWED);
                Ok(realise_all(proposals, noise, ROUGH))
            })
            .collect::<Result<Vec<_>, Error>>()?
            .concat();
        let mut others = best_first(others);
        others.retain(Node::possible);
        let best = others.into_iter().next();
        let best = best.filter(|best| best.gain_over(&node) > BIC_MARGIN);
        let Some(best) = best else {
            return Ok(node);
        };
        node = one_at_a_time(base, best, noise, most)?;
    }
}
