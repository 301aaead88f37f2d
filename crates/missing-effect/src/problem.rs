//! What is to be diagnosed and how, and the fit of the believed model.

use std::collections::BTreeMap;
use std::sync::{Arc, atomic::AtomicBool};
use std::time::Duration;

use ct_signals::{Record, require_samples};
use greybox::{PriorValue, Setup, Stopping, TimeLimit, fit_from, random_starts};
use plants::{Known, Placed, Plant, Term, controller::Controller};
use rayon::prelude::*;

use crate::{
    ControlLoop, Error,
    closed_loop::enclose,
    minima::begun_again,
    node::{Node, ROUGH},
    proposal::{Parent, propose, realise},
};

/// What the fit of a believed model is taken to.
pub(crate) const STOPPING: Stopping = Stopping {
    evaluations: 120,
    cost: 1e-9,
};

/// Share of the time limit in which the best fit follows changed ranges.
const FOLLOW: f64 = 0.1;
/// Random starts of the plant alone, before its effects are put on.
const BARE_STARTS: usize = 12;

/// What is to be diagnosed.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The believed plant.
    pub plant: Plant,
    /// What is known of it.
    pub known: Known,
    /// The effects that are on already.
    pub effects: Vec<Placed>,
    /// Terms of the user's own that are on already; a fit changes their scale.
    pub terms: Vec<Term>,
    /// First guesses, by name: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names in `start` that are not fitted.
    pub fixed: Vec<String>,
    /// What is known of parameters beside the records, by the same names.
    pub priors: BTreeMap<String, PriorValue>,
    /// The records that are fitted together.
    pub records: Vec<Record>,
    /// The controller of the loop, where there is one: it must make the fitted plant stable.
    pub controller: Option<Controller>,
    /// Records that take no part in any fit or choice and are only scored.
    pub test: Vec<Record>,
}

/// How to search.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Largest number of effects to add.
    pub max_effects: usize,
    /// Random starts of the base fit, at least ten; more are drawn until the best minimum is found twice.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Where a controller is known and the records hold its reference: the loop is simulated; otherwise the model runs on
    /// the measured command.
    pub simulate_loop: bool,
    /// Cancellation flag: when set, the computation ends soon with [`greybox::Error::Stopped`].
    pub stop: Option<&'a AtomicBool>,
    /// Limit on the time of the search: what it does not allow is left out, and [`crate::Effort`] says what. `None`: no limit. A
    /// result depends on the speed of the machine only where the limit is reached.
    pub time_limit: Option<Duration>,
    /// Interruption flag: when set, the search ends soon with the best that was found so far.
    pub interrupt: Option<&'a AtomicBool>,
}

/// A limit for a person who waits: the program's. [`Options::default`] has none, so that results do not depend on the machine.
pub const TIME_LIMIT: Duration = Duration::from_secs(20);

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            max_effects: 6,
            starts: 12,
            seed: 1,
            simulate_loop: true,
            stop: None,
            time_limit: None,
            interrupt: None,
        }
    }
}

/// How far the computation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub phase: &'static str,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}

/// The believed model, fitted to simulation error; its best minimum is found at least twice, or 96 starts were tried. In a
/// loop that is known it is then fitted there. After this share of the time limit it has no further starts.
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
        // The start of one effect after the other comes first: out of time no other is followed. What the user guesses of some
        // parameters goes with it.
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
    // Levels that are not measured are known now: ranges and operating levels follow them, and the parameters that are relative to
    // these have to follow, whatever the time.
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
    // Random starts hardly find the places of many effects at once, nor, where most levels are hidden, that of one: a leak of
    // the first of three tanks ended at the plant without it from every start.
    if !problem.effects.is_empty() {
        begun_again(&mut node, &problem.effects, &white)?;
    }
    enclose(problem, options, node)
}

/// A start of a plant with effects: the plant is fitted without them, and one after the other is put on, first what lowers the error most.
///
/// From random starts of all at once hardly any fit of several effects finds its way. `None`: the plant has no effects.
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
    // What was not put on for want of time is as any start has it.
    let mut x = random_starts(setup, 1, seed).swap_remove(0);
    let own = node.setup.names();
    for (name, value) in setup.names().iter().zip(&mut x) {
        if let Some(at) = own.iter().position(|known| known == name) {
            *value = node.fit.x[at];
        }
    }
    Ok(Some(x))
}
