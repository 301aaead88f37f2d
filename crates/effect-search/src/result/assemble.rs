//! The result of a search as plain values: the believed model, then the effects one by one, with the change of the error.

use std::collections::BTreeMap;

use ct_signals::ArModel;
use estimation::{Fit, Noise, moved_by_weighting};
use greybox::{Robust, not_determined, weighted_rms};

use crate::accept::quantisation::quantisation;
use crate::base::control_loop::widened;
use crate::base::loop_state::{ControlLoop, NotSimulated};
use crate::diagnostics::detectable::leading;
use crate::fit::estimate::{Estimate, sizes};
use crate::fit::node::{Context, FINE, Node};
use crate::result::diagnosis::{Diagnosis, NoiseFloor, Single, Step, Verdict};
use crate::result::output_step::output_steps;
use crate::search::grow::Grown;
use crate::{Error, held_out};

/// A result.
#[derive(Clone)]
pub(crate) struct Finding<'a> {
    /// The believed model.
    pub base: &'a Node,
    pub last: &'a Node,
    /// Rounding effects of the last model that no search found, but the readings show.
    pub rounded: Vec<usize>,
    /// The fit that gives the reported noise: the last model with the noise model of its own residual.
    pub own: &'a Fit,
    pub verdict: Verdict,
    pub groups: Vec<Vec<usize>>,
    pub not_noise: Option<crate::NotNoise>,
    pub unknown: Option<crate::Unknown>,
    pub share: Option<f64>,
    /// Time of the search \[s\].
    pub seconds: f64,
    pub left_out: Vec<String>,
}

/// The result as values: the ladder of models, sizes, noise, singles.
pub(crate) fn assemble(
    context: &Context,
    grown: &Grown,
    finding: Finding,
) -> Result<Diagnosis, Error> {
    let Finding {
        base,
        last,
        rounded,
        own,
        verdict,
        groups,
        not_noise,
        unknown,
        share,
        seconds,
        left_out,
    } = finding;
    let problem = context.problem;
    let outputs = &problem.records[0].outputs;
    let floors = context.noise_levels(own);
    // All models of the error ladder are fitted on the measured inputs with white noise, each output scaled by its noise, so that their
    // errors are comparable. The last model is fitted again in its loop, with its own noise model, if its residual is noise. A model that needs
    // its loop runs in it always.
    let white = Noise::white(outputs.len());
    let measured = match context.needs_loop() {
        true => context.clone(),
        false => Context {
            simulated_loop: None,
            control_loop: context
                .control_loop
                .as_ref()
                .map(|_| ControlLoop::measured(NotSimulated::AsRequested)),
            ..context.clone()
        },
    };
    let weighted = Context {
        scales: (outputs.len() > 1).then(|| floors.clone()),
        ..measured.clone()
    };
    let mut ladder = ladder(&weighted, base, last, &white)?;
    let mut steps = ladder
        .iter()
        .map(|node| step(&measured, base, node, (&own.noise, &floors)))
        .collect::<Result<Vec<_>, Error>>()?;
    if not_noise.is_none()
        && let (Some(end), Some(shown)) = (ladder.last_mut(), steps.last_mut())
        && let Ok(again) = context.refitted(end, &own.noise, FINE)
    {
        *shown = step(context, base, &again, (&own.noise, &floors))?;
        *end = again;
    }
    let named = |values: &[f64]| -> BTreeMap<String, f64> {
        let names = outputs.iter().map(|y| y.name.clone());
        names.zip(values.iter().copied()).collect()
    };
    let singles: Vec<Single> = grown
        .singles
        .iter()
        .zip(context.detectable(&grown.base, &grown.singles, &own.noise))
        .filter_map(|(node, detectable)| {
            let candidate = &context.candidates[*node.added.last()?];
            let mut sizes = sizes(node, candidate);
            sizes.sort_by_key(|size| leading(candidate).is_none_or(|own| own.name != size.name));
            Some(Single {
                effect: candidate.id.clone(),
                sizes,
                bic_gain: node.gain_over(&grown.of_singles),
                rmse_per_output: named(&node.fit.rmse),
                visibility: detectable.visibility,
                smallest_visible: detectable.smallest,
            })
        })
        .collect();
    let mut ranked: Vec<String> = Vec::new();
    if verdict == Verdict::Adequate {
        ranked.push("none".to_string());
    }
    let rounded = context.ids(&rounded);
    let others = singles.iter().map(|single| &single.effect);
    let others: Vec<String> = others.filter(|id| !rounded.contains(id)).cloned().collect();
    ranked.extend(rounded);
    ranked.extend(others);
    let noise = outputs.iter().zip(own.noise.iter()).zip(&floors);
    let noise = noise.map(|((output, noise), level)| NoiseFloor {
        output: output.name.clone(),
        level: *level,
        innovation: noise.sigma(),
        coefficients: noise.coefficients().to_vec(),
    });
    // In the order of the error ladder.
    let order = &ladder.last().map_or(&last.added, |node| &node.added)[base.added.len()..];
    let groups: Vec<Vec<String>> = order
        .iter()
        .filter_map(|own| groups.iter().find(|group| group.first() == Some(own)))
        .map(|group| context.ids(group))
        .collect();
    let said = groups.iter().flatten().chain(&problem.effects);
    let said = said.chain(singles.iter().map(|single| &single.effect));
    let said = said.chain(unknown.iter().map(|unknown| &unknown.effect));
    let all = || context.candidates.iter().chain(&context.shapes);
    let record_numbers = said
        .filter_map(|id| all().find(|c| c.id == *id))
        .map(|candidate| (candidate.id.clone(), candidate.numbers_of_record()))
        .collect();
    Ok(Diagnosis {
        schema: 4,
        model: problem.spec.name.clone(),
        verdict,
        effects: context.ids(order),
        groups,
        ranked,
        steps,
        share: share.filter(|_| !order.is_empty()),
        not_noise,
        quantisation: quantisation(context, ladder.last().unwrap_or(last)),
        unknown,
        noise: noise.collect(),
        singles,
        record_numbers,
        candidates: context.candidates.len(),
        absorbed: context.absorbed.clone(),
        gaps: problem.gaps,
        control_loop: context.control_loop.clone(),
        left_out,
        seconds: seconds + context.limit.seconds(),
    })
}

/// Error ladder: the believed model, then the effects one by one, each time the one that lowers the error most.
fn ladder(context: &Context, base: &Node, last: &Node, noise: &Noise) -> Result<Vec<Node>, Error> {
    let mut nodes = vec![context.subset(last, base.added.clone(), noise, FINE)?];
    // Fit also from the estimates of the believed model.
    if let Ok(again) = context.refitted(base, noise, FINE)
        && again.fit.cost < nodes[0].fit.cost
    {
        nodes[0] = again;
    }
    nodes[0].fit = nodes[0].fit.clone().continuing(&base.fit);
    let mut rest: Vec<usize> = last.added[base.added.len()..].to_vec();
    while !rest.is_empty() {
        let begun = nodes[nodes.len() - 1].added.clone();
        let mut fits: Vec<Node> = rest
            .iter()
            .filter_map(|&i| {
                let mut added = begun.clone();
                added.push(i);
                context.subset(last, added, noise, FINE).ok()
            })
            .collect();
        fits.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
        if fits.is_empty() {
            break;
        }
        let next = fits.swap_remove(0);
        rest.retain(|i| !next.added[begun.len()..].contains(i));
        nodes.push(next);
    }
    Ok(nodes)
}

/// A step of the result. `noise`: the noise model of the last model, and the noise level of each output.
fn step(
    context: &Context,
    base: &Node,
    node: &Node,
    (noise, floors): (&Noise, &[f64]),
) -> Result<Step, Error> {
    let problem = context.problem;
    let setup = context.setup(&node.model)?;
    let outputs = &problem.records[0].outputs;
    let named = |values: &[f64]| -> BTreeMap<String, f64> {
        let names = outputs.iter().map(|y| y.name.clone());
        names.zip(values.iter().copied()).collect()
    };
    let without_steps = context.without_hard_steps(node).ok().flatten();
    let judged = without_steps.as_ref().unwrap_or(node);
    let errors = std_errors(context, judged)?;
    let errors: Vec<Option<f64>> = (0..setup.names().len())
        .map(|i| errors[position_in(judged, node, i)?])
        .collect();
    let spec = node.spec();
    let units = spec.parameters.iter().map(|p| p.about.unit.clone());
    let states = problem
        .records
        .iter()
        .flat_map(|_| spec.states.iter().map(|s| s.about.unit.clone()));
    let entries = setup.names().iter().zip(units.chain(states)).enumerate();
    let effect_of = |name: &String| {
        let brings = |&&c: &&usize| {
            let own = &context.candidates[c].parameters;
            own.iter().any(|p| p.name == *name)
        };
        let effect = node.added.iter().find(brings);
        effect.map(|&c| context.candidates[c].id.clone())
    };
    let parameters = entries.map(|(i, (name, unit))| Estimate {
        effect: effect_of(name),
        name: name.clone(),
        value: node.fit.x[i],
        std_error: errors[i],
        unit,
        known: !setup.free().contains(&i),
    });
    let test = held_out(&setup, &node.fit, &problem.test)?;
    let mut simulated = setup.simulate(&node.fit.x).unwrap_or_default();
    let noise: Vec<ArModel> = noise.iter().cloned().collect();
    let at_outputs = if simulated.is_empty() {
        Vec::new()
    } else {
        output_steps(&setup, &node.fit, &simulated, &noise, test.as_ref())
    };
    simulated.extend(test.iter().flat_map(|test| test.simulated.iter().cloned()));
    let added = node.added.len() > base.added.len();
    Ok(Step {
        added: added.then(|| {
            context.candidates[node.added[node.added.len() - 1]]
                .id
                .clone()
        }),
        rmse: (outputs.len() == 1).then(|| node.fit.rmse[0]),
        rmse_per_output: named(&node.fit.rmse),
        state_rows: test.as_ref().map(|test| test.state_rows.clone()),
        rmse_test_per_output: test.map(|test| named(&test.rmse)),
        weighted_rmse: weighted_rms(&node.fit.rmse, floors, &node.fit.samples_per_output),
        bic: node.fit.bic(),
        not_determined: not_determined(&context.setup(&judged.model)?, &judged.fit),
        starts: node.fit.starts,
        starts_agree: node.fit.agree,
        outputs: at_outputs,
        simulated,
        parameters: parameters.collect(),
    })
}

/// Standard errors of a set's estimates, for noise that is as long as a search accepts.
fn std_errors(context: &Context, node: &Node) -> Result<Vec<Option<f64>>, Error> {
    let setup = context.setup(&node.model)?;
    let errors = if node.fit.noise.order() > 0 {
        node.fit.std_errors()
    } else {
        let robust: Result<Robust, _> = estimation::robust_with_memory(
            &setup,
            &node.fit,
            context.thresholds.noise_order,
            context.longest_memory(),
        );
        robust.map_or_else(|_| node.fit.std_errors(), |robust| robust.std_errors)
    };
    let scatter = context.scatter(node).sqrt();
    let wider = |error: f64| error * scatter;
    let errors: Vec<Option<f64>> = errors.into_iter().map(|e| e.map(wider)).collect();
    Ok(if ControlLoop::widens(context.control_loop.as_ref()) {
        let order = context.thresholds.noise_order;
        let moved = moved_by_weighting(&setup, &node.fit, order, FINE)?;
        widened(errors, &moved)
    } else {
        errors
    })
}

/// The position in the vector of one set of an entry of another one with the same states.
fn position_in(set: &Node, of: &Node, entry: usize) -> Option<usize> {
    let (parameters, others) = (&set.spec().parameters, &of.spec().parameters);
    match entry.checked_sub(others.len()) {
        Some(state) => Some(parameters.len() + state),
        None => {
            let name = &others[entry].about.name;
            parameters.iter().position(|p| p.about.name == *name)
        }
    }
}
