//! The score of a candidate that is absent only in a limit: no values of resistance and capacity remove an RC pair.
//!
//! A factor before its terms ([`Candidate::with_factor`]) takes it out of the model. The score is the step of Gauss-Newton by this factor
//! and all other parameters, from zero, over the starts of the candidate's own parameters. The fit has no factor: it begins where these
//! parameters give, to the order of a product or a quotient, what the factor of the step gives.

use std::sync::Arc;

use ct_model::Model;
use ct_model::effects::{Candidate, apply};
use estimation::{Noise, Residuals, Rows, linearise, within};

use crate::Error;
use crate::fit::joined::Joined;
use crate::fit::node::{Context, Node};
use crate::search::score::{Trial, step_within, thinned};

/// A start of the candidate's own parameters.
struct Place {
    /// Cost that the step predicts.
    predicted: f64,
    /// The parameter vector at this point, without the factor; and one step from this point.
    x: Vec<f64>,
    stepped: Vec<f64>,
    factor: f64,
}

impl Context<'_> {
    /// A candidate with a factor, at its best start; `None` if no start gives a simulation.
    pub fn trial_by_factor(
        &self,
        node: &Node,
        known: &Rows,
        i: usize,
        scored: &Candidate,
        noise: &Noise,
    ) -> Result<Option<Trial>, Error> {
        let candidate = &self.candidates[i];
        let mut added = node.added.clone();
        added.push(i);
        let model = Arc::new(self.model(&added)?);
        let mut effects: Vec<&Candidate> =
            node.added.iter().map(|&k| &self.candidates[k]).collect();
        effects.push(scored);
        let with_factor = Model::new(apply(&self.problem.spec, &effects)?);
        let setup = self.setup(&with_factor)?;
        let begin = self.transfer(node, &with_factor, setup.start());
        let parameters = &with_factor.spec().parameters;
        let places: Vec<usize> = scored
            .parameters
            .iter()
            .filter_map(|own| parameters.iter().position(|p| p.about.name == own.name))
            .collect();
        let (Some((&factor, own)), true) =
            (places.split_last(), places.len() == scored.parameters.len())
        else {
            return Ok(None);
        };
        let set = self.setup(&node.model)?;
        let columns = self.columns_beside(node, &set, &setup);
        let free: Vec<usize> = (0..setup.free().len()).collect();
        let place = |values: Vec<f64>| {
            let mut x = begin.clone();
            for (&at, value) in own.iter().zip(values) {
                // Parameters that the model file fixes do not change.
                if setup.free().contains(&at) {
                    x[at] = value;
                }
            }
            x[factor] = 0.0;
            let joined = Joined::at(&setup, known, &columns, &x)?;
            let triangle = linearise(&joined, &x, noise)?;
            let step = step_within(&triangle, (&setup, &x), &free);
            let mut stepped = x.clone();
            for (d, &at) in step.iter().zip(setup.free()) {
                stepped[at] = within(stepped[at] + d, setup.bounds()[at]);
            }
            // An effect of the opposite sign explains nothing.
            let predicted = if stepped[factor] == 0.0 {
                triangle.cost()
            } else {
                triangle.predicted(&step)
            };
            let size = stepped.remove(factor);
            x.remove(factor);
            predicted.is_finite().then_some(Place {
                predicted,
                x,
                stepped,
                factor: size,
            })
        };
        let mut scored: Vec<Place> = thinned(candidate.starts(), self.thresholds.scored_starts)
            .into_iter()
            .filter_map(place)
            .collect();
        scored.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
        let Some(best) = scored.first() else {
            return Ok(None);
        };
        let fall = self.samples() * (node.fit.cost / best.predicted.max(f64::MIN_POSITIVE)).ln();
        scored.truncate(self.thresholds.kept_factor_starts);
        // Removing the factor shifts every later entry by one.
        let own: Vec<usize> = own
            .iter()
            .map(|&at| at - usize::from(at > factor))
            .collect();
        let setup = self.setup(&model)?;
        let cost = |x: &[f64]| {
            let squares = estimation::squares(&setup, x, noise);
            let cost = squares.map_or(f64::INFINITY, |squares| squares.cost());
            if cost.is_nan() { f64::INFINITY } else { cost }
        };
        let mut starts: Vec<(f64, Vec<f64>)> = scored
            .iter()
            .map(|place| {
                let all = [&place.x, &place.stepped].into_iter().flat_map(|x| {
                    scalings(own.len(), place.factor, self.thresholds.scaled_parameters).map(
                        |scales| {
                            let mut x = x.clone();
                            for (&at, scale) in own.iter().zip(scales) {
                                if setup.free().contains(&at) {
                                    x[at] = within(scale * x[at], setup.bounds()[at]);
                                }
                            }
                            (cost(&x), x)
                        },
                    )
                });
                all.min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((f64::INFINITY, place.x.clone()))
            })
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(Some(Trial {
            candidate: i,
            model: model.clone(),
            starts: starts.into_iter().map(|(_, x)| x).collect(),
            fall,
        }))
    }
}

/// Every combination of scales of the parameters: one, the factor, and its inverse; only one for more than `most` parameters.
fn scalings(parameters: usize, factor: f64, most: usize) -> impl Iterator<Item = Vec<f64>> {
    let usable = factor.is_finite() && factor != 0.0 && parameters <= most;
    let each = [1.0, factor, factor.recip()];
    let count = if usable {
        3_usize.pow(parameters as u32)
    } else {
        1
    };
    (0..count).map(move |mut number| {
        (0..parameters)
            .map(|_| {
                let scale = each[number % 3];
                number /= 3;
                scale
            })
            .collect()
    })
}
