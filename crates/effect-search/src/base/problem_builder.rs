//! A problem made step by step, and checked.

use std::collections::{BTreeMap, BTreeSet};
use std::mem::take;

use ct_model::effects::OwnCandidate;
use ct_model::{Model, ModelSpec};
use ct_signals::Record;
use greybox::{LoopController, ModelSetup, PriorValue};

use crate::{Error, Kept, PriorKnowledge, Problem, mend};

/// Builds a [`Problem`]: required parts were given to [`Problem::builder`], the other parts have one method each.
#[derive(Debug, Clone)]
#[must_use]
pub struct ProblemBuilder {
    problem: Problem,
}

impl Problem {
    /// A model and the records that it is fitted to, whose inputs and outputs are those of the model, in its order and units.
    ///
    /// ```
    /// use ct_model::ModelSpec;
    /// use ct_signals::{Channel, Record};
    /// use effect_search::Problem;
    ///
    /// let spec = ModelSpec::parse(
    ///     "model Block
    ///        parameter Real k(unit=\"W/K\", min=0) = 1;
    ///        parameter Real C(unit=\"J/K\", min=0) = 50;
    ///        input Real u(unit=\"W\");
    ///        output Real y(unit=\"degC\") = T;
    ///        Real T(unit=\"degC\", start=20);
    ///      equation
    ///        C*der(T) = u - k*(T - 20);
    ///      end Block;",
    /// )?;
    /// let u = Channel::new("u", "W", vec![10.0; 100]);
    /// let y = Channel::new("y", "degC", vec![20.0; 100]);
    /// let record = Record::sampled("block", 1.0, vec![u], vec![y]);
    /// let problem = Problem::builder(spec.clone(), [record.clone()]).known("C", 48.0).build()?;
    /// assert_eq!(problem.known["C"], 48.0);
    ///
    /// // Names and channels are checked.
    /// assert!(Problem::builder(spec, [record]).known("c", 48.0).build().is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn builder(spec: ModelSpec, records: impl Into<Vec<Record>>) -> ProblemBuilder {
        ProblemBuilder {
            problem: Self {
                spec,
                effects: Vec::new(),
                kept: BTreeMap::new(),
                records: records.into(),
                test: Vec::new(),
                gaps: None,
                known: BTreeMap::new(),
                priors: BTreeMap::new(),
                candidates: BTreeMap::new(),
                left_out: BTreeSet::new(),
                controllers: Vec::new(),
                time_unit: 1.0,
                time_unit_name: "s".to_string(),
            },
        }
    }
}

impl ProblemBuilder {
    /// Effects in the model, by their identifiers ([`Problem::effects`]).
    pub fn effects<S: Into<String>>(mut self, effects: impl IntoIterator<Item = S>) -> Self {
        self.problem.effects = effects.into_iter().map(Into::into).collect();
        self
    }

    /// Keeps values of one of these effects from an earlier record ([`Problem::kept`]).
    pub fn kept(mut self, effect: impl Into<String>, kept: Kept) -> Self {
        self.problem.kept.insert(effect.into(), kept);
        self
    }

    /// Held-out records: they are not used for fits or for selection; the errors on them are reported.
    pub fn test(mut self, records: impl Into<Vec<Record>>) -> Self {
        self.problem.test = records.into();
        self
    }

    /// A parameter that is not fitted, and its value \[unit of the text\].
    pub fn known(mut self, parameter: impl Into<String>, value: f64) -> Self {
        self.problem.known.insert(parameter.into(), value);
        self
    }

    /// Prior knowledge of a parameter.
    pub fn prior(mut self, parameter: impl Into<String>, prior: PriorValue) -> Self {
        self.problem.priors.insert(parameter.into(), prior);
        self
    }

    /// Adds a user's own candidate to those of the catalogue.
    pub fn candidate(mut self, name: impl Into<String>, candidate: OwnCandidate) -> Self {
        self.problem.candidates.insert(name.into(), candidate);
        self
    }

    /// Leaves effects of the catalogue out of the candidates, by their identifiers.
    pub fn left_out<S: Into<String>>(mut self, effects: impl IntoIterator<Item = S>) -> Self {
        self.problem.left_out = effects.into_iter().map(Into::into).collect();
        self
    }

    /// A controller that drove an input of the records.
    pub fn controller(mut self, controller: LoopController) -> Self {
        self.problem.controllers.push(controller);
        self
    }

    /// The unit of the model's time: its length in seconds, above 0, and its symbol. The default is the second.
    pub fn time_unit(mut self, seconds: f64, name: impl Into<String>) -> Self {
        (self.problem.time_unit, self.problem.time_unit_name) = (seconds, name.into());
        self
    }

    /// The problem. Short gaps of the records are filled, and the records are cut at long ones ([`mend`]).
    ///
    /// # Errors
    /// [`Error::TimeUnit`]; [`Error::Signals`] where nothing is left of a record with gaps; [`Error::Fit`] where there is no record, a record is not sound or has not the channels of the model, or where
    /// the model has no parameter of a name, or a prior is no number with an error. Of a model with effects the names are looked at when
    /// these are in it, by [`diagnose`](crate::diagnose).
    pub fn build(self) -> Result<Problem, Error> {
        let mut problem = self.problem;
        let seconds = problem.time_unit;
        if !(seconds > 0.0 && seconds.is_finite()) {
            return Err(Error::TimeUnit { seconds });
        }
        let model = Model::new(problem.spec.clone());
        let records = (take(&mut problem.records), take(&mut problem.test));
        let prior = PriorKnowledge {
            model: &model,
            known: &problem.known,
            priors: &problem.priors,
            time_unit: seconds,
        };
        let whole = mend(records, prior)?;
        (problem.records, problem.test) = (whole.records, whole.test);
        problem.gaps = whole.gaps;
        let (none, no_priors) = (BTreeMap::new(), BTreeMap::new());
        let (known, priors) = if problem.effects.is_empty() && problem.candidates.is_empty() {
            (&problem.known, &problem.priors)
        } else {
            (&none, &no_priors)
        };
        ModelSetup::new(&model, &problem.records, known, seconds)?.with_priors(priors)?;
        if !problem.test.is_empty() {
            ModelSetup::new(&model, &problem.test, &none, seconds)?;
        }
        Ok(problem)
    }
}
