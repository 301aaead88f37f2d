//! Sets of many effects: one effect at a time, from several small sets, and swaps within the best (floating search).
//!
//! **Reference**: P. Pudil, J. Novovicova, J. Kittler, Floating search methods in feature selection, Pattern Recognition Letters 15 (1994)
//! 1119-1125.

use greybox::Noise;
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        criterion::BIC_MARGIN,
        node::{FINE, Node, ROUGH, best_first, refine, without},
        proposal::realise_all,
    },
    search::growth::{Grown, PAIR, by_clock, extensions},
};

/// Number of sets of two effects, and of three, each of which is extended.
const SEEDS: usize = 3;
/// Number of effects that are refitted for each extension, those with the largest predicted reduction.
const FOLLOWED: usize = 10;

/// Larger sets, grown one effect at a time from each of the best small ones, the best of them improved by swaps.
///
/// Among small sets that explain nearly the same part of a residual, the right one need not be the best while other effects are missing:
/// each set is extended separately. On the measured Cascaded Tanks data a leak of the lower tank replaces the pump's dead zone, until the
/// end of the sensor's range is in the set. While effects are missing, a size may also reach a bound: the set without such effects is
/// extended and improved by swaps again, within all bounds.
pub(crate) fn follow<'a>(
    base: &Node<'a>,
    grown: &mut Grown<'a>,
    noise: &Noise,
    most: usize,
) -> Result<(), Error> {
    let seeds: Vec<Node<'a>> = (PAIR..grown.sizes.len())
        .flat_map(|size| {
            let timeless = grown.sizes[size].iter().filter(|node| !by_clock(node));
            timeless.take(SEEDS).cloned()
        })
        .collect();
    let loose = Floating {
        base,
        noise,
        most,
        accepted: |node| node.possible(),
    };
    let strict = Floating {
        accepted: |node| node.plausible(),
        ..loose
    };
    let mut ends = seeds
        .into_par_iter()
        .map(|seed| loose.one_at_a_time(seed))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(end) = best_first(ends.clone()).into_iter().next() {
        ends.push(loose.exchanged(end)?);
    }
    let ends = ends
        .into_par_iter()
        .map(|end| within_bounds(&end, noise))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(end) = best_first(ends).into_iter().next() {
        let end = strict.exchanged(strict.one_at_a_time(end)?)?;
        grown.take_in(within_bounds(&end, noise)?);
    }
    Ok(())
}

/// A converged set without the effects whose sizes end at a bound.
fn within_bounds<'a>(node: &Node<'a>, noise: &Noise) -> Result<Node<'a>, Error> {
    let mut node = refine(node, noise, &[])?;
    let at_the_edge = |node: &Node| node.added.iter().position(|on| node.at_the_edge(*on));
    while let Some(position) = at_the_edge(&node) {
        node = without(&node, position, noise, FINE)?;
    }
    Ok(node)
}

/// Start sets of the search, and the accepted ones.
#[derive(Clone, Copy)]
struct Floating<'n, 'a> {
    base: &'n Node<'a>,
    noise: &'n Noise,
    /// Largest number of effects.
    most: usize,
    accepted: fn(&Node<'a>) -> bool,
}

impl<'a> Floating<'_, 'a> {
    /// A set extended by one effect at a time, as long as the criterion falls.
    fn one_at_a_time(&self, mut node: Node<'a>) -> Result<Node<'a>, Error> {
        while node.added.len() < self.most && !node.setup.leaves_out("larger sets of effects") {
            match better_than(&node, self.extended(&node, None)?) {
                Some(best) => node = best,
                None => break,
            }
        }
        Ok(node)
    }

    /// Swaps one effect of a set for another, one at a time, as long as the criterion falls.
    fn exchanged(&self, mut node: Node<'a>) -> Result<Node<'a>, Error> {
        while !node.setup.leaves_out("swaps within sets of effects") {
            let others = (0..node.added.len())
                .into_par_iter()
                .map(|position| {
                    let lacking = without(&node, position, self.noise, ROUGH)?;
                    self.extended(&lacking, Some(node.added[position]))
                })
                .collect::<Result<Vec<_>, Error>>()?;
            match better_than(&node, others.concat()) {
                Some(best) => node = self.one_at_a_time(best)?,
                None => break,
            }
        }
        Ok(node)
    }

    /// A set with one more effect, each of the best that are no functions of time, except the one that was removed.
    fn extended(&self, node: &Node<'a>, taken_out: Option<Placed>) -> Result<Vec<Node<'a>>, Error> {
        let mut proposals = extensions(self.base, std::slice::from_ref(node), 1, self.noise)?;
        proposals.retain(|proposal| {
            let added = proposal.added.last();
            added.is_some_and(|placed| Some(*placed) != taken_out && !placed.effect.by_clock)
        });
        proposals.truncate(FOLLOWED);
        let mut found = realise_all(proposals, self.noise, ROUGH);
        found.retain(self.accepted);
        Ok(found)
    }
}

/// The best of the sets, if its criterion is clearly below that of the model.
fn better_than<'a>(node: &Node, sets: Vec<Node<'a>>) -> Option<Node<'a>> {
    let best = best_first(sets).into_iter().next();
    best.filter(|best| best.gain_over(node) > BIC_MARGIN)
}
