//! A problem made step by step, and checked.

use std::collections::BTreeMap;

use ct_signals::Record;
use greybox::PriorValue;
use plants::{Known, Placed, Plant, Term, controller::Controller};

use crate::{Error, Problem};

/// Makes a [`Problem`]: what it needs was given to [`Problem::builder`], the rest has a method each.
#[derive(Debug, Clone)]
#[must_use]
pub struct ProblemBuilder {
    problem: Problem,
}

impl Problem {
    /// The believed plant, its known constants, and the records that are fitted together.
    pub fn builder(plant: Plant, known: Known, records: impl Into<Vec<Record>>) -> ProblemBuilder {
        ProblemBuilder {
            problem: Self {
                plant,
                known,
                effects: Vec::new(),
                terms: Vec::new(),
                start: BTreeMap::new(),
                fixed: Vec::new(),
                priors: BTreeMap::new(),
                records: records.into(),
                controller: None,
                test: Vec::new(),
            },
        }
    }
}

impl ProblemBuilder {
    /// The effects that the model contains already.
    pub fn effects(mut self, effects: impl Into<Vec<Placed>>) -> Self {
        self.problem.effects = effects.into();
        self
    }

    /// Terms of the user's own in the model.
    pub fn terms(mut self, terms: impl Into<Vec<Term>>) -> Self {
        self.problem.terms = terms.into();
        self
    }

    /// A first guess of a parameter: `alpha`, `overflow.rim`.
    pub fn start(mut self, parameter: impl Into<String>, value: f64) -> Self {
        self.problem.start.insert(parameter.into(), value);
        self
    }

    /// A parameter that is not fitted, and its value.
    pub fn fixed(mut self, parameter: impl Into<String>, value: f64) -> Self {
        let parameter = parameter.into();
        self.problem.fixed.push(parameter.clone());
        self.start(parameter, value)
    }

    /// Prior of a parameter.
    pub fn prior(mut self, parameter: impl Into<String>, prior: PriorValue) -> Self {
        self.problem.priors.insert(parameter.into(), prior);
        self
    }

    /// The controller of the loop that the records come from.
    pub fn controller(mut self, controller: Controller) -> Self {
        self.problem.controller = Some(controller);
        self
    }

    /// Held-out records, which are scored but not used for fits or selection.
    pub fn test(mut self, records: impl Into<Vec<Record>>) -> Self {
        self.problem.test = records.into();
        self
    }

    /// The problem.
    ///
    /// # Errors
    /// Where there is no record, a record has other outputs than the plant or than the first record, or the controller reads an output that
    /// there is not. Names of parameters are looked at by [`compare`](crate::compare) and [`diagnose`](crate::diagnose).
    pub fn build(self) -> Result<Problem, Error> {
        self.problem.check()?;
        Ok(self.problem)
    }
}
