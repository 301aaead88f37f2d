//! Fit of the believed model, from many starts.

use std::{collections::BTreeMap, sync::Arc};

use ct_signals::require_samples;
use greybox::{Setup, TimeLimit, fit_from, random_starts};
use rayon::prelude::*;

use super::closed_loop::enclose;
use crate::{
    ControlLoop, Error, Options, Problem,
    fit::{
        minima::begun_again,
        node::{Node, ROUGH, STOPPING},
        proposal::{Parent, propose, realise},
    },
};

/// Share of the time limit in which the best fit follows changed ranges.
const FOLLOW: f64 = 0.1;
/// Random starts of the plant alone, before its effects are added.
const BARE_STARTS: usize = 12;

/// The believed model, fitted to simulation error; its best minimum is found at least twice, or 96 starts were tried. If the loop is known,
/// the model is then fitted in the loop. After this share of the time limit no further start is used.
pub(crate) fn base<'a>(
    problem: &'a Problem,
    options: &Options<'a>,
    share: f64,
) -> Result<(Node<'a>, Option<ControlLoop>), Error> {
    let fixed: BTreeMap<String, f64> = problem
        .fixed
        .iter()
        .filter_map(|name| problem.start.get(name).map(|value| (name.clone(), *value)))
        .collect();
    let without = Setup::from_records(
        problem.plant,
        problem.known.clone(),
        &problem.effects,
        &problem.records,
        BTreeMap::new(),
    )?;
    let structure = problem
        .terms
        .iter()
        .try_fold(without.structure, |structure, term| {
            structure.with_term(term.clone())
        })?;
    let mut setup = Setup::new(structure, &problem.records, fixed)?.with_priors(&problem.priors)?;
    setup.stop = options.stop;
    setup.interrupt = options.interrupt;
    let limit = Arc::new(TimeLimit::new(options.time_limit));
    limit.allow(share);
    setup.time_limit = Some(limit);
    require_samples(&problem.records, setup.free().len())?;
    let white = setup.white_noise();
    let mut starts = options.starts.max(10);
    let one_by_one = one_by_one(&setup, options.seed)?;
    let fit = loop {
        // The start with effects added one by one comes first: if the time limit is reached, no other start is used. It includes the user's
        // guesses of parameters.
        let mut all: Vec<Vec<f64>> = one_by_one.iter().cloned().collect();
        all.extend(random_starts(&setup, starts, options.seed));
        if !problem.start.is_empty() {
            let mut guessed = all[0].clone();
            for (name, value) in setup.names().iter().zip(&mut guessed) {
                *value = problem.start.get(name).copied().unwrap_or(*value);
            }
            all.push(guessed);
        }
        let fit = fit_from(&setup, &all, &white, STOPPING)?;
        if fit.agree >= 2
            || starts >= 96
            || setup.leaves_out("further starts of the believed model")
        {
            break fit;
        }
        starts *= 2;
    };
    setup.choose_substeps(&fit.x)?;
    // Levels that are not measured are estimated now: ranges and operating levels depend on them, and the parameters relative to these have
    // to be updated, whatever the time limit is.
    if let Some(limit) = &setup.time_limit {
        limit.allow(share + FOLLOW);
    }
    setup.structure.scales = setup.scales_at(&fit.x)?;
    let setup = setup.with_structure(setup.structure.clone())?;
    let fit = fit_from(&setup, std::slice::from_ref(&fit.x), &white, STOPPING)?.continuing(&fit);
    let mut node = Node {
        setup,
        fit,
        added: Vec::new(),
    };
    // Random starts rarely find the places of many effects at once, or of one effect if most levels are not measured: a leak of the first
    // of three tanks ended at zero from every start.
    if !problem.effects.is_empty() {
        begun_again(&mut node, &problem.effects, &white)?;
    }
    enclose(problem, options, node)
}

/// A start of a plant with effects: the plant is fitted without them, then effects are added one after the other, each time the one that
/// lowers the error most.
///
/// From random starts of all parameters at once, fits of several effects rarely converge to the best minimum. `None`: the plant has no
/// effects.
fn one_by_one(setup: &Setup, seed: u64) -> Result<Option<Vec<f64>>, Error> {
    let mut remaining = setup.structure.effects().to_vec();
    if remaining.is_empty() {
        return Ok(None);
    }
    let white = setup.white_noise();
    let structure = setup.structure.clone();
    let structure = remaining.iter().fold(structure, |structure, placed| {
        structure.without(placed.effect)
    });
    let bare = setup.with_structure(structure)?;
    let fit = fit_from(
        &bare,
        &random_starts(&bare, BARE_STARTS, seed),
        &white,
        ROUGH,
    )?;
    let mut node = Node {
        setup: bare,
        fit,
        added: Vec::new(),
    };
    while !remaining.is_empty() {
        let parent = Parent::new(&node);
        let placed: Vec<Node> = remaining
            .par_iter()
            .filter_map(|placed| realise(propose(&parent, *placed, &white)?, &white, ROUGH))
            .collect();
        let least = |a: &Node, b: &Node| a.fit.mean_rmse().total_cmp(&b.fit.mean_rmse());
        let Some(first) = placed.into_iter().min_by(least) else {
            break;
        };
        remaining.retain(|placed| Some(placed) != first.added.last());
        node = first;
    }
    // Parameters that were not estimated because of the time limit have the values of any start.
    let mut x = random_starts(setup, 1, seed).swap_remove(0);
    let own = node.setup.names();
    for (name, value) in setup.names().iter().zip(&mut x) {
        if let Some(at) = own.iter().position(|known| known == name) {
            *value = node.fit.x[at];
        }
    }
    Ok(Some(x))
}
