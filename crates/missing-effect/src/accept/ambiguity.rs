//! Tests of a confirmed set of effects against alternatives: AR noise alone, a level shift of the reading, and a function of time.

use greybox::{Fit, coloured};
use rayon::prelude::*;

use crate::{
    Error,
    accept::{
        groups::NEARLY,
        level_shift::{LevelShift, level_shift},
        random_walk::{Walk, beyond_random_walk},
    },
    diagnostics::residual_tests::not_noise,
    fit::{
        criterion::{BIC_MARGIN, beyond_chance},
        node::{FINE, Node, ROUGH, STOPPING, best_first, fitted, refine, without, without_clock},
        noise_model::NOISE_ORDER,
    },
    search::{confirm::confirm, find::Found, growth::by_clock},
};

/// Result of the comparison with alternatives.
pub(crate) struct AmbiguityResult<'a> {
    pub confirmed: Node<'a>,
    /// The believed model with a noise model fitted to its own residual.
    pub own_base: Fit,
    /// The level shift that explains more than the confirmed set.
    pub shifted: Option<LevelShift>,
}

/// Removes from the confirmed set what a simpler explanation covers as well; `in_loop`: the records come from a loop that is not simulated.
pub(crate) fn remove_ambiguous<'a>(
    base: &Node<'a>,
    found: &Found<'a>,
    in_loop: bool,
) -> Result<AmbiguityResult<'a>, Error> {
    let noise = &found.noise;
    let mut confirmed = found.confirmed.clone();
    // Each model has a noise model of its own residual: an error that coloured noise explains needs no effect. The largest model explains a
    // part of a slow noise by effects, so the noise model of its residual is too fast; chance is also evaluated with the own noise models.
    let own = |node: &Node<'a>| coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING);
    let (own_base, own_last) = rayon::join(|| own(base), || own(&confirmed));
    let (own_base, own_last) = (own_base?, own_last?);
    let in_own = |node: &Node<'a>, fit: &Fit| Node {
        fit: fit.clone(),
        ..node.clone()
    };
    let (bare, rich) = (in_own(base, &own_base), in_own(&confirmed, &own_last));
    let needed_in_own_noise = rich.gain_over(&bare) >= BIC_MARGIN && beyond_chance(&rich, &bare);
    if !confirmed.added.is_empty() && !needed_in_own_noise {
        confirmed = found.base.clone();
    }
    // A set of effects has to be better than the simplest course that no effect causes.
    let shifted = if confirmed.added.is_empty() {
        None
    } else {
        level_shift(&found.base, noise)?.filter(|shift| shift.bic < confirmed.fit.bic())
    };
    if shifted.is_some() {
        confirmed = found.base.clone();
    }
    // Slow noise also biases gains and saturations, because their inputs are slow.
    let beyond_small_walk = |node: &Node| {
        Ok::<_, Error>(
            node.added.is_empty() || beyond_random_walk(node, base, Walk::SMALL_FROM_ZERO)?,
        )
    };
    if !beyond_small_walk(&confirmed)? {
        confirmed = found.base.clone();
    }
    // Drifts, oscillations and steps fit disturbances of any origin. They are accepted only if their residual is noise, if a random walk
    // does not explain as much, and if the other effects of the set are significant without them: an effect that only corrects a wrong one
    // is not. With a white residual this test is not needed, because a wrong explanation hardly ever leaves white noise.
    if by_clock(&confirmed) {
        let others = without_clock(&confirmed, noise)?;
        let count = others.added.len();
        let by_walk = !(beyond_random_walk(&confirmed, &others, Walk::ANY)?
            && beyond_random_walk(&confirmed, &others, Walk::SMALL)?);
        let white = own_last.noise.order() == 0;
        let others = confirm(others, noise)?;
        if by_walk
            || (others.added.len() < count && !white)
            || not_noise(&confirmed, &own_last)?.is_some()
        {
            confirmed = others;
        }
    }
    if in_loop {
        if let Some(position) = confirmed.narrow_stiction() {
            confirmed = confirm(without(&confirmed, position, noise, FINE)?, noise)?;
        }
        if by_clock(&confirmed)
            && let Some(simpler) = simpler(&confirmed, found)
        {
            confirmed = simpler;
        }
    }
    // If the set became smaller since, the earlier comparison is not valid any more.
    if !beyond_small_walk(&confirmed)? {
        confirmed = found.base.clone();
    }
    Ok(AmbiguityResult {
        confirmed,
        own_base,
        shifted,
    })
}

/// The best smaller set without effects that follow time alone, if all its effects are significant, its residual is noise, and its error is
/// nearly as small; `None` if there is none.
///
/// In a loop the command depends on every disturbance, and the likelihood of a model that runs on the measured command is biased by as much
/// as a few effects gain. A sticking valve can then be replaced by a saturating pump and an outlet that changes at the instant of a slip:
/// free instants and limits fit the noise better than the physical law of the valve.
fn simpler<'a>(confirmed: &Node<'a>, found: &Found<'a>) -> Option<Node<'a>> {
    if confirmed
        .setup
        .leaves_out("smaller sets as alternatives to the confirmed one")
    {
        return None;
    }
    let noise = &found.noise;
    let nearly = |node: &Node| node.fit.cost < NEARLY * confirmed.fit.cost;
    let called_for = |node: &Node| {
        node.gain_over(&found.base) > BIC_MARGIN
            && beyond_chance(node, &found.base)
            && confirm(node.clone(), noise).is_ok_and(|kept| kept.added.len() == node.added.len())
    };
    let leaves_noise = |node: &Node| {
        let own = coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING);
        own.is_ok_and(|own| not_noise(node, &own).is_ok_and(|left| left.is_none()))
    };
    let sizes = 1..confirmed.added.len();
    let smaller: Vec<Node> = found
        .sets()
        .into_par_iter()
        .filter(|node| sizes.contains(&node.added.len()) && !by_clock(node))
        .filter_map(|node| fitted(node, noise, ROUGH, &[]).ok())
        .filter(|node| nearly(node))
        .filter_map(|node| refine(&node, noise, &[]).ok())
        .collect();
    best_first(smaller).into_iter().find(|node| {
        nearly(node)
            && node.plausible()
            && node.narrow_stiction().is_none()
            && called_for(node)
            && leaves_noise(node)
    })
}
