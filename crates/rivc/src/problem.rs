//! Records and structure together: the equations at a model, and a few iterations at fixed delays.

use ct_lti::Polynomial;
use ct_signals::ArModel;

use crate::equations::Equations;
use crate::layout::Layout;
use crate::model::Model;
use crate::pass::{Instruments, Pass};
use crate::prepared::{Paths, Prepared};
use crate::{Error, Structure};

/// A step that ends at an unstable plant, or at a larger output error, is halved at most this many times.
pub(crate) const HALVINGS: usize = 12;
/// A start is near enough where an iteration changes its mean square by no more than this share.
const NEAR: f64 = 1e-4;

/// Records and structure.
pub(crate) struct Problem<'a> {
    pub(crate) structure: &'a Structure,
    pub(crate) records: &'a [Prepared],
}

/// Records under given delays.
pub(crate) struct Delayed {
    pub(crate) delays: Vec<f64>,
    pub(crate) paths: Vec<Paths>,
    /// First sample of each record that is used.
    pub(crate) first: Vec<usize>,
}

impl Problem<'_> {
    /// Inputs with these delays; samples are used from where all inputs are known for delays of up to `largest`.
    pub(crate) fn delayed(&self, delays: &[f64], largest: f64) -> Delayed {
        let first = |record: &Prepared| match self.structure.initial_states {
            true => record.first_known(largest).min(record.len() - 1),
            false => 0,
        };
        Delayed {
            delays: delays.to_vec(),
            paths: self.records.iter().map(|r| r.paths(delays)).collect(),
            first: self.records.iter().map(first).collect(),
        }
    }

    pub(crate) fn pass<'p>(
        &'p self,
        delayed: &'p Delayed,
        model: &'p Model,
        index: usize,
        with_delays: bool,
    ) -> Pass<'p> {
        Pass {
            structure: self.structure,
            record: &self.records[index],
            paths: &delayed.paths[index],
            index,
            first: delayed.first[index],
            model,
            with_delays,
        }
    }

    /// The unknowns, changes of the delays among them or not.
    pub(crate) fn layout(&self, with_delays: bool) -> Layout {
        let delays = self.structure.estimated_delays().count();
        let shared = self.structure.parameters() - if with_delays { 0 } else { delays };
        let continues = self.records.iter().map(|record| record.continues);
        Layout::new(shared, self.structure, continues)
    }

    /// The model of a solution of equations with this layout.
    pub(crate) fn model(&self, x: &[f64], delays: &[f64], with_delays: bool) -> Model {
        let of_records = self.layout(with_delays).of_records(x);
        Model::from_solution(self.structure, x, (delays, with_delays), of_records)
    }

    fn empty(&self, with_delays: bool) -> Equations {
        Equations::new(self.layout(with_delays), self.records.len())
    }

    /// Equations whose filter and instruments are the model's.
    pub(crate) fn equations(
        &self,
        delayed: &Delayed,
        model: &Model,
        noise: Option<&[ArModel]>,
        with_delays: bool,
    ) -> Result<Equations, Error> {
        let mut equations = self.empty(with_delays);
        for index in 0..self.records.len() {
            let pass = self.pass(delayed, model, index, with_delays);
            let bank = pass.bank(&model.alpha)?;
            equations.add(
                &pass,
                &bank,
                Instruments::Model,
                noise.map(|noise| &noise[index]),
            );
        }
        Ok(equations)
    }

    /// Solves the equations with a given filter; the instruments are those of a model, or, without one, the regressors: least squares.
    pub(crate) fn solve_with_filter(
        &self,
        delayed: &Delayed,
        filter: &Polynomial,
        model: Option<&Model>,
    ) -> Result<Model, Error> {
        let structure = self.structure;
        let nothing = Model {
            alpha: vec![0.0; structure.n],
            beta: vec![0.0; structure.numerators()],
            delays: delayed.delays.clone(),
            of_records: Vec::new(),
        };
        let leading = filter.leading();
        let e: Vec<f64> = (0..structure.n)
            .map(|i| filter.coefficient(i) / leading)
            .collect();
        let mut equations = self.empty(false);
        for index in 0..self.records.len() {
            let pass = self.pass(delayed, model.unwrap_or(&nothing), index, false);
            let bank = pass.bank(&e)?;
            match model {
                Some(_) => {
                    let simulated = pass.simulated()?;
                    equations.add(&pass, &bank, Instruments::Simulated(&simulated), None);
                }
                None => equations.add(&pass, &bank, Instruments::Regressors, None),
            }
        }
        let x = equations.solve()?;
        Ok(self.model(&x, &delayed.delays, false))
    }

    /// A few iterations at fixed delays, with fixed noise models: the best iterate, with the mean square of its output error.
    pub(crate) fn follow(
        &self,
        delayed: &Delayed,
        mut model: Model,
        noise: Option<&[ArModel]>,
        most: usize,
    ) -> Result<Option<(f64, Model)>, Error> {
        let mut best: Option<(f64, Model)> = None;
        for _ in 0..=most {
            let equations = self.equations(delayed, &model, noise, false)?;
            let square = equations.mean_square();
            let near = best
                .as_ref()
                .is_some_and(|(least, _)| (square - least).abs() <= NEAR * least);
            if square.is_finite() && best.as_ref().is_none_or(|(least, _)| square < *least) {
                best = Some((square, model.clone()));
            }
            if near {
                break;
            }
            let Ok(x) = equations.solve() else {
                break;
            };
            let mut next = self.model(&x, &model.delays, false);
            let mut halvings = 0;
            while !next.is_stable(self.structure) && halvings < HALVINGS {
                next = next.half_way_from(&model);
                halvings += 1;
            }
            if halvings == HALVINGS {
                break;
            }
            model = next;
        }
        Ok(best)
    }
}
