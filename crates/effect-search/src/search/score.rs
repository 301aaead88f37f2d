//! Score of each candidate for a set of effects: the predicted fall of the cost in one Gauss-Newton step from its best start.
//!
//! An effect whose outputs have a derivative where it is absent is linearised there, for each start of its shapes; a threshold at each of
//! its starts. One linearisation weighted by the noise model gives the cost after the step, all parameters free: the score test, and its
//! extension to thresholds.
//!
//! **Reference**: C. R. Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50-57 (score test); S. A. Billings, M. Korenberg, S. Chen, Int. J.
//! Systems Science 19 (1988) 1559-1568 (orthogonal forward regression).

use std::sync::Arc;

use ct_model::Model;
use ct_model::effects::{Port, Role, best_of_each_choice};
use estimation::{Noise, Residuals, Rows, Triangle, linearise, within};
use greybox::ModelSetup;
use rayon::prelude::*;

use crate::Error;
use crate::fit::joined::Joined;
use crate::fit::node::{Context, Node};
use crate::residual_tests::strongest_line;

/// Damping of the predicted step, for directions that the data do not determine.
const DAMPING: f64 = 1e-9;
/// Parts of the predicted step from which a fit may begin, as shares of it.
const SHARES: [f64; 4] = [1.0, 0.3, 0.1, 0.03];

/// A candidate for addition to a set of effects, before it is fitted.
#[derive(Debug, Clone)]
pub(crate) struct Trial {
    /// Position among the candidates.
    pub candidate: usize,
    pub model: Arc<Model>,
    /// Starts of its fit, best first: the points of linearisation, or one step from there if that is better.
    pub starts: Vec<Vec<f64>>,
    /// Predicted fall of the deviance.
    pub fall: f64,
}

/// The starts, or the given number of them.
pub(crate) fn thinned(starts: Vec<Vec<f64>>, most: usize) -> Vec<Vec<f64>> {
    if starts.len() <= most {
        return starts;
    }
    let every = starts.len() as f64 / most as f64;
    (0..most)
        .map(|k| starts[(k as f64 * every) as usize].clone())
        .collect()
}

/// A start of a candidate's fit.
struct Place {
    /// Cost that a step of Gauss and Newton predicts.
    predicted: f64,
    cost: f64,
    x: Vec<f64>,
    stepped: Vec<f64>,
}

/// The effect whose starts come from the spectrum of the residual.
const PERIODIC: &str = "periodic";
/// The effect whose step comes from the readings: the error has a narrow minimum there, which no grid of starts meets.
pub(crate) const QUANTISATION: &str = "quantisation";
/// The effect whose instant is refined between its starts.
const STEP: &str = "step";
/// First positions that are scored in addition to the start, as [`Role::Begin`] says.
const BEGINS: [f64; 2] = [-0.8, 0.8];
/// Distances from the best instants at which further starts are scored, round by round, as shares of the longest record.
const BETWEEN: [f64; 2] = [0.05, 0.025];

/// The step of Gauss and Newton from a point, of the `free` columns. A parameter at a bound does not leave it: no candidate is credited with
/// what it would explain beyond.
pub(crate) fn step_within(
    triangle: &Triangle,
    (setup, x): (&ModelSetup, &[f64]),
    free: &[usize],
) -> Vec<f64> {
    let scale: Vec<f64> = (0..setup.free().len())
        .map(|j| triangle.column_norm(j).max(f64::MIN_POSITIVE))
        .collect();
    let of_free = |at: &usize| (x[*at], setup.bounds()[*at]);
    let (values, bounds): (Vec<f64>, Vec<(f64, f64)>) = setup.free().iter().map(of_free).unzip();
    triangle.solve_from_bounds((&values, &bounds), free, &scale, DAMPING)
}

impl Context<'_> {
    /// Periods of the strongest lines of a set's residuals, and half a line to either side \[unit of the model's time\].
    fn periods(&self, node: &Node) -> Result<Vec<f64>, Error> {
        let setup = self.setup(&node.model)?;
        let Some(residuals) = estimation::residuals(&setup, &node.fit.x) else {
            return Ok(Vec::new());
        };
        let records = &self.problem.records;
        let outputs = records[0].outputs.len();
        let mut periods = Vec::new();
        for (i, residual) in residuals.iter().enumerate() {
            if residual.len() < 16 || residual.iter().all(|e| e.is_nan()) {
                continue;
            }
            let duration = records[i / outputs].duration() / self.problem.time_unit;
            if let Some(line) = strongest_line(residual)? {
                let cycles = line.cycles as f64;
                periods.extend([-0.5, 0.0, 0.5].map(|part| duration / (cycles + part)));
            }
        }
        Ok(periods)
    }

    /// Length of the longest record \[unit of the model's time\].
    fn longest_duration(&self) -> f64 {
        let records = self.problem.records.iter();
        let longest = records.map(ct_signals::Record::duration);
        longest.fold(0.0, f64::max) / self.problem.time_unit
    }

    /// Scores of all candidates that a set does not have, best first.
    pub fn trials(&self, node: &Node, noise: &Noise) -> Vec<Trial> {
        let all: Vec<usize> = (0..self.candidates.len()).collect();
        self.trials_among(node, &all, noise)
    }

    /// Trials of some candidates, by their positions.
    pub fn trials_among(&self, node: &Node, among: &[usize], noise: &Noise) -> Vec<Trial> {
        let others: Vec<usize> = among
            .iter()
            .copied()
            .filter(|i| !node.added.contains(i) && self.may_stand_beside(*i, &node.added))
            .collect();
        let Some(known) = self.rows_of(node) else {
            return Vec::new();
        };
        let mut trials: Vec<Trial> = others
            .into_par_iter()
            .filter(|_| !self.limit.passed())
            .filter_map(|i| self.trial_beside(node, &known, i, noise).ok().flatten())
            .collect();
        trials.sort_by(|a, b| {
            b.fall
                .total_cmp(&a.fall)
                .then(a.candidate.cmp(&b.candidate))
        });
        trials
    }

    /// A candidate at its best start; `None` where no start gives a simulation.
    pub fn trial(&self, node: &Node, i: usize, noise: &Noise) -> Result<Option<Trial>, Error> {
        match self.rows_of(node) {
            Some(known) => self.trial_beside(node, &known, i, noise),
            None => Ok(None),
        }
    }

    /// Derivatives and residuals of a set at the end of its fit.
    fn rows_of(&self, node: &Node) -> Option<Rows> {
        estimation::rows(&self.setup(&node.model).ok()?, &node.fit.x)
    }

    /// Trial of a candidate for a set with known Jacobian.
    fn trial_beside(
        &self,
        node: &Node,
        known: &Rows,
        i: usize,
        noise: &Noise,
    ) -> Result<Option<Trial>, Error> {
        let candidate = &self.candidates[i];
        if let Some(scored) = candidate.with_factor(&self.problem.spec) {
            return self.trial_by_factor(node, known, i, &scored, noise);
        }
        let mut added = node.added.clone();
        added.push(i);
        let model = Arc::new(self.model(&added)?);
        let setup = self.setup(&model)?;
        let begin = self.transfer(node, &model, setup.start());
        let places: Vec<Option<usize>> = candidate
            .parameters
            .iter()
            .map(|own| {
                // A parameter that the model file fixes keeps its value.
                let fixed = self.problem.known.contains_key(&own.name);
                let mut all = model.spec().parameters.iter();
                let at = all.position(|p| p.about.name == own.name);
                at.filter(|_| !fixed)
            })
            .collect();
        let smooth = candidate.is_smooth();
        let mut starts: Vec<Vec<f64>> = Vec::new();
        for values in candidate.starts() {
            let mut x = begin.clone();
            for ((own, place), value) in candidate.parameters.iter().zip(&places).zip(values) {
                let Some(place) = *place else { continue };
                x[place] = if smooth && own.role == Role::Size {
                    own.absent
                } else {
                    value
                };
            }
            if !starts.contains(&x) {
                starts.push(x);
            }
        }
        let own_place = |id: &str, parameter: &str| -> Option<usize> {
            candidate.effect.filter(|effect| effect.id == id)?;
            let mut own = candidate.parameters.iter();
            places[own.position(|own| own.short == parameter)?]
        };
        // Starts from the data come before those of the grid.
        let from_data = match (own_place(PERIODIC, "period"), candidate.port) {
            (Some(at), _) => Some((at, self.periods(node)?)),
            (None, Port::Output(output)) => {
                own_place(QUANTISATION, "step").map(|at| (at, self.reading_steps[output].clone()))
            }
            _ => None,
        };
        if let (Some((at, values)), Some(first)) = (from_data, starts.first().cloned()) {
            for value in values {
                let mut x = first.clone();
                x[at] = within(value, setup.bounds()[at]);
                starts.insert(0, x);
            }
        }
        let starts = thinned(starts, self.thresholds.scored_starts);
        let count = self.samples();
        let set = self.setup(&node.model)?;
        let columns = self.columns_beside(node, &set, &setup);
        // While an effect is absent, its shape parameters have no influence: their columns contain rounding errors, and no step is computed
        // from them.
        let silent: Vec<usize> = candidate
            .parameters
            .iter()
            .zip(&places)
            .filter(|(own, _)| smooth && matches!(own.role, Role::Shape | Role::Begin))
            .filter_map(|(_, place)| *place)
            .collect();
        let place = |x: Vec<f64>, triangle: Triangle| {
            let all = 0..setup.free().len();
            let free: Vec<usize> = all
                .filter(|&j| !silent.contains(&setup.free()[j]))
                .collect();
            let step = step_within(&triangle, (&setup, &x), &free);
            let predicted = triangle.predicted(&step);
            let mut stepped = x.clone();
            for (d, &at) in step.iter().zip(setup.free()) {
                stepped[at] = within(stepped[at] + d, setup.bounds()[at]);
            }
            // A size outside its bound explains nothing.
            let forbidden = candidate
                .parameters
                .iter()
                .zip(&places)
                .any(|(own, place)| {
                    let stays = |at: usize| x[at] == own.absent && stepped[at] == own.absent;
                    matches!(own.role, Role::Size | Role::Threshold) && place.is_some_and(stays)
                });
            let predicted = if forbidden {
                triangle.cost()
            } else {
                predicted
            };
            predicted.is_finite().then(|| Place {
                predicted,
                cost: triangle.cost(),
                x,
                stepped,
            })
        };
        let scored_at = |x: Vec<f64>| {
            let joined = Joined::at(&setup, known, &columns, &x)?;
            let triangle = linearise(&joined, &x, noise)?;
            place(x, triangle)
        };
        let mut scored: Vec<Place> = starts.into_iter().filter_map(scored_at).collect();
        scored.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        let choices: Vec<usize> = candidate
            .parameters
            .iter()
            .zip(&places)
            .filter(|(own, _)| own.role == Role::Choice)
            .filter_map(|(_, place)| *place)
            .collect();
        let chosen = |x: &Vec<f64>| -> Vec<f64> { choices.iter().map(|&at| x[at]).collect() };
        let choice = |place: &Place| chosen(&place.x);
        let mut own = candidate.parameters.iter().zip(&places);
        let begin = own.find(|(own, _)| own.role == Role::Begin);
        if let Some(at) = begin.and_then(|(_, place)| *place) {
            let all = scored.iter().map(|place| place.x.clone()).collect();
            let best = best_of_each_choice(all, chosen, self.thresholds.kept_starts);
            let others = best.into_iter().flat_map(|best| {
                BEGINS.map(|begin| {
                    let mut x = best.clone();
                    x[at] = begin;
                    x
                })
            });
            scored.extend(others.filter_map(scored_at));
            scored.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        }
        if let Some(at) = own_place(STEP, "since") {
            let duration = self.longest_duration();
            for share in BETWEEN {
                let away = share * duration;
                let mut others: Vec<Vec<f64>> = Vec::new();
                for best in scored.iter().take(self.thresholds.kept_starts) {
                    for side in [-away, away] {
                        let mut x = best.x.clone();
                        x[at] = within(x[at] + side, setup.bounds()[at]);
                        if !scored.iter().any(|place| place.x == x) && !others.contains(&x) {
                            others.push(x);
                        }
                    }
                }
                scored.extend(others.into_iter().filter_map(scored_at));
                scored.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
            }
            // A fit from a neighbour of the best instant ends in the same minimum.
            let best = scored.first().map_or(0.0, |place| place.x[at]);
            let near = 2.0 * BETWEEN[0] * duration;
            let mut first = true;
            scored.retain(|place| std::mem::take(&mut first) || (place.x[at] - best).abs() >= near);
        }
        // A start at which the effect is absent comes in addition to those at which it is present.
        let is_absent = |place: &Place| {
            let own = candidate.parameters.iter().zip(&places);
            let mut thresholds = own.filter(|(own, _)| own.role == Role::Threshold);
            thresholds.any(|(own, at)| at.is_some_and(|at| place.x[at] == own.absent))
        };
        let further = usize::from(scored.iter().any(is_absent));
        if !smooth {
            // The presence of the effect changes the derivatives of the other parameters.
            let most = self.thresholds.linearised_starts + further;
            scored = best_of_each_choice(scored, choice, most);
            scored = scored
                .into_iter()
                .filter_map(|Place { x, .. }| {
                    let triangle = linearise(&setup, &x, noise)?;
                    place(x, triangle)
                })
                .collect();
            scored.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        }
        let Some(Place {
            predicted: best, ..
        }) = scored.first()
        else {
            return Ok(None);
        };
        let fall = count * (node.fit.cost / best.max(f64::MIN_POSITIVE)).ln();
        // A simulation without derivatives shows which of the starts is better.
        let kept = if smooth && scored.len() == 1 {
            1
        } else {
            self.thresholds.kept_starts + further
        };
        let cost = |x: &[f64]| {
            let squares = estimation::squares(&setup, x, noise);
            let cost = squares.map_or(f64::INFINITY, |squares| squares.cost());
            if cost.is_nan() { f64::INFINITY } else { cost }
        };
        let mut places: Vec<(f64, Vec<f64>)> = best_of_each_choice(scored, choice, kept)
            .into_iter()
            .map(|place| {
                let to = |share: f64| -> Vec<f64> {
                    let both = place.x.iter().zip(&place.stepped);
                    both.map(|(x, stepped)| x + share * (stepped - x)).collect()
                };
                // If the whole step raises the cost, the fit begins with a part of the step: shape parameters cannot be fitted while the
                // effect is absent.
                let parts = SHARES.iter().map(|&share| to(share));
                parts
                    .map(|x| (cost(&x), x))
                    .find(|(there, _)| *there <= place.cost)
                    .unwrap_or((place.cost, place.x))
            })
            .collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let starts = places.into_iter().map(|(_, x)| x).collect();
        Ok(Some(Trial {
            candidate: i,
            model: model.clone(),
            starts,
            fall,
        }))
    }
}
