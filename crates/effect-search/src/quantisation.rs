//! Readings that are rounded together with their noise.
//!
//! The readings themselves show it: nearly all are multiples of one step. The criterion hardly falls, because the noise acts as dither: the
//! mean reading is nearly linear in the measured quantity, and rounding acts as further noise of variance `step^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use std::ops::RangeInclusive;
use std::sync::Arc;

use ct_model::effects::{Candidate, Port};
use ct_model::{Expression, Function, Model, ModelSpec};
use estimation::{Fit, Residuals, within};
use greybox::exact_reading_step;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::node::{Context, FINE, Node};
use crate::score::QUANTISATION;

/// Rounding is reported if its variance is within this range, as a share of the mean squared residual. With a larger variance the measured
/// quantity is constant, or the grid is not that of a converter.
const SHARE: RangeInclusive<f64> = 1.0 / 3.0..=1.1;

/// Step that is left out if the time is over.
const ROUNDING: &str = "the rounding of readings";
/// Least noise before the rounding, as a share of the step: with less, the effect does not depend on it.
const LEAST_DITHER: f64 = 0.1;

/// Rounding of an output's readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantisation {
    /// The output.
    pub output: String,
    /// Unit of the output.
    pub unit: String,
    /// Nearly all readings are multiples of this step \[unit of the output\].
    pub step: f64,
    /// Variance of the rounding error, as a share of the mean squared residual.
    pub share: f64,
}

/// Outputs whose rounded readings cause a large part of a model's residual, except those that are rounded in the model too.
pub(crate) fn quantisation(context: &Context, node: &Node) -> Vec<Quantisation> {
    let records = &context.problem.records;
    let in_model = |output: usize| {
        let mut added = node.added.iter();
        added.any(|&i| rounds(&context.candidates[i], output))
    };
    let outputs = records[0].outputs.iter().zip(&node.fit.rmse).enumerate();
    let rounded = outputs.filter_map(|(i, (output, rmse))| {
        if in_model(i) {
            return None;
        }
        let step = exact_reading_step(records, i)?;
        let share = step.powi(2) / 12.0 / rmse.powi(2);
        SHARE.contains(&share).then(|| Quantisation {
            output: output.name.clone(),
            unit: output.unit.clone(),
            step,
            share,
        })
    });
    rounded.collect()
}

/// Whether a candidate rounds the readings of an output.
fn rounds(candidate: &Candidate, output: usize) -> bool {
    let effect = candidate.effect;
    effect.is_some_and(|effect| effect.id == QUANTISATION) && candidate.port == Port::Output(output)
}

/// Whether a model rounds by itself.
fn rounds_already(spec: &ModelSpec) -> bool {
    let rounds = |part: &Expression| matches!(part, Expression::Call(Function::Quantise, _));
    spec.expressions().any(|whole| whole.any(&rounds))
}

impl Context<'_> {
    /// The set with the rounding that the readings show, at up to `most` outputs, the largest part of the error first; with its fit in its own
    /// noise. An output is left out if the error would rise. `own`: the fit of the set in its own noise.
    pub fn with_rounding(&self, mut node: Node, mut own: Fit, most: usize) -> (Node, Fit) {
        if rounds_already(&self.problem.spec) {
            return (node, own);
        }
        let mut found = quantisation(self, &node);
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        let before = node.added.len();
        for Quantisation { output, .. } in found {
            let mut outputs = self.problem.records[0].outputs.iter();
            let output = outputs.position(|y| y.name == output);
            let mut candidates = self.candidates.iter();
            let candidate = candidates.position(|c| output.is_some_and(|o| rounds(c, o)));
            let Some(i) = candidate.filter(|_| node.added.len() < before + most) else {
                continue;
            };
            if self.limit.leaves_out(ROUNDING) {
                break;
            }
            let rounded = self.rounded(&node, i).ok().flatten();
            // The residual of the set has passed the tests; those of the rounded one would fail by chance, as its scatter depends on the
            // reading.
            if let Some(rounded) = rounded.filter(|rounded| rounded.fit.cost < node.fit.cost)
                && let Ok(fit) = self.in_own_noise(&rounded)
            {
                (node, own) = (rounded, fit);
            }
        }
        (node, own)
    }

    /// The set with a rounding effect, fitted from what the readings show.
    fn rounded(&self, node: &Node, i: usize) -> Result<Option<Node>, Error> {
        let mut added = node.added.clone();
        added.push(i);
        let model = Arc::new(self.model(&added)?);
        let starts = self.rounding_starts(node, i, &model)?;
        if starts.is_empty() {
            return Ok(None);
        }
        self.fitted(added, model, starts, &node.fit.noise, FINE)
            .map(Some)
    }

    /// Starts of a rounding effect from the step of the readings, with the noise before the rounding that the residual of a set without it
    /// shows, and without such noise; empty for other effects, and if the readings show no step.
    pub fn rounding_starts(
        &self,
        node: &Node,
        i: usize,
        model: &Model,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let candidate = &self.candidates[i];
        let records = &self.problem.records;
        let mut outputs = 0..records[0].outputs.len();
        let output = outputs.find(|&output| rounds(candidate, output));
        let read = output.and_then(|o| Some((o, exact_reading_step(records, o)?)));
        let Some((output, step)) = read else {
            return Ok(Vec::new());
        };
        let setup = self.setup(model)?;
        let begin = self.transfer(node, model, setup.start());
        let noise = node.fit.rmse[output].powi(2) - step.powi(2) / 12.0;
        let dithers = [(noise.max(0.0).sqrt() / step).max(LEAST_DITHER), 0.0];
        let starts = dithers.map(|dither| {
            let mut x = begin.clone();
            for own in &candidate.parameters {
                let mut parameters = model.spec().parameters.iter();
                if let Some(at) = parameters.position(|p| p.about.name == own.name) {
                    let value = if own.short == "step" { step } else { dither };
                    x[at] = within(value, setup.bounds()[at]);
                }
            }
            x
        });
        Ok(starts.to_vec())
    }
}
