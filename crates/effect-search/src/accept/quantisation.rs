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
use estimation::{Fit, Noise, Residuals, within};
use greybox::exact_reading_step;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::fit::node::{Context, FINE, Node};
use crate::search::score::QUANTISATION;

/// Rounding is reported if its variance is within this range, as a share of the mean squared residual. With a larger variance the measured
/// quantity is constant, or the grid is not that of a converter.
const SHARE: RangeInclusive<f64> = 1.0 / 3.0..=1.1;

/// Step that is left out if the time limit is reached.
const ROUNDING: &str = "the rounding of readings";
/// Least noise before the rounding, as a share of the step: with less, the effect does not depend on it.
const LEAST_DITHER: f64 = 0.1;

/// Noise before the rounding, as a share of the step, up to which the effect has hard steps.
const HARD: f64 = 0.08;
/// Noise before the rounding of smooth staircases, as shares of the step.
const DITHERS: [f64; 3] = [0.1, 0.2, 0.3];
/// See [`Context::scatter`].
const SCATTER: f64 = 0.347;
/// Largest error of a reading in steps, with noise of 0.3 steps before the rounding.
const LARGEST_ERROR: f64 = 2.0;

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

/// The rounding of an output in a set: positions of its parameters.
struct Rounding {
    output: usize,
    dither: usize,
    step: usize,
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
    is_rounding(candidate) && candidate.port == Port::Output(output)
}

/// Whether a candidate rounds readings.
fn is_rounding(candidate: &Candidate) -> bool {
    let effect = candidate.effect;
    effect.is_some_and(|effect| effect.id == QUANTISATION)
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

    /// A set that rounds, with the smooth staircase of noise before the rounding that fits best; `None` for a set that does not round. The
    /// cost of hard steps depends on single readings next to the steps, so other effects may lower it by chance.
    pub fn smooth_rounding(&self, node: &Node, noise: &Noise) -> Option<Node> {
        let roundings = self.roundings(node);
        if roundings.is_empty() {
            return None;
        }
        let of = |dither: f64| {
            let mut x = node.fit.x.clone();
            for rounding in &roundings {
                x[rounding.dither] = dither;
            }
            let (added, model) = (node.added.clone(), node.model.clone());
            self.fitted(added, model, vec![x], noise, FINE).ok()
        };
        let all = DITHERS.into_iter().filter_map(of);
        all.min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
    }

    /// A set that rounds with almost no noise before the rounding, without its roundings; `None` for other sets. The residual of hard steps may vanish,
    /// and says nothing of the estimates' errors; without the steps the rounding error is noise.
    pub fn without_hard_steps(&self, node: &Node) -> Result<Option<Node>, Error> {
        let is_hard = |rounding: &Rounding| node.fit.x[rounding.dither] <= HARD;
        if !self.roundings(node).iter().any(is_hard) {
            return Ok(None);
        }
        let rest = node.added.iter().copied();
        let rest = rest
            .filter(|&i| !is_rounding(&self.candidates[i]))
            .collect();
        let white = Noise::white(node.spec().outputs.len());
        self.subset(node, rest, &white, FINE).map(Some)
    }

    /// The rounding of each output in a set.
    fn roundings(&self, node: &Node) -> Vec<Rounding> {
        let at = |candidate: &Candidate, short: &str| {
            let mut own = candidate.parameters.iter();
            let name = &own.find(|own| own.short == short)?.name;
            let mut all = node.spec().parameters.iter();
            all.position(|p| p.about.name == *name)
        };
        let added = node.added.iter().map(|&i| &self.candidates[i]);
        let roundings = added.filter_map(|candidate| match candidate.port {
            Port::Output(output) if is_rounding(candidate) => Some(Rounding {
                output,
                dither: at(candidate, "dither")?,
                step: at(candidate, "step")?,
            }),
            _ => None,
        });
        roundings.collect()
    }

    /// Largest error that the rounding of an output and its noise can cause \[unit of the output\]; `None` if the set does not round it.
    pub fn largest_rounding_error(&self, node: &Node, output: usize) -> Option<f64> {
        let roundings = self.roundings(node);
        let of = roundings.iter().find(|of| of.output == output)?;
        Some(LARGEST_ERROR * node.fit.x[of.step])
    }

    /// Ratio of a fall of the deviance by chance to that in noise of constant variance: with a smooth staircase the readings scatter only next to
    /// steps, where the model's output has the largest slope. For normal noise of `d` steps it is 0.347/d: the mean of the squared slope times the
    /// variance, `0.1959/(2 sqrt(pi) d)`, over the mean squared slope `1/(2 sqrt(pi) d)` and the mean variance `d/sqrt(pi)`. The largest of all
    /// outputs; 1 for sets that do not round.
    pub fn scatter(&self, node: &Node) -> f64 {
        let of = |rounding: &Rounding| {
            let dither = node.fit.x[rounding.dither];
            (dither > 0.0).then(|| SCATTER / dither)
        };
        let all = self.roundings(node);
        all.iter().filter_map(of).fold(1.0, f64::max)
    }

    /// Whether a part of a set with a smooth staircase explains the records as well, where a fall of the deviance by chance is larger than in
    /// noise of constant variance ([`Context::scatter`]); `None` if the part does not round.
    pub fn is_chance_in_smooth(&self, smooth: &Node, part: &Node, noise: &Noise) -> Option<bool> {
        let part = self.of_smooth(smooth, part, noise)?;
        let fall = (part.fit.deviance - smooth.fit.deviance) / self.scatter(smooth);
        let mut lacking = part.fit.clone();
        lacking.deviance = smooth.fit.deviance + fall;
        let more = smooth.fit.parameters as f64 - lacking.parameters as f64;
        let gain = fall - more * self.samples().ln();
        Some(
            gain <= self.thresholds.bic_margin
                || !self.beyond_chance((smooth, &smooth.fit), (&part, &lacking)),
        )
    }

    /// A part of a set with a smooth staircase; `None` if the part does not round.
    pub fn of_smooth(&self, smooth: &Node, part: &Node, noise: &Noise) -> Option<Node> {
        if !part.added.iter().any(|&i| is_rounding(&self.candidates[i])) {
            return None;
        }
        self.subset(smooth, part.added.clone(), noise, FINE).ok()
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
