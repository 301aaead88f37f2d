//! Other minima of a set's fit: those that its effects with thresholds reach from other values.
//!
//! The cost of a limit, of a dead zone or of an actuator that sticks has several minima: each reading that changes sides adds one. While a
//! set grows, an effect explains a part of the error together with others that are replaced later, and its fit may stay in a minimum that is
//! not the lowest in combination with the final ones.
//!
//! Tried are the effects that the search added. Those of the model file are fitted from their own starts only.

use ct_model::effects::{Candidate, Role};
use estimation::{Noise, Residuals, linearise, within};
use rayon::prelude::*;

use crate::fit::node::{Context, FINE, Node};
use crate::search::score::{QUANTISATION, step_within, thinned};

/// Values that are tried near that of the fit: its distance from the absent value, times these factors. Chosen, for time.
const NEAR: [f64; 8] = [0.8, 0.88, 0.93, 0.97, 1.03, 1.08, 1.15, 1.25];
/// First positions that are tried: they are from -1 to 1. Chosen, for time.
const BEGINS: [f64; 7] = [-0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9];
/// Step that is left out if the time limit is reached.
const OTHER_VALUES: &str = "other values of thresholds";

impl Context<'_> {
    /// The set in the lowest minimum that its effects with thresholds reach from other values of theirs, one effect at a time. `first`: the
    /// position of the first effect that is tried.
    pub fn in_lowest_minimum(&self, node: Node, first: usize, noise: &Noise) -> Node {
        let mut node = node;
        for _ in 0..self.thresholds.minima_rounds {
            let before = node.fit.deviance;
            for position in first..node.added.len() {
                if self.candidates[node.added[position]].is_smooth() {
                    continue;
                }
                if self.limit.leaves_out(OTHER_VALUES) {
                    return node;
                }
                let starts = self.other_starts(&node, position, noise);
                if let Some(starts) = starts.filter(|starts| !starts.is_empty()) {
                    let other =
                        self.fitted(node.added.clone(), node.model.clone(), starts, noise, FINE);
                    if let Ok(other) = other
                        && other.fit.cost < node.fit.cost
                    {
                        node = other;
                    }
                }
            }
            if before - node.fit.deviance < self.thresholds.growth_margin {
                break;
            }
        }
        node
    }

    /// Starts of a set's fit with other values of one effect's thresholds, those with the lowest predicted cost.
    fn other_starts(&self, node: &Node, position: usize, noise: &Noise) -> Option<Vec<Vec<f64>>> {
        let candidate = &self.candidates[node.added[position]];
        // Its step is that of the readings; with another one hard steps may fit single readings.
        if candidate
            .effect
            .is_some_and(|effect| effect.id == QUANTISATION)
        {
            return None;
        }
        let setup = self.setup(&node.model).ok()?;
        let place = |of: &str| -> Option<usize> {
            let mut all = node.spec().parameters.iter();
            let at = all.position(|p| p.about.name == of)?;
            setup.free().contains(&at).then_some(at)
        };
        let mut values = near(candidate, node);
        values.extend(thinned(candidate.starts(), self.thresholds.scored_starts));
        let mut starts: Vec<Vec<f64>> = Vec::new();
        for values in values {
            let mut x = node.fit.x.clone();
            for (own, value) in candidate.parameters.iter().zip(values) {
                let Some(at) = place(&own.name) else { continue };
                if matches!(own.role, Role::Threshold | Role::Begin) {
                    x[at] = within(value, setup.bounds()[at]);
                }
            }
            if x != node.fit.x && !starts.contains(&x) {
                starts.push(x);
            }
        }
        let all: Vec<usize> = (0..setup.free().len()).collect();
        let predicted = |x: Vec<f64>| {
            let triangle = linearise(&setup, &x, noise)?;
            let step = step_within(&triangle, (&setup, &x), &all);
            let predicted = triangle.predicted(&step);
            predicted.is_finite().then_some((predicted, x))
        };
        let starts = starts.into_par_iter().filter(|_| !self.limit.passed());
        let mut scored: Vec<(f64, Vec<f64>)> = starts.filter_map(predicted).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.truncate(self.thresholds.minima_fitted);
        Some(scored.into_iter().map(|(_, x)| x).collect())
    }
}

/// Values of an effect's parameters near those of the fit: one threshold at a time, at each first position.
fn near(candidate: &Candidate, node: &Node) -> Vec<Vec<f64>> {
    let own = &candidate.parameters;
    let fitted: Vec<f64> = own
        .iter()
        .map(|p| node.value(&p.name).unwrap_or(p.absent))
        .collect();
    let mut thresholds = vec![fitted.clone()];
    for (at, parameter) in own.iter().enumerate() {
        if parameter.role == Role::Threshold {
            let distance = fitted[at] - parameter.absent;
            thresholds.extend(NEAR.map(|factor| {
                let mut values = fitted.clone();
                values[at] = parameter.absent + factor * distance;
                values
            }));
        }
    }
    let Some(begin) = own.iter().position(|p| p.role == Role::Begin) else {
        return thresholds;
    };
    let at_each = thresholds.iter().flat_map(|values| {
        BEGINS.map(|position| {
            let mut values = values.clone();
            values[begin] = position;
            values
        })
    });
    let all: Vec<Vec<f64>> = at_each.collect();
    [thresholds, all].concat()
}
