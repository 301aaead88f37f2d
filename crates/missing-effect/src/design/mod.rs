//! Design of the next experiment, which distinguishes two effects that the records do not distinguish.
//!
//! Each of the two is fitted to the records. Sequences within the user's limits are then applied to either fit, and it is
//! reckoned how far the other stays behind what they show (`separation.rs`). Those of the largest predicted power are confirmed by refits.

mod alternatives;
mod experiments;
mod limits;
mod plan;
mod second_sensor;
mod separation;
mod simulated;

#[cfg(test)]
mod tests;

use std::time::Instant;

use plants::{Domain, EffectInfo, Placed};

pub use effect_search::design::{Kind, Power, Prospect};
pub use limits::{Bounds, Limits, NoExperiment};
pub use plan::{Alternative, Candidate, Design, Reach, SecondSensor, Sequence, Wider};

use crate::{
    Error, Options, Problem, Progress,
    base::{
        believed::base,
        control_loop::slowest_time_constant,
        gaps::Mended,
        time_limit::{allow, effort},
    },
    diagnostics::step,
    fit::{
        criterion::GROUP_MARGIN,
        node::{FINE, Node, in_time, refine},
        noise_model::noise_of,
        proposal::place,
    },
};
use experiments::Search;
use separation::Metric;
use simulated::Loop;

/// An effect, and the vessel it acts in; `None`: among the vessels in which it fits the records well, the one in which it is closest to the
/// other effect.
#[derive(Debug, Clone, Copy)]
pub struct Candidacy {
    /// The effect.
    pub effect: &'static EffectInfo,
    /// The vessel.
    pub vessel: Option<usize>,
}

impl Candidacy {
    fn is_that_of(self, other: Self) -> bool {
        let same_place = self.vessel.is_none() || other.vessel.is_none();
        self.effect.id == other.effect.id && (same_place || self.vessel == other.vessel)
    }
}

/// Shares of the time limit after which the phases end: the fit of the believed model, ...
const BELIEVED: f64 = 0.15;
/// ... fits of both effects, ...
const BOTH: f64 = 0.3;
/// ... trials of experiments, ...
const TRIALS: f64 = 0.5;
/// ... refits of the best experiments, ...
pub(crate) const REFITS: f64 = 0.7;
/// ... and evaluation of alternatives.
pub(crate) const INSTEAD: f64 = 0.8;

/// Both alternatives on the records, and the noise model for their comparison.
struct Fitted<'a> {
    nodes: [Node<'a>; 2],
    base: Node<'a>,
    metric: Metric,
}

/// Proposes the next experiment.
///
/// # Errors
/// [`Error::Design`] where the limits or the effects do not allow one; else where the records, the plant or the fit do not allow it.
pub fn design(
    problem: &Problem,
    between: [Candidacy; 2],
    limits: &Limits,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design, Error> {
    let begun = Instant::now();
    problem.check()?;
    let mended = Mended::of(problem, options)?;
    let problem = mended.as_ref().map_or(problem, |mended| &mended.problem);
    if between[0].is_that_of(between[1]) {
        let effect = between[0].effect.id.to_string();
        return Err(NoExperiment::SameEffect { effect }.into());
    }
    for record in &problem.records {
        if let Some(second) = record.inputs.get(1) {
            return Err(NoExperiment::TwoCommands {
                record: record.name.clone(),
                first: record.inputs[0].name.clone(),
                second: second.name.clone(),
            }
            .into());
        }
    }
    let unit = problem
        .records
        .first()
        .map(|record| &record.outputs[0].unit);
    for Candidacy { effect, .. } in between {
        Domain::check(effect, problem.plant, unit.map_or("", |unit| unit))?;
    }
    // Errors in the limits are reported before the computation as far as possible.
    let looped = problem.controller.is_some() && options.simulate_loop;
    let has_reference = problem.records.iter().all(|r| !r.references.is_empty());
    Bounds::new(problem, limits, looped && has_reference, 0)?;
    progress(Progress {
        phase: "fitting both effects",
        done: 0,
        total: 1,
    });
    let fitted = fitted(problem, between, options)?;
    allow(&fitted.base, TRIALS);
    let in_loop = !fitted.base.setup.replays().is_empty();
    let parameters = fitted.nodes.iter().map(|node| node.setup.free().len());
    let bounds = Bounds::new(problem, limits, in_loop, parameters.max().unwrap_or(0))?;
    let search = Search {
        problem,
        nodes: &fitted.nodes,
        metric: &fitted.metric,
        into: match &problem.controller {
            Some(controller) if in_loop => Loop::Closed(controller),
            _ => Loop::Open,
        },
        time_constant: slowest_time_constant(fitted.best())?,
        progress,
    };
    let found = search.run(&bounds, limits.seed)?;
    let of_applied = match (problem.records[0].references.first(), in_loop) {
        (Some(reference), true) => reference,
        _ => &problem.records[0].inputs[0],
    };
    let design = Design {
        schema: 1,
        between: [0, 1].map(|i| alternative(&fitted, i)),
        bic_ahead: search.ahead(),
        prospect: match effect_search::design::prospect(&found.best.power) {
            // A power without confirmation by a refit is only a prediction.
            Prospect::Decides if !found.best.refitted => Prospect::May,
            prospect => prospect,
        },
        in_loop,
        candidates: found.candidates,
        overfull: found.overfull,
        limited: found.limited,
        again: found.again,
        wider: found.wider,
        times_as_long: found.times_as_long,
        second_sensor: found.second_sensor,
        experiment: Sequence {
            name: of_applied.name.clone(),
            unit: of_applied.unit.clone(),
            time: (0..found.values.len())
                .map(|k| k as f64 * bounds.interval)
                .collect(),
            values: found.values,
        },
        limits: bounds,
        noise_floor: fitted.metric.noise_floor(),
        effort: effort(&fitted.base, options),
        plant: problem.plant.id().to_string(),
        output_unit: problem.records[0].outputs[0].unit.clone(),
        seconds: begun.elapsed().as_secs_f64(),
    };
    Ok(design)
}

impl<'a> Fitted<'a> {
    fn best(&self) -> &Node<'a> {
        let [a, b] = &self.nodes;
        if b.fit.bic() < a.fit.bic() { b } else { a }
    }
}

/// Both effects fitted to the records, weighted by the noise model of the better one.
fn fitted<'a>(
    problem: &'a Problem,
    between: [Candidacy; 2],
    options: &Options<'a>,
) -> Result<Fitted<'a>, Error> {
    let (base, _) = base(problem, options, BELIEVED)?;
    allow(&base, BOTH);
    for Candidacy { effect, vessel } in between {
        let vessel = vessel.unwrap_or_else(|| effect.usual_site(problem.plant, &problem.known));
        base.setup.structure.with(Placed { effect, vessel })?;
    }
    let white = base.setup.white_noise();
    let fits = |candidacy: Candidacy| -> Result<Vec<Node<'a>>, NoExperiment> {
        let sites = candidacy.effect.sites(problem.plant, &problem.known);
        let mut nodes: Vec<Node<'a>> = sites
            .filter(|site| candidacy.vessel.is_none_or(|vessel| vessel == *site))
            .filter_map(|vessel| {
                let effect = candidacy.effect;
                place(&base, Placed { effect, vessel }, &base, &white, FINE)
            })
            .collect();
        let bics = nodes.iter().map(|node| node.fit.bic());
        let open = bics.fold(f64::INFINITY, f64::min) + GROUP_MARGIN;
        nodes.retain(|node| node.fit.bic() <= open);
        if nodes.is_empty() {
            return Err(no_fit(candidacy));
        }
        Ok(nodes)
    };
    let [first, second] = [fits(between[0])?, fits(between[1])?];
    // If the vessels of the effects are not determined, the comparison uses the closest pair.
    let rough = first
        .iter()
        .flat_map(|a| second.iter().map(move |b| [a, b]))
        .min_by(|pair, other| apart(*pair).total_cmp(&apart(*other)))
        .ok_or_else(|| no_fit(between[0]))?;
    let better = usize::from(rough[1].fit.bic() < rough[0].fit.bic());
    let noise = noise_of(rough[better])?;
    let refined = |i: usize| -> Result<Node<'a>, Error> {
        place(&base, rough[i].added[0], rough[i], &noise, FINE)
            .ok_or_else(|| no_fit(between[i]).into())
    };
    let nodes = [refined(0)?, refined(1)?];
    let fit = &nodes[usize::from(nodes[1].fit.bic() < nodes[0].fit.bic())].fit;
    let scales = fit.scales();
    let base = refine(&base, &noise, &[])?;
    // An incomplete fit would seem identical to the model without the effect.
    if base.setup.out_of_time() {
        return Err(NoExperiment::OutOfTime.into());
    }
    Ok(Fitted {
        nodes,
        base,
        metric: Metric { noise, scales },
    })
}

/// Sum of squared differences of two fits on the records, outputs weighted.
fn apart([a, b]: [&Node; 2]) -> f64 {
    let residuals = |node: &Node| {
        let series = node.setup.residuals(&node.fit.x)?;
        Ok::<_, Error>(in_time(&node.setup, &series, &a.fit.weights))
    };
    let (Ok(a), Ok(b)) = (residuals(a), residuals(b)) else {
        return f64::INFINITY;
    };
    let pairs = a.iter().zip(&b);
    pairs.map(|(a, b)| (a - b) * (a - b)).sum()
}

fn no_fit(candidacy: Candidacy) -> NoExperiment {
    NoExperiment::NoFit {
        effect: candidacy.effect.id.to_string(),
    }
}

fn alternative(fitted: &Fitted, i: usize) -> Alternative {
    let node = &fitted.nodes[i];
    let placed = node.added[0];
    let parameters = step::parameters(&node.setup, &node.fit, &node.fit.std_errors());
    let own = format!("{}.", placed.effect.id);
    Alternative {
        effect: placed.effect.id.to_string(),
        place: step::place_name(node, placed),
        size: parameters.into_iter().find(|p| p.name.starts_with(&own)),
        at_the_edge: node.at_the_edge(placed),
        rmse: node.fit.mean_rmse(),
        bic_gain: node.gain_over(&fitted.base),
        confirm: match node.setup.structure.domain {
            Domain::Hydraulic => placed.effect.confirm.to_string(),
            Domain::General => String::new(),
        },
    }
}
