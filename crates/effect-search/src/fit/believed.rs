//! The believed model, including the effects of the model file, fitted to the records; and the candidates.
//!
//! The candidates follow from what the model without effects visits. The listed effects are added one after the other, each from its best
//! start, as the search would add them.

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_model::effects::{
    Candidate, OwnCandidate, OwnError, Visited, candidates_keeping, level_shifts, own_candidates,
    shapes_keeping,
};
use ct_model::{Model, ModelSpec};
use ct_signals::Record;
use estimation::{Fit, Noise, Residuals, within};
use greybox::{FitOptions, ModelSetup, possible_reading_steps};

use crate::Error;
use crate::base::control_loop::{enclose, first_fit, is_missed, varies};
use crate::base::problem::{Kept, Limit, Options, Problem};
use crate::fit::node::{Context, FINE, Node};

/// The believed model, including the effects of the model file.
#[derive(Debug, Clone)]
pub struct Believed {
    /// The model; the values of its parameters are fitted ones, with white noise.
    pub spec: ModelSpec,
    /// Numbers of the record that each effect contains, by effect identifiers.
    pub record_numbers: BTreeMap<String, BTreeMap<String, f64>>,
}

/// Fits the believed model, then adds the effects of [`Problem::effects`] one after the other.
///
/// # Errors
/// Where the records, the model or the fit do not allow it, or an effect cannot act in the model.
pub fn believed(problem: &Problem, options: &Options) -> Result<Believed, Error> {
    let (context, node) = begin(problem, options, Limit::new(options))?;
    let mut spec = node.spec().clone();
    for (parameter, value) in spec.parameters.iter_mut().zip(&node.fit.x) {
        parameter.value = *value;
    }
    let record_numbers = node.added.iter().map(|&i| &context.candidates[i]);
    let record_numbers = record_numbers.map(|c| (c.id.clone(), c.numbers_of_record()));
    Ok(Believed {
        spec,
        record_numbers: record_numbers.collect(),
    })
}

/// All effects that can act in a model for the visited ranges: those of the catalogue with kept record numbers, those of the user, then
/// smooth functions ([`Candidate::is_shape`]), which searches do not use. A function that is kept under a name of the user's choice
/// ([`Kept::function`]) has this name.
///
/// # Errors
/// As [`own_candidates`].
pub fn all_candidates(
    spec: &ModelSpec,
    visited: &Visited,
    kept: &BTreeMap<String, Kept>,
    own: &BTreeMap<String, OwnCandidate>,
) -> Result<Vec<Candidate>, OwnError> {
    let numbers = kept.iter().map(|(id, kept)| {
        let id = kept.function.as_ref().unwrap_or(id);
        (id.clone(), kept.numbers.clone())
    });
    let numbers = numbers.collect();
    let mut all = candidates_keeping(spec, visited, &numbers);
    all.extend(own_candidates(spec, own)?);
    let shapes = shapes_keeping(spec, visited, &numbers);
    all.extend(shapes.into_iter().map(|shape| {
        let mut named = kept.iter();
        let named = named.find(|(_, kept)| kept.function.as_ref() == Some(&shape.id));
        match named {
            Some((name, _)) => shape.named(spec, name),
            None => shape,
        }
    }));
    Ok(all)
}

/// Fits the believed model, and lists the candidates.
pub(crate) fn begin<'a>(
    problem: &'a Problem,
    options: &Options<'a>,
    limit: Limit<'a>,
) -> Result<(Context<'a>, Node), Error> {
    let outputs = 0..problem.spec.outputs.len();
    let reading_steps = outputs
        .map(|o| possible_reading_steps(&problem.records, o, options.thresholds.kept_starts));
    let mut context = Context {
        problem,
        reading_steps: reading_steps.collect(),
        candidates: Vec::new(),
        shapes: Vec::new(),
        level_shifts: Vec::new(),
        scales: None,
        ties: Vec::new(),
        absorbed: Vec::new(),
        tolerance: ModelSetup::LARGEST_TOLERANCE,
        simulated_loop: None,
        control_loop: None,
        limit,
        thresholds: options.thresholds,
    };
    let fit_options = FitOptions {
        starts: options.starts,
        seed: options.seed,
        ..FitOptions::default()
    };
    let model = Arc::new(Model::new(problem.spec.clone()));
    let controllers = match options.simulate_loop {
        true => &problem.controllers[..],
        false => &[],
    };
    // The model is compared with sets of effects and needs their criterion, in which every output has a variance of its own: `fit` weights the
    // outputs by their noise.
    let (fit, needed) = {
        let setup = context.setup(&model)?;
        let (setup, fit) = first_fit(setup, controllers, &fit_options, &options.thresholds)?;
        (fit, setup.simulated_loop().cloned())
    };
    context.simulated_loop = needed;
    let mut bare = Node {
        added: Vec::new(),
        model: model.clone(),
        fit,
    };
    if problem.spec.outputs.len() > 1 {
        let white = Noise::white(problem.spec.outputs.len());
        bare = context.refitted(&bare, &white, FINE)?;
    }
    bare = context.enclosed(bare, options)?;
    if !context.needs_loop() {
        require_stable(&context.setup(&model)?, &bare.fit)?;
    }
    let (visited, tolerance) = {
        let (setup, fit) = (context.setup(&bare.model)?, &bare.fit);
        let visited = visited(problem, &setup, fit)?;
        let noise = setup.output_noise(&fit.x);
        let tolerance = noise.map(|noise| setup.sufficient_tolerance(&fit.x, &noise));
        (visited, tolerance)
    };
    let tolerance = tolerance.unwrap_or(ct_model::TOLERANCE);
    if tolerance < context.tolerance {
        let finer = Context {
            tolerance,
            ..context.clone()
        };
        let white = Noise::white(problem.spec.outputs.len());
        // With this tolerance a state that grows may need more steps than a simulation may take.
        if let Ok(again) = finer.refitted(&bare, &white, FINE) {
            bare = again;
            context.tolerance = tolerance;
        }
    }
    context.level_shifts = level_shifts(&problem.spec, &visited);
    let mut all = all_candidates(&problem.spec, &visited, &problem.kept, &problem.candidates)?;
    all.retain(|candidate| {
        problem.effects.contains(&candidate.id) || !problem.left_out.contains(&candidate.id)
    });
    let is_searched =
        |candidate: &Candidate| !candidate.is_shape() || problem.effects.contains(&candidate.id);
    (context.candidates, context.shapes) = all.into_iter().partition(is_searched);
    (context.ties, context.absorbed) = context.ties(&bare);
    let mut node = bare;
    for id in &problem.effects {
        node = context.with_listed(node, id)?;
    }
    if let Some(why) = context.hard_nonlinearity(&node)? {
        return context.not_simulated(&node, why);
    }
    Ok((context, node))
}

impl<'a> Context<'a> {
    /// The believed model in its loop, if that can be simulated.
    fn enclosed(&mut self, bare: Node, options: &Options) -> Result<Node, Error> {
        let Node { added, model, fit } = bare;
        let controllers = (&self.problem.controllers[..], options.simulate_loop);
        let (fit, simulated, control_loop) = {
            let timed = model.spec().reads_time();
            let setup = self.setup(&model)?;
            let enclosed = enclose(setup, fit, controllers, !timed, (FINE, &self.thresholds))?;
            let simulated = enclosed.setup.simulated_loop().cloned();
            (enclosed.fit, simulated, enclosed.control_loop)
        };
        (self.simulated_loop, self.control_loop) = (simulated, control_loop);
        Ok(Node { added, model, fit })
    }

    /// A set with one more effect of the model file, fitted from its best start and from the values of the file.
    fn with_listed(&self, node: Node, id: &str) -> Result<Node, Error> {
        let white = Noise::white(self.problem.spec.outputs.len());
        let Some(i) = self.candidates.iter().position(|c| c.id == *id) else {
            return Err(Error::UnknownEffect { id: id.to_string() });
        };
        let no_start = || Error::NoStart { id: id.to_string() };
        let trial = self.trial(&node, i, &white)?.ok_or_else(no_start)?;
        let mut starts = trial.starts;
        starts.extend(self.rounding_starts(&node, i, &trial.model)?);
        if let Some(kept) = self.problem.kept.get(id) {
            let mut start = starts.first().ok_or_else(no_start)?.clone();
            let bounds = self.setup(&trial.model)?.bounds().to_vec();
            let parameters = trial.model.spec().parameters.iter();
            for (at, parameter) in parameters.enumerate() {
                let mut own = self.candidates[i].parameters.iter();
                let own = own.find(|own| own.name == parameter.about.name);
                if let Some(value) = own.and_then(|own| kept.start.get(&own.short))
                    && !self.problem.known.contains_key(&parameter.about.name)
                {
                    start[at] = within(*value, bounds[at]);
                }
            }
            starts.insert(0, start);
        }
        let mut added = node.added.clone();
        added.push(i);
        self.fitted(added, trial.model, starts, &white, FINE)
    }
}

/// Growth of a deviation over a record, as a power of e, beyond which no initial state is known well enough for a simulation.
const GROWS: f64 = 23.0;

/// A simulation diverges if it leaves the range of the readings by this multiple of it.
const FAR: f64 = 100.0;

/// Refuses a model that is unstable at its start values and diverges from the records there, if the error of the fit at an output is above the
/// standard deviation of its readings. A model that grows to a limit does not diverge.
fn require_stable(setup: &ModelSetup, fit: &Fit) -> Result<(), Error> {
    let Some(growth_time) = setup.growth_time(setup.start()) else {
        return Ok(());
    };
    let longest = setup.records().iter().map(Record::duration);
    if longest.fold(0.0, f64::max) < GROWS * growth_time || !diverges(setup) {
        return Ok(());
    }
    let outputs = &setup.records()[0].outputs;
    for (o, (output, error)) in outputs.iter().zip(&fit.rmse).enumerate() {
        if is_missed(setup, o, *error) {
            return Err(Error::Unstable {
                output: output.name.clone(),
                unit: output.unit.clone(),
                error: *error,
                varies: varies(setup, o),
                growth_time,
                longest: ModelSetup::longest_followed(growth_time),
            });
        }
    }
    Ok(())
}

/// Whether the simulation with the start values leaves the range of the readings by far, or cannot go on.
fn diverges(setup: &ModelSetup) -> bool {
    let Some(simulated) = setup.simulate(setup.start()) else {
        return true;
    };
    let measured = setup.records().iter().flat_map(|record| &record.outputs);
    measured.zip(simulated).any(|(measured, simulated)| {
        let (low, high) = measured.range();
        let far = FAR * (high - low);
        simulated
            .iter()
            .any(|y| !(low - far..=high + far).contains(y))
    })
}

/// Ranges that the fitted model visits in all records.
fn visited(problem: &Problem, setup: &ModelSetup, fit: &Fit) -> Result<Visited, Error> {
    let mut all: Option<Visited> = None;
    let variables = Visited::simulated(&problem.spec);
    let setup = setup.clone().with_tolerance(ct_model::TOLERANCE);
    let series = setup.simulate_variables(&fit.x, &variables);
    let mut series = series.ok_or(Error::NoSimulation)?.into_iter();
    for (r, record) in problem.records.iter().enumerate() {
        let inputs = record.inputs.iter().map(|input| input.values.clone());
        let series = variables.iter().copied().zip(series.by_ref());
        let own = Visited::of_series(
            series.collect(),
            inputs.collect(),
            &setup.model_time(r),
            &problem.time_unit_name,
        );
        match &mut all {
            None => all = Some(own),
            Some(all) => all.join(&own),
        }
    }
    all.ok_or_else(|| greybox::Error::NoRecord.into())
}
