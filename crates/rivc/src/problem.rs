//! Records and structure together: the equations at a model, and the way from one model to the next.

use ct_lti::Polynomial;
use ct_signals::ArModel;

use crate::equations::Equations;
use crate::model::Model;
use crate::pass::{Instruments, Pass};
use crate::prepared::{Paths, Prepared};
use crate::{Error, Structure};

/// A step that ends at an unstable plant is halved so many times at most.
const HALVINGS: usize = 12;
/// The estimates rest where none moves by more than this share of its standard error, or of itself.
const SHARE_OF_ERROR: f64 = 1e-3;
const SHARE_OF_ITSELF: f64 = 1e-9;
/// A start is near enough where a renewal changes its mean square by no more than this share.
const SHARE_OF_SQUARE: f64 = 1e-4;
/// The model of the noise is renewed while an estimate moves by more than this share of its standard error, so many times at most.
const SHARE_FOR_NOISE: f64 = 0.1;
const NOISE_RENEWALS: usize = 10;

/// Records and structure.
pub(crate) struct Problem<'a> {
    pub(crate) structure: &'a Structure,
    pub(crate) records: &'a [Prepared],
}

/// Records under given delays.
#[derive(Clone)]
pub(crate) struct Delayed {
    pub(crate) delays: Vec<f64>,
    pub(crate) paths: Vec<Paths>,
    /// First sample of each record that counts.
    pub(crate) first: Vec<usize>,
}

/// The end of a refinement.
pub(crate) struct Refined {
    pub(crate) model: Model,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    /// Model of the noise, where there is one.
    pub(crate) noise: Option<ArModel>,
    /// Mean square of measured less simulated output, from the instruments' inputs; whitened where there is a model of the noise.
    pub(crate) mean_square: f64,
    /// The equations at the model, and the delayed inputs that they were taken from.
    pub(crate) equations: Equations,
    pub(crate) delayed: Delayed,
}

impl Problem<'_> {
    /// Paths of the inputs under these delays; samples count from where all inputs are known under delays of up to `largest`.
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

    fn empty(&self, with_delays: bool) -> Equations {
        let delays = self.structure.estimated_delays().count();
        let shared = self.structure.parameters() - if with_delays { 0 } else { delays };
        Equations::new(shared, self.structure.of_record(), self.records.len())
    }

    /// Equations whose filter and instruments are the model's.
    pub(crate) fn equations(
        &self,
        delayed: &Delayed,
        model: &Model,
        noise: Option<&ArModel>,
        with_delays: bool,
    ) -> Result<Equations, Error> {
        let mut equations = self.empty(with_delays);
        for index in 0..self.records.len() {
            let pass = self.pass(delayed, model, index, with_delays);
            let bank = pass.bank(&model.alpha)?;
            equations.add(&pass, &bank, Instruments::Model, noise);
        }
        Ok(equations)
    }

    /// Solves equations with a filter of its own; instruments are those of a model, or, without one, the regressors: least squares.
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
        Ok(Model::from_solution(structure, &x, &delayed.delays, false))
    }

    /// The model that the equations give, as far on the way as it is stable.
    fn next(&self, model: &Model, x: &[f64], with_delays: bool, reach: f64) -> Option<Model> {
        let mut next = Model::from_solution(self.structure, x, &model.delays, with_delays);
        for (new, old) in next.delays.iter_mut().zip(&model.delays) {
            *new = new.clamp(old - reach, old + reach);
        }
        for _ in 0..HALVINGS {
            if next.is_stable(self.structure) {
                return Some(next);
            }
            next = next.half_way_from(model);
        }
        None
    }

    /// A few refinements at fixed delays, with a model of the noise that stays: the best model on the way, with the mean square of its
    /// output error.
    pub(crate) fn follow(
        &self,
        delayed: &Delayed,
        mut model: Model,
        noise: Option<&ArModel>,
        most: usize,
    ) -> Result<Option<(f64, Model)>, Error> {
        let mut best: Option<(f64, Model)> = None;
        for _ in 0..=most {
            let equations = self.equations(delayed, &model, noise, false)?;
            let square = equations.output_squares / equations.samples as f64;
            let rests = best
                .as_ref()
                .is_some_and(|(least, _)| (square - least).abs() <= SHARE_OF_SQUARE * least);
            if square.is_finite() && best.as_ref().is_none_or(|(least, _)| square < *least) {
                best = Some((square, model.clone()));
            }
            if rests {
                break;
            }
            let Ok(x) = equations.solve() else {
                break;
            };
            let Some(next) = self.next(&model, &x, false, 0.0) else {
                break;
            };
            model = next;
        }
        Ok(best)
    }

    /// Filter, instruments and, where there is one, the model of the noise, of at most the given order, renewed until the estimates rest. `reach` limits the change of a
    /// delay in one step.
    pub(crate) fn refine(
        &self,
        start: Model,
        noise: Option<(usize, ArModel)>,
        reach: f64,
        most: usize,
    ) -> Result<Refined, Error> {
        let structure = self.structure;
        let with_delays = structure.estimated_delays().next().is_some();
        let mut largest = start.delays.iter().copied().fold(0.0, f64::max);
        let mut delayed = self.delayed(&start.delays, largest);
        let mut model = start;
        let (noise_order, mut noise) = noise.unzip();
        let mut renewals = 0;
        let mut iterations = 0;
        loop {
            let equations = self.equations(&delayed, &model, noise.as_ref(), with_delays)?;
            let refined = |equations: Equations, converged| Refined {
                mean_square: equations.output_squares / equations.samples as f64,
                model: model.clone(),
                iterations,
                converged,
                noise: noise.clone(),
                equations,
                delayed: delayed.clone(),
            };
            if iterations >= most {
                return Ok(refined(equations, false));
            }
            let x = equations.solve()?;
            let Some(next) = self.next(&model, &x, with_delays, reach) else {
                return Ok(refined(equations, false));
            };
            let covariance = equations.covariance(None)?;
            let (old, new) = (model.core(structure), next.core(structure));
            let within = |share: f64| {
                old.iter().zip(&new).enumerate().all(|(i, (old, new))| {
                    let change = (new - old).abs();
                    change <= share * covariance[(i, i)].sqrt()
                        || change <= SHARE_OF_ITSELF * old.abs()
                })
            };
            if within(SHARE_OF_ERROR) {
                return Ok(refined(equations, true));
            }
            if let Some(order) = noise_order
                && renewals < NOISE_RENEWALS
                && !within(SHARE_FOR_NOISE)
            {
                renewals += 1;
                noise = Some(equations.residual_noise(order)?);
            }
            model = next;
            iterations += 1;
            if with_delays {
                // A first sample that came and went with a delay would keep the estimates from resting.
                largest = model.delays.iter().copied().fold(largest, f64::max);
                delayed = self.delayed(&model.delays, largest);
            }
        }
    }
}
