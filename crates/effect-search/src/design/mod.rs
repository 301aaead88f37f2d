//! Design of the next experiment, which distinguishes two effects that the records do not distinguish.
//!
//! Each of the two is fitted to the records. Either is then simulated with sequences within the user's limits, at one input or at several
//! at once, and it is computed how far the other stays behind what they show ([`least`]). Those of the largest predicted power are confirmed by refits: the
//! other one is fitted to what the first gives on the existing records and in the experiment, both free of noise, and its misfit to the
//! existing records alone is taken off.
//!
//! An experiment begins where the first record did, on a clock of its own, and without a controller: the inputs are what is applied.

mod comparison;
mod limits;
mod power;
mod result;
mod separation;
mod sequences;

use estimation::Noise;
use rayon::prelude::*;

use comparison::Comparison;
pub use limits::{Limits, NoExperiment};
pub use power::{Power, Prospect, SUFFICIENT_POWER, by_use, power, prospect, times_as_long};
pub use result::{
    Alternative, Design, Experiment, InputRange, InputSequence, InputSequenceKind, Reach, Sequences,
};
pub use separation::{information, least};
pub use sequences::{Kind, Room, Sequence, sequences};

use crate::Error;
use crate::base::problem::{Limit, Options, Phase, Problem};
use crate::diagnose::Progress;
use crate::fit::believed::begin;
use crate::fit::node::{Context, FINE, Node};
use limits::{Applied, Bounds};

/// The slowest time constant for which the sequences are designed, as a share of the experiment's length, since the process may not be known.
const SLOWEST: f64 = 0.1;
/// Experiments of a round of refits, and the most in all.
const ROUND: usize = 4;
const MOST_REFITS: usize = 16;
/// Largest useful number of repetitions of an experiment.
const MOST_TIMES: f64 = 20.0;

/// Sequences of the inputs that change, and a value of every input for each sample of an experiment.
type Sequenced = (Vec<InputSequenceKind>, Vec<Vec<f64>>);
/// An experiment, and a value of every input for each of its samples.
type Tried = (Experiment, Vec<Vec<f64>>);

/// Proposes the next experiment.
///
/// # Errors
/// [`Error::Design`] where the limits or the effects do not allow one; else where the records, the model or the fit do not.
pub fn design(
    problem: &Problem,
    between: [&str; 2],
    limits: &Limits,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design, Error> {
    let tell = |phase| progress(Progress { phase });
    if between[0] == between[1] {
        let effect = between[0].to_string();
        return Err(NoExperiment::SameEffect { effect }.into());
    }
    if let Some(id) = between
        .iter()
        .find(|id| problem.effects.iter().any(|own| own == *id))
    {
        let effect = (*id).to_string();
        return Err(NoExperiment::InModel { effect }.into());
    }
    // Errors in the limits are reported before the computation as far as possible.
    Bounds::new(problem, limits, 0)?;
    tell("fitting the model");
    let limit = Limit::new(options);
    limit.begin(Phase::Believed);
    let (context, base) = begin(problem, options, limit)?;
    if context.needs_loop() {
        return Err(NoExperiment::NeedsLoop.into());
    }
    tell("fitting both effects");
    context.limit.begin(Phase::White);
    let (base, nodes, noise) = context.alternatives(&base, between)?;
    if context.limit.passed() {
        return Err(NoExperiment::OutOfTime.into());
    }
    let parameters = nodes.iter().map(|node| node.fit.parameters);
    let bounds = Bounds::new(problem, limits, parameters.max().unwrap_or(0))?;
    let better = usize::from(nodes[1].fit.bic() < nodes[0].fit.bic());
    let scales = nodes[better].fit.scales();
    let comparison = Comparison::new(&context, &nodes, &noise, scales)?;
    tell("trying experiments");
    context.limit.begin(Phase::Coloured);
    let all = candidates(problem, &bounds, limits.seed)?;
    let mut tried: Vec<Tried> = all
        .into_par_iter()
        .filter(|_| !context.limit.leaves_out("some of the experiments"))
        .filter_map(|(applied, inputs)| {
            Some((comparison.tried(applied, &inputs, &bounds)?, inputs))
        })
        .collect();
    sort(&mut tried);
    tell("confirming by refits");
    context.limit.begin(Phase::Groups);
    let mut done = 0;
    while done < MOST_REFITS
        && tried.first().is_some_and(|(first, _)| !first.refitted)
        && !context.limit.leaves_out("refits of experiments")
    {
        let wanted = tried
            .iter_mut()
            .filter(|(experiment, _)| !experiment.refitted);
        let mut wanted: Vec<&mut Tried> = wanted.take(ROUND).collect();
        done += wanted.len();
        wanted.par_iter_mut().for_each(|(experiment, inputs)| {
            experiment.power = comparison
                .confirmed(inputs, &bounds)
                .unwrap_or(power([0.0; 2], [0.0; 2]));
            experiment.refitted = true;
        });
        sort(&mut tried);
    }
    // After this number of rounds, the best refitted experiment is used.
    tried.sort_by_key(|(experiment, _)| !experiment.refitted);
    let Some((best, inputs)) = tried.first().cloned() else {
        return Err(NoExperiment::OutOfTime.into());
    };
    let ahead = comparison.ahead();
    let times_as_long = times_as_long(&best.power, ahead)
        .filter(|times| *times <= MOST_TIMES)
        .map(|times| times.ceil() as usize);
    let names = || problem.records[0].outputs.iter().map(|y| y.name.clone());
    Ok(Design {
        schema: 1,
        model: problem.spec.name.clone(),
        control_loop: context.control_loop.clone(),
        bic_ahead: ahead[0],
        prospect: match prospect(&best.power) {
            // A power without confirmation by a refit is only a prediction.
            Prospect::Decides if !best.refitted => Prospect::May,
            prospect => prospect,
        },
        between: nodes
            .each_ref()
            .map(|node| alternative(&context, &base, node)),
        ranges: bounds
            .applied
            .iter()
            .map(|(_, range, _)| range.clone())
            .collect(),
        duration: bounds.duration,
        again: comparison.again(&bounds),
        times_as_long,
        experiment: Sequences {
            time: bounds.time(),
            inputs: problem
                .spec
                .inputs
                .iter()
                .zip(inputs)
                .map(|(input, values)| InputSequence {
                    input: input.about.name.clone(),
                    unit: input.about.unit.clone(),
                    values,
                })
                .collect(),
        },
        experiments: tried
            .into_iter()
            .map(|(experiment, _)| experiment)
            .collect(),
        noise: names().zip(comparison.scales().iter().copied()).collect(),
        left_out: context.limit.left_out(),
        seconds: context.limit.seconds(),
    })
}

impl Context<'_> {
    /// The believed model with each of the two effects, weighted by the noise model of the better one.
    fn alternatives(
        &self,
        base: &Node,
        between: [&str; 2],
    ) -> Result<(Node, [Node; 2], Noise), Error> {
        let white = Noise::white(self.problem.spec.outputs.len());
        let fitted = |id: &str| -> Result<Node, Error> {
            let known = self.candidates.iter().position(|c| c.id == *id);
            let i = known.ok_or_else(|| Error::UnknownEffect { id: id.to_string() })?;
            let no_fit = || NoExperiment::NoFit {
                effect: id.to_string(),
            };
            let trial = self.trial(base, i, &white)?.ok_or_else(no_fit)?;
            let mut added = base.added.clone();
            added.push(i);
            let fit =
                |starts| self.fitted(added.clone(), trial.model.clone(), starts, &white, FINE);
            // The model without the effect may have its minimum elsewhere.
            let found = fit(trial.starts.clone())?;
            let own = self.own_minimum(&trial.model).and_then(|x| fit(vec![x]));
            let lower = match own {
                Ok(own) if own.fit.cost < found.fit.cost => own,
                _ => found,
            };
            Ok(self.in_lowest_minimum(lower, base.added.len(), &white))
        };
        let rough = [fitted(between[0])?, fitted(between[1])?];
        let better = usize::from(rough[1].fit.bic() < rough[0].fit.bic());
        let (noise, _) = self.noise_of(&rough[better])?;
        let refitted = |node: &Node| self.refitted(node, &noise, FINE);
        let nodes = [refitted(&rough[0])?, refitted(&rough[1])?];
        Ok((refitted(base)?, nodes, noise))
    }
}

impl Bounds {
    /// Instants of an experiment \[s\].
    fn time(&self) -> Vec<f64> {
        (0..self.samples)
            .map(|k| k as f64 * self.interval)
            .collect()
    }
}

fn alternative(context: &Context, base: &Node, node: &Node) -> Alternative {
    let last = node.added[node.added.len() - 1];
    let candidate = &context.candidates[last];
    let outputs = &context.problem.records[0].outputs;
    Alternative {
        effect: candidate.id.clone(),
        sizes: candidate
            .parameters
            .iter()
            .filter_map(|p| Some((p.short.clone(), node.value(&p.name)?)))
            .collect(),
        bic_gain: node.gain_over(base),
        rmse_per_output: outputs
            .iter()
            .map(|y| y.name.clone())
            .zip(node.fit.rmse.iter().copied())
            .collect(),
    }
}

/// Every sequence at every input that is applied, the others held at their median; then sequences of all of them at once; then those of every
/// input with all others held at their lower, or all at their upper end: an effect may be absent where they usually are.
fn candidates(problem: &Problem, bounds: &Bounds, seed: u64) -> Result<Vec<Sequenced>, Error> {
    let held: Vec<Vec<f64>> = bounds
        .held
        .iter()
        .map(|value| vec![*value; bounds.samples])
        .collect();
    let applied = |input: usize, sequence: &Sequence| InputSequenceKind {
        input: problem.spec.inputs[input].about.name.clone(),
        kind: sequence.kind,
        low: sequence.low,
        high: sequence.high,
        clock: sequence.clock,
        levels: sequence.levels,
    };
    let constant = |(_, range, _): &Applied, value: f64| InputSequenceKind {
        input: range.input.clone(),
        kind: Kind::Constant,
        low: value,
        high: value,
        clock: bounds.duration,
        levels: None,
    };
    let mut of_each = Vec::new();
    for (n, (_, _, room)) in bounds.applied.iter().enumerate() {
        // Inputs that change simultaneously use independent sequences.
        let seed = seed.wrapping_add(n as u64);
        of_each.push(sequences(room, SLOWEST * bounds.duration, seed)?);
    }
    let mut all = Vec::new();
    for ((input, ..), sequences) in bounds.applied.iter().zip(&of_each) {
        for sequence in sequences {
            let mut inputs = held.clone();
            inputs[*input].clone_from(&sequence.values);
            all.push((vec![applied(*input, sequence)], inputs));
        }
    }
    if bounds.applied.len() > 1 {
        let drawn = |sequence: &&Sequence| matches!(sequence.kind, Kind::Binary | Kind::MultiLevel);
        let drawn: Vec<Vec<&Sequence>> = of_each
            .iter()
            .map(|all| all.iter().filter(drawn).collect())
            .collect();
        let fewest = drawn.iter().map(Vec::len).min().unwrap_or(0);
        for k in 0..fewest {
            let mut inputs = held.clone();
            let mut each = Vec::new();
            for ((input, ..), own) in bounds.applied.iter().zip(&drawn) {
                inputs[*input].clone_from(&own[k].values);
                each.push(applied(*input, own[k]));
            }
            all.push((each, inputs));
        }
        for end in [
            |range: &InputRange| range.low,
            |range: &InputRange| range.high,
        ] {
            for (own, sequences) in bounds.applied.iter().zip(&of_each) {
                let others = || bounds.applied.iter().filter(|other| other.0 != own.0);
                // Their medians may be the ends.
                if others().all(|(input, range, _)| bounds.held[*input] == end(range)) {
                    continue;
                }
                let mut held = held.clone();
                for (input, range, _) in others() {
                    held[*input].fill(end(range));
                }
                for sequence in sequences {
                    let mut inputs = held.clone();
                    inputs[own.0].clone_from(&sequence.values);
                    let others = others().map(|other| constant(other, end(&other.1)));
                    let each = std::iter::once(applied(own.0, sequence)).chain(others);
                    all.push((each.collect(), inputs));
                }
            }
        }
    }
    Ok(all)
}

/// The best first.
fn sort(tried: &mut [Tried]) {
    tried.sort_by(|(a, _), (b, _)| by_use((&a.power, a.excursion), (&b.power, b.excursion)));
}
