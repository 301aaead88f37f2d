//! A set of effects with its fit, and the conversion of parameter vectors between sets.

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_model::effects::{Candidate, apply};
use ct_model::{Model, ModelSpec};
use estimation::{Fit, Noise, Start, Stopping, fit_from};
use greybox::{FitOptions, ModelSetup, SimulatedLoop};

use crate::Error;
use crate::base::control_loop::{detected_feedback, hard_nonlinearity};
use crate::base::loop_state::{ControlLoop, NotSimulated};
use crate::base::problem::{Limit, Phase, Problem};
use crate::fit::relations::{Absorbed, Tie};
use crate::thresholds::Thresholds;

/// Stopping criteria of a first fit, which only has to give a rank.
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 25,
    cost: 1e-4,
};
/// Stopping criteria of fits that are reported or compared closely.
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 120,
    cost: 1e-9,
};

/// Data that all sets of one search share.
#[derive(Clone)]
pub(crate) struct Context<'a> {
    pub problem: &'a Problem,
    /// Standard deviation of each output's noise, if it is known already.
    pub scales: Option<Vec<f64>>,
    /// Relative tolerance of simulations ([`ModelSetup::sufficient_tolerance`]).
    pub tolerance: f64,
    /// Quantisation steps that the readings of each output suggest ([`possible_reading_steps`](greybox::possible_reading_steps)).
    pub reading_steps: Vec<Vec<f64>>,
    pub candidates: Vec<Candidate>,
    /// Smooth functions, for the shape of the error that no candidate explains.
    pub shapes: Vec<Candidate>,
    /// A level shift of each reading ([`ct_model::effects::level_shifts`]), which no search adds.
    pub level_shifts: Vec<Candidate>,
    /// For each candidate the first one with a collinear sensitivity ([`Context::ties`]); empty where they are not known.
    pub ties: Vec<Tie>,
    /// Candidates of the model file that the model's parameters absorb.
    pub absorbed: Vec<Absorbed>,
    /// The loop of the records, if it is simulated.
    pub simulated_loop: Option<Arc<SimulatedLoop>>,
    /// What is known of the loop.
    pub control_loop: Option<ControlLoop>,
    pub limit: Limit<'a>,
    pub thresholds: Thresholds,
}

/// A model with effects, and its fit.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    /// Positions of the effects among the candidates, in the order in which they were added.
    pub added: Vec<usize>,
    pub model: Arc<Model>,
    pub fit: Fit,
}

impl Node {
    /// Fall of the criterion against another set with the same weighting.
    pub fn gain_over(&self, other: &Self) -> f64 {
        other.fit.bic() - self.fit.bic()
    }

    pub fn spec(&self) -> &ModelSpec {
        self.model.spec()
    }

    /// The value of a parameter by its name.
    pub fn value(&self, name: &str) -> Option<f64> {
        let parameters = &self.spec().parameters;
        let at = parameters.iter().position(|p| p.about.name == name)?;
        self.fit.x.get(at).copied()
    }
}

/// Description of the parameters of a model.
fn of_model<T: Clone>(model: &Model, said: &BTreeMap<String, T>) -> BTreeMap<String, T> {
    let mut said = said.clone();
    let parameters = &model.spec().parameters;
    said.retain(|name, _| parameters.iter().any(|p| p.about.name == *name));
    said
}

impl Context<'_> {
    /// The model with a set of effects.
    pub fn model(&self, added: &[usize]) -> Result<Model, Error> {
        let effects: Vec<&Candidate> = added.iter().map(|&i| &self.candidates[i]).collect();
        Ok(Model::new(apply(&self.problem.spec, &effects)?))
    }

    /// Whether the model does not follow its records on the measured inputs, so that all simulations run in the loop.
    pub fn needs_loop(&self) -> bool {
        self.simulated_loop
            .as_ref()
            .is_some_and(|of| of.is_needed())
    }

    /// The same search with the measured inputs; `None` if no loop is simulated, or the model needs it.
    pub fn on_measured_inputs(&self) -> Option<Self> {
        self.simulated_loop.as_ref().filter(|of| !of.is_needed())?;
        let mut measured = self.clone();
        measured.simulated_loop = None;
        Some(measured)
    }

    /// The same search with the response of the loop that suits the residual of a set ([`SimulatedLoop::following_anew`]); `None` if the model
    /// does not need its loop, or the present response suits the set.
    pub fn following_anew(&self, set: &Node) -> Result<Option<Self>, Error> {
        let setup = self.setup(&set.model)?;
        let anew = self.simulated_loop.as_ref().filter(|of| of.is_needed());
        let anew = anew.and_then(|of| of.following_anew(&setup, &set.fit.x));
        Ok(anew.map(|anew| Self {
            simulated_loop: Some(Arc::new(anew)),
            ..self.clone()
        }))
    }

    /// Deviance of a set. Of a model that needs its loop with the response that suits the set, if it is less: that of the search suits the
    /// believed model.
    pub fn own_deviance(&self, set: &Node) -> f64 {
        let present = set.fit.deviance;
        if !self.needs_loop() || self.limit.passed() {
            return present;
        }
        let anew = self.following_anew(set).ok().flatten();
        let anew = anew.and_then(|anew| anew.refitted(set, &set.fit.noise, ROUGH).ok());
        anew.map_or(present, |anew| present.min(anew.fit.deviance))
    }

    /// Why a set is not simulated in the loop of this search: a hard nonlinearity. A model that needs its loop is simulated in any case.
    pub fn hard_nonlinearity(&self, set: &Node) -> Result<Option<NotSimulated>, Error> {
        let Some(simulated) = self.simulated_loop.as_ref().filter(|of| !of.is_needed()) else {
            return Ok(None);
        };
        let setup = self.setup(&set.model)?;
        Ok(hard_nonlinearity(
            &setup,
            &set.fit.x,
            simulated.controllers(),
        ))
    }

    /// What is known of the loop, after a test for feedback with the residual of a set: the error of a model that
    /// lacks an effect may depend on past inputs, as feedback does, or hide feedback. A function of time fits the noise too: such a set
    /// cannot be tested.
    pub fn retested_feedback(&self, set: &Node) -> Result<Option<ControlLoop>, Error> {
        if !self.problem.controllers.is_empty() || set.spec().reads_time() {
            return Ok(self.control_loop.clone());
        }
        let setup = self.setup(&set.model)?;
        Ok(detected_feedback(&setup, &set.fit, &self.thresholds))
    }

    /// The same search with the measured inputs for this reason, and a set fitted to them.
    pub fn not_simulated(self, set: &Node, why: NotSimulated) -> Result<(Self, Node), Error> {
        let context = Self {
            simulated_loop: None,
            control_loop: Some(ControlLoop::measured(why)),
            limit: self.limit.begun_again(),
            ..self
        };
        context.limit.begin(Phase::Believed);
        let white = Noise::white(context.problem.spec.outputs.len());
        let set = context.refitted(set, &white, FINE)?;
        Ok((context, set))
    }

    /// A model against the fitted records.
    pub fn setup<'b>(&'b self, model: &'b Model) -> Result<ModelSetup<'b>, Error> {
        let problem = self.problem;
        // Effects of the model file may have fixed parameters too, but not all sets contain these effects.
        let known = of_model(model, &problem.known);
        let priors = of_model(model, &problem.priors);
        let setup = ModelSetup::new(model, &problem.records, &known, problem.time_unit)?;
        let setup = setup.with_tolerance(self.tolerance);
        let setup = self.limit.on(setup.with_priors(&priors)?);
        let setup = match &self.scales {
            Some(scales) => setup.with_scales(scales.clone()),
            None => setup,
        };
        Ok(match &self.simulated_loop {
            Some(simulated) => setup.in_loop(simulated.clone()),
            None => setup,
        })
    }

    /// The fit of a set from starts with a given weighting.
    pub fn fitted(
        &self,
        added: Vec<usize>,
        model: Arc<Model>,
        starts: Vec<Vec<f64>>,
        noise: &Noise,
        stopping: Stopping,
    ) -> Result<Node, Error> {
        let setup = self.setup(&model)?;
        let starts = starts.into_iter().map(Start::from).collect();
        let fit = fit_from(&setup, starts, noise, stopping)?;
        let fit = setup.with_simulation_errors(fit);
        Ok(Node { added, model, fit })
    }

    /// A set fitted again from its estimates.
    pub fn refitted(&self, node: &Node, noise: &Noise, stopping: Stopping) -> Result<Node, Error> {
        let mut refitted = self.fitted(
            node.added.clone(),
            node.model.clone(),
            vec![node.fit.x.clone()],
            noise,
            stopping,
        )?;
        refitted.fit = refitted.fit.continuing(&node.fit);
        Ok(refitted)
    }

    /// The set without one of its effects, fitted from its estimates.
    pub fn without(
        &self,
        node: &Node,
        position: usize,
        noise: &Noise,
        stopping: Stopping,
    ) -> Result<Node, Error> {
        let mut added = node.added.clone();
        added.remove(position);
        self.subset(node, added, noise, stopping)
    }

    /// A part of the set, fitted from its estimates, or from its own starts if its simulation is not finite there: without an effect that
    /// changes much, the other estimates may be far from any plausible model.
    pub fn subset(
        &self,
        node: &Node,
        added: Vec<usize>,
        noise: &Noise,
        stopping: Stopping,
    ) -> Result<Node, Error> {
        let model = Arc::new(self.model(&added)?);
        let start = {
            let setup = self.setup(&model)?;
            self.transfer(node, &model, setup.start())
        };
        match self.fitted(added.clone(), model.clone(), vec![start], noise, stopping) {
            Err(Error::Estimation(estimation::Error::NoFiniteStart { .. })) => {
                let own = self.own_minimum(&model)?;
                // In the own starts the effects are absent, and a fit does not change a choice.
                let mut with_effects = own.clone();
                let own_count = self.problem.spec.parameters.len();
                let parameters = model.spec().parameters.iter().enumerate();
                for (at, parameter) in parameters.skip(own_count) {
                    if let Some(value) = node.value(&parameter.about.name) {
                        with_effects[at] = value;
                    }
                }
                self.fitted(added, model, vec![with_effects, own], noise, stopping)
            }
            fitted => fitted,
        }
    }

    /// Minimum of a model that is fitted from its own starts with white noise.
    pub fn own_minimum(&self, model: &Model) -> Result<Vec<f64>, Error> {
        let options = FitOptions {
            starts: self.thresholds.own_starts,
            stopping: ROUGH,
            ..FitOptions::default()
        };
        Ok(self.setup(model)?.fit(&options)?.x)
    }

    /// The vector of a set as a start of another set: additional parameters have their start values.
    pub fn transfer(&self, from: &Node, to: &Model, start: &[f64]) -> Vec<f64> {
        let (old, new) = (from.spec(), to.spec());
        let mut x = start.to_vec();
        for (value, parameter) in x.iter_mut().zip(&new.parameters) {
            if let Some(known) = from.value(&parameter.about.name) {
                *value = known;
            }
        }
        let own = self.problem.spec.states.len();
        let place = |i: usize| {
            if i < own {
                return Some(i);
            }
            let name = &new.states[i].about.name;
            old.states
                .iter()
                .position(|state| state.about.name == *name)
        };
        let (first, old_first) = (new.parameters.len(), old.parameters.len());
        for record in 0..self.problem.records.len() {
            for i in 0..new.states.len() {
                if let Some(at) = place(i) {
                    x[first + record * new.states.len() + i] =
                        from.fit.x[old_first + record * old.states.len() + at];
                }
            }
        }
        x
    }

    /// Identifiers of a set, in the order in which the effects were added.
    pub fn ids(&self, added: &[usize]) -> Vec<String> {
        added
            .iter()
            .map(|&i| self.candidates[i].id.clone())
            .collect()
    }

    /// Whether a candidate may be added to a set: a candidate that repeats another one only in addition to it, because alone the two are
    /// equal; a candidate with the sensitivity of one of the set never.
    pub fn may_stand_beside(&self, candidate: usize, added: &[usize]) -> bool {
        if self.is_tied_to_one_of(candidate, added) {
            return false;
        }
        let repeated = self.candidates[candidate].repeats.as_ref();
        repeated.is_none_or(|id| added.iter().any(|&i| self.candidates[i].id == *id))
    }

    /// Whether a candidate equals an effect of a set under another name.
    pub fn repeats_one_of(&self, candidate: usize, added: &[usize]) -> bool {
        let first = |mut i: usize| {
            // A candidate repeats an earlier one.
            while let Some(id) = &self.candidates[i].repeats
                && let Some(before) = self.candidates[..i].iter().position(|c| c.id == *id)
            {
                i = before;
            }
            i
        };
        added.iter().any(|&i| first(i) == first(candidate))
    }

    /// How many of these effects depend on time only.
    pub fn in_time(&self, effects: &[usize]) -> usize {
        let follows = |i: &&usize| self.candidates[**i].follows_time();
        effects.iter().filter(follows).count()
    }

    /// Positions of the candidates that are no functions of time: functions of time compensate for any slow disturbance, and leave nothing
    /// for other effects.
    pub fn timeless(&self) -> Vec<usize> {
        let all = 0..self.candidates.len();
        all.filter(|&i| !self.candidates[i].follows_time())
            .collect()
    }

    pub fn samples(&self) -> f64 {
        let outputs = self.problem.records.iter().flat_map(|r| &r.outputs);
        outputs.map(|y| y.values.len() - y.missing()).sum::<usize>() as f64
    }
}
