//! Extensions of a set by one effect, and the predicted reduction of the cost.

use std::sync::OnceLock;

use greybox::{Noise, Setup, Start, Stopping, Triangle, fit_onward, keep_best_simulated};
use plants::Placed;
use rayon::prelude::*;

use crate::fit::{
    hidden_step::{self, hidden_step},
    node::{Node, ROUGH, best_first, transfer},
    period::{keep_shown_periods, strongest_period},
    starts::grid,
};

/// Damping of the step for the predicted reduction, against directions that the data do not determine.
const PREDICTION_DAMPING: f64 = 1e-6;
/// Number of starts of a new effect that are fitted, those with the largest predicted reduction.
const FOLLOWED: usize = 2;

/// Distance of starts on the coarser grid for an effect in addition to two or more others.
const COARSE: usize = 10;

/// Largest number of functions of time in a set. Two of them with opposite signs (the outlet opens while the pump gains) have a flexible
/// difference: with a third one they fit any slow disturbance.
const BY_CLOCK: usize = 1;

/// The cost after one step from a start, as its linearised model predicts.
///
/// The step has little damping: for an effect that is nearly collinear with other parameters, both take
/// long steps, and damping would leave the error of the start in the prediction.
fn predicted(setup: &Setup, x: &[f64], triangle: &Triangle) -> f64 {
    let free: Vec<usize> = (0..setup.free().len()).collect();
    let scale: Vec<f64> = free.iter().map(|&j| triangle.column_norm(j)).collect();
    let mut step = triangle.solve(&free, &scale, PREDICTION_DAMPING);
    for (d, &i) in step.iter_mut().zip(setup.free()) {
        let (lower, upper) = setup.bounds()[i];
        let lower = if lower > 0.0 {
            lower.max(0.2 * x[i])
        } else {
            lower
        };
        *d = (x[i] + *d).clamp(lower, upper.max(lower)) - x[i];
    }
    triangle.predicted(&step)
}

/// One more effect, at its best starts by predicted reduction.
#[derive(Clone)]
pub(crate) struct Proposal<'a> {
    pub setup: Setup<'a>,
    pub added: Vec<Placed>,
    pub starts: Vec<Start>,
    pub predicted: f64,
}

/// A model that is extended, and the dominant period of its residual, computed on demand.
pub(crate) struct Parent<'n, 'a> {
    pub node: &'n Node<'a>,
    period: OnceLock<Option<f64>>,
}

impl<'n, 'a> Parent<'n, 'a> {
    pub(crate) fn new(node: &'n Node<'a>) -> Self {
        Self {
            node,
            period: OnceLock::new(),
        }
    }

    /// The setup with one effect more.
    pub(crate) fn with(&self, placed: Placed) -> Option<Setup<'a>> {
        let mut structure = self.node.setup.structure.with(placed).ok()?;
        if placed.effect.by_clock {
            structure.scales.period = (*self.period.get_or_init(|| strongest_period(self.node)))?;
        }
        let output = placed.vessel;
        if placed.effect.id == hidden_step::EFFECT
            && structure.scales.outputs[output].reading_step == 0.0
        {
            // Only one effect needs this step. All threads compute it, and it must not be stored in a cell: a thread that waits for the
            // others may start the next proposal, which would read the cell that is being filled.
            let step = hidden_step(self.node, output).ok().flatten();
            structure.scales.outputs[output].hidden_step = step;
        }
        self.node.setup.with_structure(structure).ok()
    }
}

pub(crate) fn propose<'a>(
    parent: &Parent<'_, 'a>,
    placed: Placed,
    noise: &Noise,
) -> Option<Proposal<'a>> {
    if parent
        .node
        .setup
        .leaves_out("effects that were not tried at all")
    {
        return None;
    }
    let setup = parent.with(placed)?;
    let (predicted, starts) = predicted_fall(parent.node, &setup, placed, noise)?;
    let mut added = parent.node.added.clone();
    added.push(placed);
    Some(Proposal {
        setup,
        added,
        starts,
        predicted,
    })
}

/// The best starts of a new effect by predicted reduction, with the other parameters from `from`, and the largest predicted reduction.
pub(crate) fn predicted_fall(
    from: &Node,
    setup: &Setup,
    placed: Placed,
    noise: &Noise,
) -> Option<(f64, Vec<Start>)> {
    let mut starts = grid(from, setup, placed);
    if from.added.len() > 1 {
        // For pairs, a third effect is searched on a coarser grid.
        starts = every_so_many(starts, COARSE);
    }
    keep_shown_periods(setup, placed, &mut starts, noise);
    keep_best_simulated(setup, placed, &mut starts, noise);
    let mut ranked: Vec<(f64, Start)> = starts
        .into_par_iter()
        .filter_map(|mut x| {
            setup.begin_near_priors(&mut x);
            let triangle = setup.linearise(&x, noise)?;
            let predicted = predicted(setup, &x, &triangle);
            let triangle = Some(triangle);
            Some((predicted, Start { x, triangle }))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let predicted = ranked.first()?.0;
    let starts = ranked.into_iter().take(FOLLOWED);
    let starts = starts.map(|(_, start)| start).collect();
    Some((predicted, starts))
}

/// A limited number of items of a list, evenly spaced.
fn every_so_many(starts: Vec<Vec<f64>>, most: usize) -> Vec<Vec<f64>> {
    let step = starts.len().div_ceil(most);
    starts.into_iter().step_by(step.max(1)).collect()
}

pub(crate) fn realise<'a>(
    proposal: Proposal<'a>,
    noise: &Noise,
    stopping: Stopping,
) -> Option<Node<'a>> {
    let fit = fit_onward(&proposal.setup, proposal.starts, noise, stopping).ok()?;
    let node = Node {
        setup: proposal.setup,
        fit,
        added: proposal.added,
    };
    Some(widened(node, noise, stopping))
}

/// The model with a wider range of its newest size, fitted again, if the size ended at the bound and a larger size fits better.
fn widened<'a>(node: Node<'a>, noise: &Noise, stopping: Stopping) -> Node<'a> {
    let again = || {
        let placed = *node.added.last()?;
        let (size, at) = node.size_of(placed)?;
        // At the absent value no widening is needed.
        let absent = (node.fit.x[at] - size.absent).abs() <= 1e-6 * (size.upper - size.lower);
        if absent || !node.at_the_edge(placed) || node.setup.out_of_time() {
            return None;
        }
        let wider = node.setup.structure.with_wider(placed.effect)?;
        let setup = node.setup.with_structure(wider).ok()?;
        let fit = fit_onward(&setup, vec![node.fit.x.clone().into()], noise, stopping).ok()?;
        (fit.cost < node.fit.cost).then(|| Node {
            setup,
            fit,
            added: node.added.clone(),
        })
    };
    again().unwrap_or(node)
}

/// All extensions of a set by one effect, refitted, best first.
pub(crate) fn singles<'a>(parent: &Node<'a>, noise: &Noise) -> Vec<Node<'a>> {
    let proposals = proposals(parent, noise);
    best_first(realise_all(proposals, noise, ROUGH))
}

/// All extensions of a set by one effect, not fitted, with the largest predicted reduction first.
pub(crate) fn proposals<'a>(parent: &Node<'a>, noise: &Noise) -> Vec<Proposal<'a>> {
    let from = Parent::new(parent);
    let mut proposals: Vec<Proposal> = candidates(parent)
        .into_par_iter()
        .filter_map(|placed| propose(&from, placed, noise))
        .collect();
    proposals.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
    proposals
}

pub(crate) fn realise_all<'a>(
    proposals: Vec<Proposal<'a>>,
    noise: &Noise,
    stopping: Stopping,
) -> Vec<Node<'a>> {
    proposals
        .into_par_iter()
        .filter_map(|proposal| realise(proposal, noise, stopping))
        .collect()
}

/// Effects that may be added to a set.
pub(crate) fn candidates(parent: &Node) -> Vec<Placed> {
    let mut candidates = parent.setup.structure.candidates();
    let on = parent.setup.structure.effects().iter();
    if on.filter(|placed| placed.effect.by_clock).count() >= BY_CLOCK {
        candidates.retain(|placed| !placed.effect.by_clock);
    }
    candidates
}

/// Whether some further effect has a predicted reduction that is `worth` it.
pub(crate) fn any_worthwhile(
    parent: &Node,
    noise: &Noise,
    worth: impl Fn(&Setup, f64) -> bool + Sync,
) -> bool {
    let from = Parent::new(parent);
    candidates(parent).into_par_iter().any(|placed| {
        propose(&from, placed, noise)
            .is_some_and(|proposal| worth(&proposal.setup, proposal.predicted))
    })
}

/// The model with one given additional effect, fitted; `known` is a fit of a larger set, whose values are a further start.
pub(crate) fn place<'a>(
    parent: &Node<'a>,
    placed: Placed,
    known: &Node<'a>,
    noise: &Noise,
    stopping: Stopping,
) -> Option<Node<'a>> {
    let from = Parent::new(parent);
    let proposal = propose(&from, placed, noise).or_else(|| {
        // If the time limit is reached, the larger set's values are the only start.
        let setup = from.with(placed)?;
        let mut added = parent.added.clone();
        added.push(placed);
        Some(Proposal {
            setup,
            added,
            starts: Vec::new(),
            predicted: f64::INFINITY,
        })
    });
    let mut proposal = proposal?;
    let start = transfer(known, &proposal.setup);
    // First in the list, because only one start is used if the time limit is reached.
    proposal.starts.insert(0, start.into());
    realise(proposal, noise, stopping)
}
