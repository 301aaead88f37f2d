//! Partial explanation: effects that explain a large part of the error, if the residual is slower than noise that a search can model.
//!
//! Measured records hold several causes, and disturbances that are nearly integrated. A noise model with a long memory uses changes from
//! sample to sample only: it treats every slow effect as noise, and a fit with this weighting lets the simulation drift. In this case sets
//! are compared by their simulation error. A set is a partial explanation if
//! - it explains a share of the mean squared error above the noise, what its past does not predict ([`Thresholds::partial_share`]); an
//!   effect that depends on time only, which imitates any slow disturbance, nearly all of it ([`Thresholds::partial_share_of_time`]), and
//!   alone or beside effects that the acceptance test keeps with it; several such effects fit any disturbance, and are none;
//! - several effects are each worth it, as in a larger set (below);
//! - it predicts the next sample as well as the model without it, each with its own noise model;
//! - what is fitted to three quarters of the records predicts the fourth (cross-validation);
//! - no size of its effects is at a bound.
//!
//! [`Thresholds::partial_share`]: crate::Thresholds::partial_share
//! [`Thresholds::partial_share_of_time`]: crate::Thresholds::partial_share_of_time
//!
//! A larger set is taken where each further effect leaves at most a half of what a smaller set leaves, or three quarters of the squared
//! error in the cross-validation, lowers the squared error by a tenth, and is significant beside the smaller set's effects.

use ct_model::effects::{EffectParameter, Role};
use ct_signals::Record;
use estimation::{Fit, Noise, Stopping, fit_from, linearise, prewhitened};
use greybox::ModelSetup;
use rayon::prelude::*;

use crate::Error;
use crate::fit::node::{Context, FINE, Node, ROUGH};
use crate::search::grow::{best_first, same_set};

/// An initial state is determined by the readings after the beginning if its influence on them is at least this share of that on all.
const REMEMBERED: f64 = 0.1;
/// A fit with a noise model of its own ends where a step predicts a smaller fall of the deviance.
const DEVIANCE: f64 = 0.1;

/// A set as a partial explanation.
#[derive(Clone)]
struct Part {
    set: Node,
    /// The share of the error above the noise that it explains.
    share: f64,
    /// The squared error of each output in the cross-validation.
    left_out: Vec<f64>,
    /// The criterion with a noise model of its own, of limited memory.
    bic: f64,
}

impl Context<'_> {
    /// The set that explains a large part of the error, fitted with white noise: of those with as many effects the one with the
    /// smallest error in the cross-validation. `None` if no set is a partial explanation. `sets`: fitted with any noise model; `base`: fitted
    /// with white noise; `accepted`: the set of the acceptance test.
    pub fn largest_part(
        &self,
        (base, accepted): (&Node, &Node),
        sets: &[Node],
    ) -> Result<Option<Node>, Error> {
        let white = Noise::white(self.problem.records[0].outputs.len());
        let own_base = self.in_limited_noise(base)?;
        let Some(base_left_out) = self.left_out_squares(base).ok().flatten() else {
            return Ok(None);
        };
        let of_base = Part {
            set: base.clone(),
            share: 0.0,
            left_out: base_left_out,
            bic: own_base.bic(),
        };
        let may_be_a_part = |set: &&Node| {
            let new = &set.added[base.added.len()..];
            let is_accepted = || new.iter().all(|i| accepted.added.contains(i));
            match self.in_time(new) {
                0 => true,
                1 => new.len() == 1 || is_accepted(),
                _ => false,
            }
        };
        let sets: Vec<&Node> = sets.iter().filter(may_be_a_part).collect();
        let is_white = |set: &Node| set.fit.noise.order() == 0;
        let is_better = |set: &Node, known: &Node| {
            is_white(set) && (!is_white(known) || set.fit.cost < known.fit.cost)
        };
        let most = sets.iter().map(|set| self.size(set)).max().unwrap_or(0);
        let mut best: Option<Part> = None;
        let mut smaller: Vec<Part> = Vec::new();
        for size in self.size(base) + 1..=most {
            if self.limit.passed() {
                break;
            }
            let mut of_size: Vec<&Node> = Vec::new();
            for set in sets.iter().filter(|set| self.size(set) == size) {
                match of_size.iter_mut().find(|known| same_set(known, set)) {
                    // Fits of one set may end in different minima.
                    Some(known) if is_better(set, known) => *known = set,
                    Some(_) => {}
                    None => of_size.push(set),
                }
            }
            let fits = of_size.into_par_iter().filter_map(|set| {
                if is_white(set) {
                    return Some(set.clone());
                }
                self.refitted(set, &white, ROUGH).ok()
            });
            let mut fits = best_first(fits.collect());
            fits.truncate(self.thresholds.partial_tested);
            let parts: Vec<Part> = fits
                .into_par_iter()
                .filter_map(|set| self.refitted(&set, &white, FINE).ok())
                .filter_map(|set| {
                    let part = self.part((&of_base, &own_base), set);
                    part.ok().flatten()
                })
                .collect();
            let says_more = |part: &&Part| {
                smaller.iter().all(|less| {
                    let within = less.set.added.iter().all(|i| part.set.added.contains(i));
                    let is_best = best
                        .as_ref()
                        .is_some_and(|best| same_set(&best.set, &less.set));
                    !(within || is_best) || self.pays(part, less)
                })
            };
            let carried = |part: &Part| fall(&of_base.left_out, &part.left_out);
            let more = parts.iter().filter(says_more);
            if let Some(part) = more.max_by(|a, b| carried(a).total_cmp(&carried(b))) {
                best = Some(part.clone());
            }
            smaller.extend(parts);
        }
        Ok(best.map(|best| best.set))
    }

    /// Whether each effect of a part in addition to those of a smaller one is worth it.
    fn pays(&self, part: &Part, less: &Part) -> bool {
        let further = (self.size(&part.set) - self.size(&less.set)) as i32;
        let left = |of: f64| of.powi(further);
        let error = error_left(&less.set.fit, &part.set.fit);
        // Near the noise, the share that is left is a difference of two nearly equal numbers.
        if error > left(self.thresholds.partial_error)
            || less.bic - part.bic <= self.thresholds.bic_margin * f64::from(further)
        {
            return false;
        }
        1.0 - part.share <= left(self.thresholds.partial_left) * (1.0 - less.share)
            || 1.0 - fall(&less.left_out, &part.left_out) <= left(self.thresholds.partial_left_out)
    }

    /// Number of effects of a set; functions of time count twice, because they are more flexible.
    fn size(&self, set: &Node) -> usize {
        set.added.len() + self.in_time(&set.added)
    }

    /// A set as a partial explanation; `None` if it is none.
    fn part(&self, (base, own_base): (&Part, &Fit), set: Node) -> Result<Option<Part>, Error> {
        let new = &set.added[base.set.added.len()..];
        if self.at_a_bound(&set, new) {
            return Ok(None);
        }
        let own = self.in_limited_noise(&set)?;
        let floors = own.noise.sigmas();
        let share = explained(&base.set.fit, &set.fit, &floors);
        let least = if self.in_time(new) > 0 {
            self.thresholds.partial_share_of_time
        } else {
            self.thresholds.partial_share
        };
        let mut innovations = own.noise.iter().zip(own_base.noise.iter());
        let plausible = share >= least
            && innovations
                .all(|(own, base)| own.sigma() <= self.thresholds.innovation_ratio * base.sigma());
        if !plausible {
            return Ok(None);
        }
        let several = new.len() > 1;
        let left_out = self.left_out_squares(&set)?;
        let left_out = left_out
            .filter(|left_out| fall(&base.left_out, left_out) >= self.thresholds.carried_over);
        let part = left_out.map(|left_out| Part {
            set,
            share,
            left_out,
            bic: own.bic(),
        });
        // Several effects have to explain more than one.
        Ok(part.filter(|part| !several || self.pays(part, base)))
    }

    /// The fit of a set with a noise model of its own residual, with limited memory.
    pub fn in_limited_noise(&self, node: &Node) -> Result<Fit, Error> {
        let setup = self.setup(&node.model)?;
        let memory = Some(self.longest_memory());
        // The deviance is then known to a small part of the margins that it is compared with.
        let stopping = Stopping {
            cost: ROUGH.cost.min(DEVIANCE / self.samples()),
            ..ROUGH
        };
        Ok(prewhitened(
            &setup,
            node.fit.clone(),
            self.thresholds.noise_order,
            memory,
            stopping,
        )?)
    }

    /// Samples per independent sample of a noise with limited memory: factor by which slow parameters, and differences of the deviance with
    /// white noise, are less certain than under white noise of the same variance.
    pub fn slowness(&self, noise: &Noise) -> f64 {
        let limited = noise.with_memory_at_most(self.longest_memory());
        let outputs = limited.iter().zip(&self.problem.records[0].outputs);
        let (mut all, mut independent) = (0.0, 0.0);
        for (o, (noise, _)) in outputs.enumerate() {
            let records = self.problem.records.iter().map(|r| &r.outputs[o]);
            let samples = records.map(|y| y.values.len() - y.missing()).sum::<usize>() as f64;
            all += samples;
            independent += samples * noise.slow_gain().powi(2).min(1.0);
        }
        all / independent.max(f64::MIN_POSITIVE)
    }

    /// Whether a parameter of these effects is at a bound that is not one of its starts: such a bound is a value like others, as that all
    /// of a spill reaches the next tank. A play may begin at an end of its band.
    fn at_a_bound(&self, node: &Node, effects: &[usize]) -> bool {
        let errors = node.fit.std_errors();
        let fitted = effects.iter().flat_map(|&i| {
            let own = self.candidates[i].parameters.iter();
            own.filter(|p| !matches!(p.role, Role::Begin | Role::Choice))
        });
        let fitted: Vec<&EffectParameter> = fitted.collect();
        let values = node.fit.x.iter().zip(errors);
        let mut all = node.spec().parameters.iter().zip(values);
        all.any(|(parameter, (value, error))| {
            let mut own = fitted.iter().filter(|p| p.name == parameter.about.name);
            error.is_none() && own.any(|p| !p.starts.contains(value))
        })
    }

    /// The squared error of each output on parts of the records that are not used for the fit; `None` if a simulation is not finite.
    pub fn left_out_squares(&self, node: &Node) -> Result<Option<Vec<f64>>, Error> {
        let mut squares = vec![0.0; self.problem.records[0].outputs.len()];
        for fold in 0..self.thresholds.folds {
            let Some(of_fold) = self.left_out(node, fold)? else {
                return Ok(None);
            };
            for (sum, square) in squares.iter_mut().zip(of_fold) {
                *sum += square;
            }
        }
        Ok(Some(squares))
    }

    /// The squared error of each output on a part of all records, if the readings of this part are not used for the fit; `None` if the
    /// simulation is not finite.
    fn left_out(&self, node: &Node, fold: usize) -> Result<Option<Vec<f64>>, Error> {
        let part = |record: &Record| {
            let row = |fold: usize| record.len() * fold / self.thresholds.folds;
            row(fold)..row(fold + 1)
        };
        let mut fitted = self.problem.records.clone();
        for record in &mut fitted {
            let rows = part(record);
            for output in &mut record.outputs {
                output.values[rows.clone()].fill(f64::NAN);
            }
        }
        let setup = self.setup(&node.model)?;
        let white = Noise::white(setup.outputs());
        let others = setup.against(&fitted);
        let others = if fold == 0 {
            without_forgotten_states((&setup, others), &node.fit.x, &white)
        } else {
            others
        };
        let fit = fit_from(&others, vec![node.fit.x.clone().into()], &white, ROUGH)?;
        // A fit that was cut short is still near the estimates from all readings.
        if self.limit.leaves_out("parts of the cross-validation") {
            return Ok(None);
        }
        let Some(residuals) = estimation::residuals(&setup, &fit.x) else {
            return Ok(None);
        };
        let mut squares = vec![0.0; setup.outputs()];
        for (i, residual) in residuals.iter().enumerate() {
            let rows = part(&self.problem.records[i / setup.outputs()]);
            let present = residual[rows].iter().filter(|e| !e.is_nan());
            squares[i % setup.outputs()] += present.map(|e| e * e).sum::<f64>();
        }
        Ok(Some(squares))
    }
}

/// A setup without the beginnings of the records, in which initial states that the other readings hardly depend on keep their values: a fit
/// may end at any value of them. `whole`: with all readings.
fn without_forgotten_states<'a>(
    (whole, others): (&ModelSetup<'a>, ModelSetup<'a>),
    x: &[f64],
    white: &Noise,
) -> ModelSetup<'a> {
    let norms = |setup: &ModelSetup| linearise(setup, x, white);
    let (Some(all), Some(left)) = (norms(whole), norms(&others)) else {
        return others;
    };
    let is_determined = |column: &usize| {
        whole.free()[*column] < whole.parameter_count()
            || left.column_norm(*column) > REMEMBERED * all.column_norm(*column)
    };
    let columns = (0..whole.free().len()).filter(is_determined);
    let kept: Vec<usize> = columns.map(|column| whole.free()[column]).collect();
    others.with_free(&kept)
}

/// The squared error of a larger set's fit as a share of that of a smaller one; of several outputs by the geometric mean.
pub(crate) fn error_left(less: &Fit, more: &Fit) -> f64 {
    let squares = |fit: &Fit| -> Vec<f64> { fit.rmse.iter().map(|e| e * e).collect() };
    1.0 - fall(&squares(less), &squares(more))
}

/// The relative fall of squared errors: of several outputs, that of their geometric mean, as in a likelihood with a variance of each
/// output. An output without an error before is left out.
pub(crate) fn fall(before: &[f64], after: &[f64]) -> f64 {
    let pairs = before.iter().zip(after);
    let logarithms: Vec<f64> = pairs
        .filter(|(before, _)| **before > 0.0)
        .map(|(before, after)| (after / before).ln())
        .collect();
    1.0 - (logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64).exp()
}

/// The share of the mean squared error above the noise that a set explains. `floors`: standard deviation of each output's noise \[output
/// unit\].
pub(crate) fn explained(base: &Fit, last: &Fit, floors: &[f64]) -> f64 {
    let squares = |fit: &Fit| -> f64 {
        let each = fit.rmse.iter().zip(floors);
        each.map(|(rmse, floor)| (rmse / floor.max(f64::MIN_POSITIVE)).powi(2))
            .sum::<f64>()
            / floors.len() as f64
    };
    let (before, after) = (squares(base), squares(last));
    if before <= 1.0 {
        return 0.0;
    }
    ((before - after.max(1.0)) / (before - 1.0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::fall;

    #[test]
    fn outputs_count_alike_whether_they_become_better_or_worse() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(fall(&[4.0], &[1.0]), 0.75);
        // One is four times better, the other four times worse: neither a fall nor a rise.
        close(fall(&[4.0, 1.0], &[1.0, 4.0]), 0.0);
        close(fall(&[1.0, 1.0], &[0.25, 1.0]), 0.5);
        // Of an output without an error nothing is known.
        close(fall(&[0.0, 2.0], &[0.0, 1.0]), 0.5);
    }
}
