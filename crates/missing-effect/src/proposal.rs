//! What a set may be extended by, and what that promises.

use std::{f64::consts::TAU, sync::OnceLock};

use ct_signals::Record;
use effect_search::strongest_line;
use greybox::{
    Noise, Setup, Start, Stopping, Triangle, fit_onward, keep_best_simulated, with_other_speeds,
};
use plants::{Place, Placed, Plant, Unit};
use rayon::prelude::*;

use crate::{
    hidden_step::{self, hidden_step},
    node::{Node, ROUGH, best_first, position_of, transfer},
    series::{series, standardised},
};

/// Damping of the step that a promise takes, against what the data do not determine.
const PROMISE_DAMPING: f64 = 1e-6;
/// Starts of a new effect that are followed down, the most promising of its grid.
const FOLLOWED: usize = 2;

/// Starts of an effect beside two others or more.
const COARSE: usize = 10;

/// The parameter that has as many minima as a spectrum has lines, and how many of its starts are looked at.
const PERIOD: &str = "periodic_disturbance.period";
const PERIODS_SHOWN: usize = 6;

/// Effects that the believed model of two tanks imitates by too large a throughput: tanks that push on each other, and what water
/// leaves the upper tank by beside its outlet.
const COUPLED: &str = "coupled_tank";
const LEAVES: [&str; 2] = ["overflow", "leak_at_height"];

/// Effects of a set that follow the clock alone. Two of them whose signs oppose each other (the outlet opens while the pump
/// gains) leave a difference that bends as it likes: with a third they fit any slow course of time, whatever made it.
const BY_CLOCK: usize = 1;

/// A child's starts: the vector of a node, with the new effect's parameters on the grid of its starts.
///
/// Parameters that the plant alone does not tell apart lie in one order or the other by chance. An effect in a vessel tells
/// them apart, and from the wrong order no fit comes to the right one.
pub(crate) fn grid(from: &Node, child: &Setup, placed: Placed) -> Vec<Vec<f64>> {
    let mut begun = vec![transfer(from, child)];
    let less = with_less_throughput(&begun[0], child, placed);
    let structure = &child.structure;
    let pair = structure.plant.interchangeable(&structure.known);
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

    begun.extend(with_other_speeds(child, placed, &begun[0]));
    let begun: Vec<(Vec<f64>, f64)> = begun.into_iter().map(|x| (x, 1.0)).chain(less).collect();

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
        .map(|((mut x, levels), values)| {
            for (parameter, value) in parameters.iter().zip(values) {
                if let Some(at) = position_of(child, placed, parameter.name) {
                    let level = parameter.unit == Unit::LEVEL;
                    x[at] = if level { levels * value } else { value };
                }
            }
            x
        })
        .collect()
}

/// Parts of the throughput, where a fit may have taken it several times too high.
const LESS_THROUGHPUT: [f64; 2] = [0.4, 0.2];

/// Two tanks with a part of their throughput, and what the upper tank's levels are multiplied by: the lower level stays, the upper tank is
/// as much lower.
///
/// Two tanks that push on each other have time constants far apart, and a tank that runs over passes on less the fuller it is. The model
/// without these imitates that by a high upper tank above a quick lower one, with several times the throughput, and from there a fit ends
/// at another minimum.
fn with_less_throughput(x: &[f64], child: &Setup, placed: Placed) -> Vec<(Vec<f64>, f64)> {
    let plant = child.structure.plant;
    let upper = placed.vessel == 0 && LEAVES.contains(&placed.effect.id);
    let imitated = plant == Plant::CascadedTanks && (placed.effect.id == COUPLED || upper);
    let at = |name| child.names().iter().position(|known| known == name);
    let (Some(gain), Some(lower)) = (at("pump_gain"), at("alpha_lower")) else {
        return Vec::new();
    };
    if !imitated || [gain, lower].iter().any(|at| !child.free().contains(at)) {
        return Vec::new();
    }
    let less = |part: f64| {
        let mut x = x.to_vec();
        x[gain] *= part;
        x[lower] *= part;
        for record in 0..child.records.len() {
            x[child.plant_states_of(record).start] *= part.powi(2);
        }
        (x, part.powi(2))
    };
    LESS_THROUGHPUT.map(less).to_vec()
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
#[derive(Clone)]
pub(crate) struct Proposal<'a> {
    pub setup: Setup<'a>,
    pub added: Vec<Placed>,
    pub starts: Vec<Start>,
    pub promise: f64,
}

/// A node that is extended, and the period that shows most in what it does not explain, once it was asked for.
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
            // One effect asks for it. It is looked for by all threads, and must not be kept in a cell: a thread that waits for the
            // others may take up the next proposal, which would ask the cell that it is filling.
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
pub(crate) fn promising(
    from: &Node,
    setup: &Setup,
    placed: Placed,
    noise: &Noise,
) -> Option<(f64, Vec<Start>)> {
    let mut starts = grid(from, setup, placed);
    if from.added.len() > 1 {
        // Beside a pair, what is the third is looked for on a coarser grid.
        starts = every_so_many(starts, COARSE);
    }
    keep_shown_periods(setup, placed, &mut starts, noise);
    keep_best_simulated(setup, placed, &mut starts, noise);
    let mut ranked: Vec<(f64, Start)> = starts
        .into_par_iter()
        .filter_map(|mut x| {
            setup.begin_near_priors(&mut x);
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

/// At most so many of a list, evenly over it.
fn every_so_many(starts: Vec<Vec<f64>>, most: usize) -> Vec<Vec<f64>> {
    let step = starts.len().div_ceil(most);
    starts.into_iter().step_by(step.max(1)).collect()
}

/// Of starts with many periods keeps those whose periods show most in what is not explained without the effect: a plant answers a
/// swing with a swing of that period, and a Fourier sum costs far less than a simulation.
fn keep_shown_periods(setup: &Setup, placed: Placed, starts: &mut Vec<Vec<f64>>, noise: &Noise) {
    let (Some(at), Some(mut without)) = (period_of(setup), starts.first().cloned()) else {
        return;
    };
    let mut periods: Vec<f64> = starts.iter().map(|start| start[at]).collect();
    periods.sort_by(f64::total_cmp);
    periods.dedup();
    if periods.len() <= PERIODS_SHOWN {
        return;
    }
    for parameter in setup.structure.effect_parameters(placed) {
        let own = position_of(setup, placed, parameter.name);
        if let Some(own) = own.filter(|_| parameter.absent.is_finite()) {
            without[own] = parameter.absent;
        }
    }
    let Ok(residuals) = setup.disturbance(&without) else {
        return;
    };
    let shown = most_shown(periods, setup.records, noise.whiten(&residuals));
    // The strongest line stands out of its neighbours, and may yet be lower than what wanders; its choice is paid for.
    let strongest = setup.structure.scales.period;
    starts.retain(|start| {
        let of = |period: f64| period == start[at];
        of(strongest) || shown.iter().any(|period| of(*period))
    });
}

/// The periods that show most in whitened residuals, outputs by their noise.
fn most_shown(periods: Vec<f64>, records: &[Record], whitened: Vec<Vec<f64>>) -> Vec<f64> {
    let outputs = whitened.len() / records.len().max(1);
    let whitened = standardised(whitened, outputs);
    let whitened: Vec<(&Record, Vec<f64>)> = series(records)
        .map(|(record, _)| record)
        .zip(whitened)
        .collect();
    let mut shown: Vec<(f64, f64)> = periods
        .into_par_iter()
        .map(|period| (power_at(TAU / period, &whitened), period))
        .collect();
    shown.sort_by(|a, b| b.0.total_cmp(&a.0));
    shown.truncate(PERIODS_SHOWN);
    shown.into_iter().map(|(_, period)| period).collect()
}

/// The power of series at a frequency \[rad/s\].
fn power_at(frequency: f64, series: &[(&Record, Vec<f64>)]) -> f64 {
    let of_one = |(record, values): &(&Record, Vec<f64>)| {
        let terms = record.time.iter().zip(values);
        let terms = terms.filter(|(_, value)| !value.is_nan());
        let (sine, cosine) = terms.fold((0.0, 0.0), |(sine, cosine), (t, value)| {
            let (sin, cos) = (frequency * t).sin_cos();
            (sine + value * sin, cosine + value * cos)
        });
        sine * sine + cosine * cosine
    };
    series.iter().map(of_one).sum()
}

/// Where the period of a swing stands in the vector.
pub(crate) fn period_of(setup: &Setup) -> Option<usize> {
    setup.names().iter().position(|name| name == PERIOD)
}

/// The period that shows most in what a node does not explain \[s\].
// A cell is filled by it: it must not wait for other threads, for the reason that is given at the hidden step.
fn strongest_period(node: &Node) -> Option<f64> {
    let residuals = node.setup.disturbance(&node.fit.x).ok()?;
    let lines = residuals.iter().zip(series(node.setup.records));
    let strongest = lines
        .filter_map(|(residual, (record, _))| {
            Some((strongest_line(residual).ok()??, record.duration()))
        })
        .min_by(|a, b| a.0.chance.total_cmp(&b.0.chance));
    Some(strongest.map_or(0.0, |(line, duration)| duration / line.cycles as f64))
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

/// The node with the range of its newest size widened and fitted again, where that ended at the bound and a larger size fits better.
fn widened<'a>(node: Node<'a>, noise: &Noise, stopping: Stopping) -> Node<'a> {
    let again = || {
        let placed = *node.added.last()?;
        let (size, at) = node.size_of(placed)?;
        // At the absent value there is nothing to widen.
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

/// All single extensions of a node, refitted, best first.
pub(crate) fn singles<'a>(parent: &Node<'a>, noise: &Noise) -> Vec<Node<'a>> {
    let proposals = proposals(parent, noise);
    best_first(realise_all(proposals, noise, ROUGH))
}

/// All extensions of a node by one effect, not fitted, the most promising first.
pub(crate) fn proposals<'a>(parent: &Node<'a>, noise: &Noise) -> Vec<Proposal<'a>> {
    let from = Parent::new(parent);
    let mut proposals: Vec<Proposal> = candidates(parent)
        .into_par_iter()
        .filter_map(|placed| propose(&from, placed, noise))
        .collect();
    proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
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

/// What may be added to a set.
pub(crate) fn candidates(parent: &Node) -> Vec<Placed> {
    let mut candidates = parent.setup.structure.candidates();
    let on = parent.setup.structure.effects().iter();
    if on.filter(|placed| placed.effect.by_clock).count() >= BY_CLOCK {
        candidates.retain(|placed| !placed.effect.by_clock);
    }
    candidates
}

/// Whether some effect more makes a promise that is `worth` it.
pub(crate) fn any_promise(
    parent: &Node,
    noise: &Noise,
    worth: impl Fn(&Setup, f64) -> bool + Sync,
) -> bool {
    let from = Parent::new(parent);
    candidates(parent).into_par_iter().any(|placed| {
        propose(&from, placed, noise)
            .is_some_and(|proposal| worth(&proposal.setup, proposal.promise))
    })
}

/// The node with one given effect more, fitted so far; `known` is a fit of a larger set, whose values serve as a
/// further start.
pub(crate) fn place<'a>(
    parent: &Node<'a>,
    placed: Placed,
    known: &Node<'a>,
    noise: &Noise,
    stopping: Stopping,
) -> Option<Node<'a>> {
    let from = Parent::new(parent);
    let proposal = propose(&from, placed, noise).or_else(|| {
        // Out of time the larger set's values are the only start.
        let setup = from.with(placed)?;
        let mut added = parent.added.clone();
        added.push(placed);
        Some(Proposal {
            setup,
            added,
            starts: Vec::new(),
            promise: f64::INFINITY,
        })
    });
    let mut proposal = proposal?;
    let start = transfer(known, &proposal.setup);
    // First, since out of time one start is followed.
    proposal.starts.insert(0, start.into());
    realise(proposal, noise, stopping)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::simulated;

    #[test]
    fn a_swing_of_a_quiet_output_shows_beside_a_noisy_one() {
        let problem = simulated::two_levels(3);
        let records = &problem.records;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let count = records[0].len();
        let noisy = ct_signals::noise::white(count, 5.0, &mut rng);
        let mut quiet = ct_signals::noise::white(count, 0.05, &mut rng);
        let swing = 60.0;
        for (value, t) in quiet.iter_mut().zip(&records[0].time) {
            *value += 0.05 * (TAU * t / swing).sin();
        }
        let periods: Vec<f64> = (0..60)
            .map(|k| 10.0 * 1.05_f64.powi(k))
            .chain([swing])
            .collect();
        let shown = most_shown(periods, records, vec![noisy, quiet]);
        assert_eq!(shown[0], swing, "{shown:?}");
    }
}
