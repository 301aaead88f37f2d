//! The search: a set of effects, and the noise model for its confirmation.

use greybox::Noise;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{
        criterion::BIC_MARGIN,
        minima::begun_again,
        node::{Node, refine},
        noise_model::{bic_in_residual_noise, is_slow, longest_memory, noise_of},
    },
    search::{
        confirm::{confirm, improve, least_useful},
        floating::follow,
        growth::{Breadth, Grown, grow},
        residual_kind::{ResidualKind, residual_kind},
    },
};

/// Number of sets that are extended in parallel, and of refits per size.
const BEAM: usize = 3;
const REFITS: usize = 12;
/// Sets are extended in parallel up to this number of effects, ...
const SIDE_BY_SIDE: usize = 3;
/// ... and one by one up to this number while the criterion falls.
const RICHEST: usize = 6;
/// With a drifting noise model, sets are grown up to this number.
const WANDERING: usize = 2;

/// Result of the search.
pub(crate) struct Found<'a> {
    /// The largest accepted model by simulation error; its residual gives the noise model.
    pub richest: Node<'a>,
    /// The noise model in whose weighting effects are confirmed; its memory is limited.
    pub noise: Noise,
    /// The residual's own noise model has a longer memory, so it may contain slow physics.
    pub limited: bool,
    /// The base, and the confirmed set, with the noise weighting.
    pub base: Node<'a>,
    pub confirmed: Node<'a>,
    /// The sets that were grown by simulation error.
    pub grown: Grown<'a>,
    /// Sets that were grown with the noise model as weighting, if the noise is not white.
    pub prewhitened: Option<Grown<'a>>,
    /// Whether the noise drifts.
    pub slow_noise: bool,
    /// Whether the noise is not white and effects are confirmed: then models are compared and shown by their simulation error.
    pub by_simulation: bool,
}

impl<'a> Found<'a> {
    /// All sets that were grown, with either weighting.
    pub fn sets(&self) -> Vec<&Node<'a>> {
        let grown = std::iter::once(&self.grown).chain(&self.prewhitened);
        grown.flat_map(|grown| &grown.sizes).flatten().collect()
    }
}

/// Searches sets of at most `most` effects, or more if the noise model requires it.
pub(crate) fn find<'a>(
    base: &Node<'a>,
    most: usize,
    tell: &(dyn Fn(&'static str, usize, usize) + Sync),
) -> Result<Found<'a>, Error> {
    let breadth = Breadth {
        beam: BEAM,
        refits: REFITS,
        // More effects may be tried than the result may have: only the residual of the largest model is close to the noise.
        most: most.max(RICHEST),
    };
    let pays = |before: &Node, after: &[Node]| {
        let best = after.first();
        best.is_some_and(|best| best.gain_over(before) > BIC_MARGIN)
    };
    // While the noise model is not known, coloured noise would justify one effect after the other. Therefore the gain is computed with a
    // noise model of each model's own residual. Any set of a size may show the gain: the set with the least simulation error may be rough
    // from sample to sample.
    let lowers_bic = |before: &Node, after: &[Node]| {
        let least = || {
            let all = after.par_iter().map(bic_in_residual_noise);
            let all = all.collect::<Result<Vec<f64>, Error>>()?;
            Ok::<_, Error>(all.into_iter().fold(f64::INFINITY, f64::min))
        };
        let fall = || Ok::<_, Error>(bic_in_residual_noise(before)? - least()?);
        pays(before, after) && fall().is_ok_and(|fall| fall > BIC_MARGIN)
    };
    let white = base.setup.white_noise();
    let mut grown = grow(
        base,
        &white,
        Breadth {
            most: SIDE_BY_SIDE,
            ..breadth
        },
        lowers_bic,
        residual_kind,
        &|done, total| tell("searching sets of effects", done, total),
    )?;
    if grown.goes_on(SIDE_BY_SIDE) {
        follow(base, &mut grown, &white, breadth.most)?;
    }
    let mut richest = refine(&chosen(&grown.sizes, base), &white, &[])?;
    if richest.added.len() > 1 {
        let effects = richest.added.clone();
        begun_again(&mut richest, &effects, &white)?;
    }
    let whole = noise_of(&richest)?;
    let noise = whole.with_memory_at_most(longest_memory(&base.setup));
    let limited = noise != whole;

    // Confirm weighted by the noise model.
    tell("confirming", 0, 3);
    let (base, confirmed) = rayon::join(
        || refine(base, &noise, &[]),
        || confirm(refine(&richest, &noise, &[])?, &noise),
    );
    let (base, mut confirmed) = (base?, confirmed?);
    let slow_noise = is_slow(&richest, &noise);
    let by_simulation = slow_noise && !confirmed.added.is_empty();
    let mut prewhitened = None;
    if noise.order() > 0 && !base.setup.leaves_out("the prewhitened search") {
        // The noise model is known now: the search is repeated with this weighting. A drifting residual needs this too: in the simulation
        // error slow noise resembles many effects, and the true one may not be among the sets that were built. But with such a weighting the
        // simulation may drift, and such sets are not accepted; and it contains little information about many effects.
        let breadth = Breadth {
            most: if by_simulation {
                WANDERING
            } else {
                breadth.most
            },
            ..breadth
        };
        let coloured = grow(
            &base,
            &noise,
            breadth,
            pays,
            // The search with this noise model (that of the set's own residual) has converged, including its pairs.
            |node| {
                if grown.converged_at(node) {
                    Ok(ResidualKind::Noise)
                } else {
                    residual_kind(node)
                }
            },
            &|done, total| tell("searching, prewhitened by the noise model", done, total),
        )?;
        let best = chosen(&coloured.sizes, &base);
        let other = confirm(refine(&best, &noise, &[])?, &noise)?;
        if other.fit.bic() < confirmed.fit.bic()
            && !(by_simulation && drifts_off(&confirmed, &other)?)
        {
            confirmed = other;
        }
        prewhitened = Some(coloured);
    }
    if !by_simulation && !base.setup.leaves_out("swaps of confirmed effects") {
        confirmed = improve(confirmed, &noise)?;
    }
    Ok(Found {
        richest,
        noise,
        limited,
        base,
        confirmed,
        grown,
        prewhitened,
        slow_noise,
        by_simulation,
    })
}

/// The best of all sizes: a larger set must lower the criterion compared with every smaller one.
fn chosen<'a>(sizes: &[Vec<Node<'a>>], base: &Node<'a>) -> Node<'a> {
    sizes
        .iter()
        .skip(1)
        .filter_map(|nodes| nodes.first())
        .fold(base.clone(), |best, node| {
            if node.gain_over(&best) > BIC_MARGIN {
                node.clone()
            } else {
                best
            }
        })
}

/// Whether a set simulates clearly worse than another, by the criterion.
fn drifts_off(before: &Node, after: &Node) -> Result<bool, Error> {
    let white = before.setup.white_noise();
    Ok(refine(before, &white, &[])?.gain_over(&refine(after, &white, &[])?) > BIC_MARGIN)
}

/// The best set with at most this number of effects: a reduction of a set that is too large, or one of the grown sets.
pub(crate) fn shortened<'a>(
    mut node: Node<'a>,
    sizes: &[Vec<Node<'a>>],
    most: usize,
    noise: &Noise,
) -> Result<Node<'a>, Error> {
    while node.added.len() > most {
        let Some(lacking) = least_useful(&node, noise)? else {
            break;
        };
        node = lacking;
    }
    if let Some(grown) = sizes.get(most).and_then(|nodes| nodes.first()) {
        let grown = refine(grown, noise, &[])?;
        if grown.fit.bic() < node.fit.bic() {
            node = grown;
        }
    }
    Ok(node)
}
