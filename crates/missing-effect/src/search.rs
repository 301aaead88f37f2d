//! The joint search: effects interact, so sets of effects are grown side by side, not one after the other.
//!
//! On the measured Cascaded Tanks data a pump dead zone alone lowers the error from 0.67 to 0.60 V and an overflow
//! alone to 0.52 V, both together to 0.33 V: a search that stops at the first effect that does not pay misses such pairs.

use std::sync::OnceLock;

use ct_signals::ArModel;
use greybox::{Fit, Setup, Start, Stopping, Triangle, fit_from, fit_onward};
use plants::{Place, Placed, Unit};
use rayon::prelude::*;

use crate::{Error, spectral_line::strongest_line};

/// A structure with its fit.
#[derive(Debug, Clone)]
pub(crate) struct Node<'a> {
    pub setup: Setup<'a>,
    pub fit: Fit,
    /// What was added to the base, in order.
    pub added: Vec<Placed>,
}

impl Node<'_> {
    /// Fall of the criterion against another node in the same metric.
    pub fn gain_over(&self, other: &Node) -> f64 {
        other.fit.bic() - self.fit.bic()
    }

    /// The size of every added effect lies inside its plausible range, neither absent nor at the far end.
    pub fn plausible(&self) -> bool {
        !self.added.iter().any(|placed| self.at_the_edge(*placed))
    }

    /// The size of an added effect is absent or at the far end of its plausible range.
    pub fn at_the_edge(&self, placed: Placed) -> bool {
        let parameters = self.setup.structure.effect_parameters(placed);
        let Some(leading) = parameters.first() else {
            return false;
        };
        let name = format!("{}.{}", placed.effect.id, leading.name);
        let Some(at) = self.setup.names().iter().position(|known| *known == name) else {
            return false;
        };
        let room = 1e-6 * (leading.upper - leading.lower);
        let size = self.fit.x[at];
        size <= leading.lower + room || size >= leading.upper - room
    }
}

fn key(added: &[Placed]) -> Vec<(&'static str, usize)> {
    let mut key: Vec<_> = added
        .iter()
        .map(|placed| (placed.effect.id, placed.vessel))
        .collect();
    key.sort_unstable();
    key
}

/// How wide to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Breadth {
    /// Sets that are grown from one size to the next.
    pub beam: usize,
    /// Sets of one size that are refitted, the most promising first.
    pub refits: usize,
    /// Largest number of effects.
    pub most: usize,
}

/// A first fit needs no more than this: its rank is sought, not its digits.
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 20,
    cost: 1e-3,
};
/// Which of many are worth a first fit.
const QUICK: Stopping = Stopping {
    evaluations: 5,
    cost: 1e-3,
};
/// What a fit is taken to once its structure has a name.
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 80,
    cost: 1e-8,
};
/// Damping of the step that a promise takes, against what the data do not determine.
const PROMISE_DAMPING: f64 = 1e-6;
/// Starts of a new effect that are followed down, the most promising of its grid.
const FOLLOWED: usize = 2;

/// A rough fit this near in the criterion may come within a group's margin.
pub(crate) const NEAR: f64 = 25.0;
/// Effects of a set that follow the clock alone. Two of them whose signs oppose each other (the outlet opens while the pump
/// gains) leave a difference that bends as it likes: with a third they fit any slow course of time, whatever made it.
const BY_CLOCK: usize = 1;
/// Sets are one where what they explain differs by less than this part of it.
const SAME_TAKEN: f64 = 0.15;
/// Stand-ins that are refitted for each effect: so many that a promise favours, and so many that a few steps favour.
const EXCHANGED: usize = 12;
/// What is behind by more than this part of an effect's own gain after a few steps does not catch up.
const OUT_OF_REACH: f64 = 0.5;

/// A child's starts: the vector of a node, with the new effect's parameters on the grid of its starts.
///
/// Parameters that the plant alone does not tell apart lie in one order or the other by chance. An effect in a vessel tells
/// them apart, and from the wrong order no fit comes to the right one.
fn grid(from: &Node, child: &Setup, placed: Placed) -> Vec<Vec<f64>> {
    let mut begun = vec![transfer(from, child)];
    let pair = child.structure.plant.interchangeable();
    if let Some(pair) = pair.filter(|_| placed.effect.place == Place::Vessel) {
        let free = |name| {
            let at = child.names().iter().position(|known| known == name)?;
            child.free().contains(&at).then_some(at)
        };
        if let [Some(a), Some(b)] = pair.map(free) {
            let mut exchanged = begun[0].clone();
            exchanged.swap(a, b);
            begun.push(exchanged);
        }
    }

    let parameters = child.structure.effect_parameters(placed);
    let mut combinations: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in &parameters {
        combinations = combinations
            .iter()
            .flat_map(|begun| {
                parameter.starts.iter().map(|start| {
                    let mut longer = begun.clone();
                    longer.push(*start);
                    longer
                })
            })
            .collect();
    }
    combinations
        .into_iter()
        .flat_map(|values| begun.iter().map(move |x| (x.clone(), values.clone())))
        .map(|(mut x, values)| {
            for (parameter, value) in parameters.iter().zip(values) {
                let name = format!("{}.{}", placed.effect.id, parameter.name);
                if let Some(at) = child.names().iter().position(|known| *known == name) {
                    x[at] = value;
                }
            }
            x
        })
        .collect()
}

/// The parent's vector in the child's order; what the parent does not have is zero.
fn transfer(parent: &Node, child: &Setup) -> Vec<f64> {
    child
        .names()
        .iter()
        .map(|name| {
            parent
                .setup
                .names()
                .iter()
                .position(|known| known == name)
                .map_or(0.0, |at| parent.fit.x[at])
        })
        .collect()
}

/// The cost after one step from a start, as the linearised model there predicts it.
///
/// The step is hardly damped: an effect that the other parameters nearly imitate takes long steps in both, and a damped one would
/// leave the start's own error in the promise.
fn promise(setup: &Setup, x: &[f64], triangle: &Triangle) -> f64 {
    let free: Vec<usize> = (0..setup.free().len()).collect();
    let scale: Vec<f64> = free.iter().map(|&j| triangle.column_norm(j)).collect();
    let mut step = triangle.solve(&free, &scale, PROMISE_DAMPING);
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

/// One effect more, at its most promising starts.
struct Proposal<'a> {
    setup: Setup<'a>,
    added: Vec<Placed>,
    starts: Vec<Start>,
    promise: f64,
}

/// A node that is extended, and the period that shows most in what it does not explain, once that was asked for.
struct Parent<'n, 'a> {
    node: &'n Node<'a>,
    period: OnceLock<Option<f64>>,
}

impl<'n, 'a> Parent<'n, 'a> {
    fn new(node: &'n Node<'a>) -> Self {
        Self {
            node,
            period: OnceLock::new(),
        }
    }

    /// The setup with one effect more.
    fn with(&self, placed: Placed) -> Option<Setup<'a>> {
        let mut structure = self.node.setup.structure.with(placed).ok()?;
        if placed.effect.by_clock {
            structure.scales.period = (*self.period.get_or_init(|| strongest_period(self.node)))?;
        }
        self.node.setup.with_structure(structure).ok()
    }
}

fn propose<'a>(parent: &Parent<'_, 'a>, placed: Placed, noise: &ArModel) -> Option<Proposal<'a>> {
    let setup = parent.with(placed)?;
    let (promise, starts) = promising(parent.node, &setup, placed, noise)?;
    let mut added = parent.node.added.clone();
    added.push(placed);
    Some(Proposal {
        setup,
        added,
        starts,
        promise,
    })
}

/// The most promising starts of a new effect, the other parameters being where they are in `from`, and the best one's promise.
fn promising(
    from: &Node,
    setup: &Setup,
    placed: Placed,
    noise: &ArModel,
) -> Option<(f64, Vec<Start>)> {
    let mut ranked: Vec<(f64, Start)> = grid(from, setup, placed)
        .into_par_iter()
        .filter_map(|x| {
            let triangle = setup.linearise(&x, noise)?;
            let promise = promise(setup, &x, &triangle);
            let triangle = Some(triangle);
            Some((promise, Start { x, triangle }))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let promise = ranked.first()?.0;
    let starts = ranked.into_iter().take(FOLLOWED);
    let starts = starts.map(|(_, start)| start).collect();
    Some((promise, starts))
}

/// The period that shows most in what a node does not explain \[s\].
fn strongest_period(node: &Node) -> Option<f64> {
    let residuals = node.setup.disturbance(&node.fit.x).ok()?;
    let lines = residuals.iter().zip(node.setup.records);
    let strongest = lines
        .filter_map(|(residual, record)| Some((strongest_line(residual).ok()??, record.duration())))
        .min_by(|a, b| a.0.chance.total_cmp(&b.0.chance));
    Some(strongest.map_or(0.0, |(line, duration)| duration / line.cycles as f64))
}

fn realise<'a>(proposal: Proposal<'a>, noise: &ArModel, stopping: Stopping) -> Option<Node<'a>> {
    let fit = fit_onward(&proposal.setup, proposal.starts, noise, stopping).ok()?;
    Some(Node {
        setup: proposal.setup,
        fit,
        added: proposal.added,
    })
}

/// All single extensions of a node, refitted, best first.
pub(crate) fn singles<'a>(parent: &Node<'a>, noise: &ArModel) -> Vec<Node<'a>> {
    let proposals = proposals(parent, noise);
    best_first(realise_all(proposals, noise, ROUGH))
}

/// All extensions of a node by one effect, not fitted, the most promising first.
fn proposals<'a>(parent: &Node<'a>, noise: &ArModel) -> Vec<Proposal<'a>> {
    let from = Parent::new(parent);
    let mut proposals: Vec<Proposal> = candidates(parent)
        .into_par_iter()
        .filter_map(|placed| propose(&from, placed, noise))
        .collect();
    proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
    proposals
}

fn realise_all<'a>(
    proposals: Vec<Proposal<'a>>,
    noise: &ArModel,
    stopping: Stopping,
) -> Vec<Node<'a>> {
    proposals
        .into_par_iter()
        .filter_map(|proposal| realise(proposal, noise, stopping))
        .collect()
}

/// By the criterion.
pub(crate) fn best_first(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
    nodes
}

/// What may be added to a set.
fn candidates(parent: &Node) -> Vec<Placed> {
    let mut candidates = parent.setup.structure.candidates();
    let on = parent.setup.structure.effects().iter();
    if on.filter(|placed| placed.effect.by_clock).count() >= BY_CLOCK {
        candidates.retain(|placed| !placed.effect.by_clock);
    }
    candidates
}

/// The best sets that say different things, best first.
///
/// Two sets that take nearly the same out of the base's residual are one under two names (a dead zone and a leak, say), and
/// what is added to the one makes what is added to the other. Grown side by side they would fill the beam.
fn distinct<'n, 'a>(
    base: &Node<'a>,
    nodes: &'n [Node<'a>],
    most: usize,
) -> Result<Vec<&'n Node<'a>>, Error> {
    let residual = |node: &Node| Ok::<_, Error>(node.setup.residuals(&node.fit.x)?.concat());
    let before = residual(base)?;
    let mut chosen: Vec<(&Node, Vec<f64>)> = Vec::new();
    for node in nodes {
        let taken: Vec<f64> = residual(node)?
            .iter()
            .zip(&before)
            .map(|(after, before)| before - after)
            .collect();
        let size = squares(taken.iter().copied());
        let named = chosen.iter().any(|(_, other)| {
            let apart = squares(taken.iter().zip(other).map(|(a, b)| a - b));
            apart < SAME_TAKEN.powi(2) * size
        });
        if !named {
            chosen.push((node, taken));
        }
        if chosen.len() == most {
            break;
        }
    }
    Ok(chosen.into_iter().map(|(node, _)| node).collect())
}

fn squares(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum()
}

/// The sets that were grown from a base.
pub(crate) struct Grown<'a> {
    /// The best sets of every size, from the base on, best first within a size.
    pub sizes: Vec<Vec<Node<'a>>>,
    /// All single effects that were refitted, and those that were not promising enough for it.
    refitted: Vec<Node<'a>>,
    unpromising: Vec<Proposal<'a>>,
    /// The set that was exhausted, where the growth ended so.
    exhausted: Option<Vec<Placed>>,
}

impl<'a> Grown<'a> {
    /// Whether the growth ended because this set was exhausted.
    pub fn exhausted_by(&self, node: &Node) -> bool {
        let same = |set: &Vec<Placed>| key(set) == key(&node.added);
        self.exhausted.as_ref().is_some_and(same)
    }

    /// The same growth with the sets of another.
    pub fn with_sizes_of(self, other: Self) -> Self {
        Self {
            sizes: other.sizes,
            ..self
        }
    }

    /// What [`singles`] gives for the base in the metric in which it was grown.
    pub fn singles(self, noise: &ArModel) -> Vec<Node<'a>> {
        let mut nodes = self.refitted;
        nodes.extend(realise_all(self.unpromising, noise, ROUGH));
        best_first(nodes)
    }
}

/// Grows sets of effects from a base.
///
/// The growth ends after two sizes that are not `worth` it, and at once where the best set is `exhausted`.
pub(crate) fn grow<'a>(
    base: &Node<'a>,
    noise: &ArModel,
    breadth: Breadth,
    worth: impl Fn(&Node, &Node) -> bool,
    exhausted: impl Fn(&Node) -> Result<bool, Error>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Grown<'a>, Error> {
    let mut grown = Grown {
        sizes: vec![vec![base.clone()]],
        refitted: Vec::new(),
        unpromising: Vec::new(),
        exhausted: None,
    };
    let mut idle = 0;
    for size in 1..=breadth.most {
        progress(size - 1, breadth.most);
        let sizes = &mut grown.sizes;
        let best_before = sizes
            .iter()
            .flatten()
            .min_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()))
            .unwrap_or(base);
        if !best_before.added.is_empty() && idle == 0 && exhausted(best_before)? {
            grown.exhausted = Some(best_before.added.clone());
            break;
        }
        // The first sizes are searched wider: a pair may pay where neither of its effects does.
        let factor = if size <= 2 { 2 } else { 1 };
        let mut proposals = if size == 1 {
            proposals(base, noise)
        } else {
            extensions(base, &sizes[size - 1], factor * breadth.beam, noise)?
        };
        let unpromising = proposals.split_off(proposals.len().min(factor * breadth.refits));
        let mut nodes = realise_all(proposals, noise, ROUGH);
        if size == 1 {
            (grown.refitted, grown.unpromising) = (nodes.clone(), unpromising);
        }
        nodes.retain(Node::plausible);
        let mut nodes = best_first(nodes);
        nodes.truncate(4 * breadth.beam);
        let Some(best) = nodes.first() else {
            break;
        };
        // A pair is looked at even where no single effect pays; after two sizes that do not pay there is no more.
        idle = if worth(best_before, best) {
            0
        } else {
            idle + 1
        };
        sizes.push(nodes);
        if idle == 2 {
            break;
        }
    }
    progress(breadth.most, breadth.most);
    Ok(grown)
}

/// The sets of one size extended by one effect, each set once, the most promising first.
fn extensions<'a>(
    base: &Node<'a>,
    parents: &[Node<'a>],
    width: usize,
    noise: &ArModel,
) -> Result<Vec<Proposal<'a>>, Error> {
    let parents: Vec<Parent> = distinct(base, parents, width)?
        .into_iter()
        .map(Parent::new)
        .collect();
    let mut wanted: Vec<(&Parent, Placed)> = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for parent in &parents {
        for placed in candidates(parent.node) {
            let mut added = parent.node.added.clone();
            added.push(placed);
            if seen.insert(key(&added)) {
                wanted.push((parent, placed));
            }
        }
    }
    let mut proposals: Vec<Proposal> = wanted
        .into_par_iter()
        .filter_map(|(parent, placed)| propose(parent, placed, noise))
        .collect();
    proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
    Ok(proposals)
}

/// Fits a node's structure anew to the end, from where it is and from the given further starts.
pub(crate) fn refine<'a>(
    node: &Node<'a>,
    noise: &ArModel,
    more: &[Vec<f64>],
) -> Result<Node<'a>, Error> {
    fitted(node, noise, FINE, more)
}

fn fitted<'a>(
    node: &Node<'a>,
    noise: &ArModel,
    stopping: Stopping,
    more: &[Vec<f64>],
) -> Result<Node<'a>, Error> {
    let mut starts = vec![Start::at_end(&node.fit, noise)];
    starts.extend(more.iter().cloned().map(Start::from));
    let fit = fit_onward(&node.setup, starts, noise, stopping)?;
    Ok(Node {
        setup: node.setup.clone(),
        fit,
        added: node.added.clone(),
    })
}

/// The node without one of its effects, refitted from where it was.
pub(crate) fn without<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &ArModel,
) -> Result<Node<'a>, Error> {
    let setup = node
        .setup
        .with_structure(node.setup.structure.without(node.added[position].effect))?;
    let start = transfer(node, &setup);
    let fit = fit_from(&setup, &[start], noise, FINE)?;
    let mut added = node.added.clone();
    added.remove(position);
    Ok(Node { setup, fit, added })
}

/// The node without its effects that follow the clock alone, refitted from where it was.
pub(crate) fn without_clock<'a>(node: &Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    let mut node = node.clone();
    while let Some(position) = node.added.iter().position(|placed| placed.effect.by_clock) {
        node = without(&node, position, noise)?;
    }
    Ok(node)
}

/// Whether some effect more makes a promise that is `worth` it.
pub(crate) fn any_promise(
    parent: &Node,
    noise: &ArModel,
    worth: impl Fn(&Setup, f64) -> bool + Sync,
) -> bool {
    let from = Parent::new(parent);
    candidates(parent).into_par_iter().any(|placed| {
        propose(&from, placed, noise)
            .is_some_and(|proposal| worth(&proposal.setup, proposal.promise))
    })
}

/// The node with one of its effects exchanged for each other candidate, refitted, best first.
///
/// `singles`: what [`singles`] gives in the same metric. It holds the exchanges of an only effect.
pub(crate) fn exchanges<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &ArModel,
    singles: Option<&[Node<'a>]>,
) -> Result<Vec<Node<'a>>, Error> {
    let lacking = without(node, position, noise)?;
    let own = node.added[position];
    let reach = (4.0 * NEAR).max(OUT_OF_REACH * lacking.gain_over(node).abs());
    let begun = match singles {
        Some(singles) if node.added.len() == 1 => singles
            .iter()
            .filter(|single| single.added.last() != Some(&own))
            .cloned()
            .collect(),
        _ => begin_exchanges(&lacking, node, own, noise),
    };
    let nodes = begun
        .into_par_iter()
        .filter_map(|begun| {
            let carried = carried(node, own, &begun);
            let near = carried.is_some() || node.gain_over(&begun) < reach;
            near.then(|| fitted(&begun, noise, ROUGH, carried.as_slice()).ok())?
        })
        .map(|rough| {
            // Who comes near is fitted to the end: a group's edge is finer than a rough fit.
            if rough.fit.bic() - node.fit.bic() < NEAR {
                refine(&rough, noise, &[]).unwrap_or(rough)
            } else {
                rough
            }
        })
        .collect();
    Ok(best_first(nodes))
}

/// A start of a stand-in whose size is of the same kind as that of the effect it stands for: the same size.
///
/// What a lag of the pump is to the sensor's, a time constant that the data determine: from a grid of starts, with two more in
/// the tanks to get out of its way, a fit creeps towards it.
fn carried(node: &Node, own: Placed, stand_in: &Node) -> Option<Vec<f64>> {
    let added = *stand_in.added.last()?;
    let size = |node: &Node, placed: Placed| {
        let leading = node
            .setup
            .structure
            .effect_parameters(placed)
            .swap_remove(0);
        let name = format!("{}.{}", placed.effect.id, leading.name);
        let at = node.setup.names().iter().position(|known| *known == name)?;
        Some((leading, at))
    };
    let (from, at) = size(node, own)?;
    let (to, into) = size(stand_in, added)?;
    if from.unit != to.unit || from.unit == Unit::ONE {
        return None;
    }
    let mut x = transfer(node, &stand_in.setup);
    x[into] = node.fit.x[at].clamp(to.lower, to.upper);
    // What else the stand-in has is where it is.
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

/// First fits of what may stand in the place of an effect of a node, of which another is `lacking`.
fn begin_exchanges<'a>(
    lacking: &Node<'a>,
    node: &Node<'a>,
    own: Placed,
    noise: &ArModel,
) -> Vec<Node<'a>> {
    let from = Parent::new(lacking);
    let mut proposals: Vec<Proposal> = candidates(lacking)
        .into_par_iter()
        .filter(|placed| *placed != own)
        .filter_map(|placed| {
            let mut proposal = propose(&from, placed, noise)?;
            proposal.starts.truncate(1);
            // The model that lacks the effect has bent the other parameters to imitate it, and may have lost its way back.
            // Beside a true stand-in they are where they are beside the effect itself.
            if let Some((promise, starts)) = promising(node, &proposal.setup, placed, noise) {
                proposal.starts.extend(starts.into_iter().take(1));
                proposal.promise = proposal.promise.min(promise);
            }
            Some(proposal)
        })
        .collect();
    proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
    // A promise is that of a straight line: where a time constant or a threshold bends it, only a few steps show what it is
    // worth. A few steps are too few where parameters nearly imitate each other, and there the promise holds.
    let mut begun: Vec<(usize, Node)> = proposals
        .into_par_iter()
        .enumerate()
        .filter_map(|(promised, proposal)| Some((promised, realise(proposal, noise, QUICK)?)))
        .collect();
    begun.sort_by(|a, b| a.1.fit.bic().total_cmp(&b.1.fit.bic()));
    begun
        .into_iter()
        .enumerate()
        .filter(|(quick, (promised, _))| *quick < EXCHANGED || *promised < EXCHANGED)
        .map(|(_, (_, begun))| begun)
        .collect()
}

/// The node with one given effect more, fitted so far; `known` is a fit of a larger set, whose values serve as a
/// further start.
pub(crate) fn place<'a>(
    parent: &Node<'a>,
    placed: Placed,
    known: &Node<'a>,
    noise: &ArModel,
    stopping: Stopping,
) -> Option<Node<'a>> {
    let mut proposal = propose(&Parent::new(parent), placed, noise)?;
    let start = transfer(known, &proposal.setup);
    proposal.starts.push(start.into());
    realise(proposal, noise, stopping)
}
