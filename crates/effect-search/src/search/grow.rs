//! The search of sets of effects, prewhitened by one noise model: all single effects, pairs by their joint scores, and a beam of sets that
//! grow by one effect at a time.
//!
//! Effects act together: a pair may explain what neither of its members does. So every set of the beam is scored again with all candidates,
//! and pairs are looked at before any single effect is chosen.

use estimation::Noise;
use rayon::prelude::*;

use crate::Error;
use crate::fit::node::{Context, FINE, Node, ROUGH};
use crate::search::pairs::joint_scores;
use crate::search::score::Trial;

/// Step that is left out if the time limit is reached.
const LARGER: &str = "larger sets of effects";

/// Result of a search with one noise model.
pub(crate) struct Grown {
    /// The first model of the search.
    pub base: Node,
    /// Single effects, best first, ...
    pub singles: Vec<Node>,
    /// ... and the set that they were added to, with their weighting: [`Self::base`] may be fitted again with another one.
    pub of_singles: Node,
    /// The set with the least criterion.
    pub best: Node,
    /// Candidates that are scored for sets of several effects: candidates with almost no influence on the believed model are left out.
    among: Vec<usize>,
    /// Sets that may be extended, best first.
    beam: Vec<Node>,
    /// All fitted sets.
    pub fitted: Vec<Node>,
    /// Whether the time limit ended the search.
    pub cut_short: bool,
}

impl Context<'_> {
    /// Fits of candidates added to a set. Of tied candidates only the first one is fitted from its starts; the fits of the others begin at its
    /// end, with a size of the same influence, where they end at once if their influence is the same in all orders.
    pub fn refits(&self, node: &Node, trials: &[Trial], noise: &Noise) -> Vec<Node> {
        let fitted = |trial: &Trial, starts: Vec<Vec<f64>>| {
            if self.limit.passed() {
                return None;
            }
            let mut added = node.added.clone();
            added.push(trial.candidate);
            self.fitted(added, trial.model.clone(), starts, noise, ROUGH)
                .ok()
        };
        let repeats = |k: usize| {
            let candidate = trials[k].candidate;
            let before: Vec<usize> = trials[..k].iter().map(|trial| trial.candidate).collect();
            self.is_tied_to_one_of(candidate, &before)
        };
        let (others, first): (Vec<usize>, Vec<usize>) =
            (0..trials.len()).partition(|&k| repeats(k));
        let first = first.par_iter();
        let first = first.filter_map(|&k| fitted(&trials[k], trials[k].starts.clone()));
        let mut fits: Vec<Node> = first.collect();
        let others = others.par_iter().filter_map(|&k| {
            let trial = &trials[k];
            let mut starts = fits.iter();
            let start = starts.find_map(|of| self.tied_start(of, &trial.model, trial.candidate));
            fitted(
                trial,
                start.map_or_else(|| trial.starts.clone(), |start| vec![start]),
            )
        });
        let others: Vec<Node> = others.collect();
        fits.extend(others);
        best_first(fits)
    }

    /// Whether a fit has a parameter at a bound, or one that the records do not determine.
    fn is_open(&self, node: &Node) -> bool {
        let errors = node.fit.std_errors();
        let free = self.setup(&node.model).map(|setup| setup.free().to_vec());
        free.is_ok_and(|free| free.iter().any(|&i| errors[i].is_none()))
    }

    /// The best single effects fitted again from their own starts. If the believed model has no minimum within its bounds, the fits of
    /// single effects start at its end point, which may be unfavourable. `known`: fits of single effects with another weighting.
    fn refit_from_own_starts(&self, nodes: &mut [Node], known: &[Node], noise: &Noise) {
        nodes
            .par_iter_mut()
            .take(self.thresholds.own_start_refits)
            .for_each(|node| {
                if self.limit.passed() {
                    return;
                }
                let start = match known.iter().find(|known| known.added == node.added) {
                    Some(known) => Ok(known.fit.x.clone()),
                    None => self.own_minimum(&node.model),
                };
                let added = node.added.clone();
                let model = node.model.clone();
                let again = start.and_then(|x| self.fitted(added, model, vec![x], noise, ROUGH));
                if let Ok(again) = again
                    && again.fit.cost < node.fit.cost
                {
                    *node = again;
                }
            });
        sort_by_criterion(nodes);
    }

    /// The search of sets up to a given number of effects. `of`: positions of the candidates; `known`: fits of single effects with another
    /// weighting.
    pub fn grow(
        &self,
        base: Node,
        (of, known): (&[usize], &[Node]),
        noise: &Noise,
        max_effects: usize,
    ) -> Result<Grown, Error> {
        let trials = self.trials_among(&base, of, noise);
        let best = &trials[..trials.len().min(self.thresholds.first_refits)];
        let mut singles = self.refits(&base, best, noise);
        if self.is_open(&base) {
            self.refit_from_own_starts(&mut singles, known, noise);
        }
        let mut beam: Vec<Node> = Vec::new();
        if max_effects > 0 {
            beam.extend(singles.iter().take(self.thresholds.beam).cloned());
        }
        let few = beam.len();
        if max_effects > 1 && !self.limit.passed() {
            let pairs = joint_scores(self, &base, &trials, noise, self.thresholds.pair_refits);
            let fits: Vec<Node> = pairs
                .par_iter()
                .filter(|_| !self.limit.passed())
                .filter_map(|&(a, b)| self.pair(&base, (a, b), &trials, noise).ok().flatten())
                .collect();
            beam.extend(fits);
        }
        let many = (trials.len() / 2)
            .max(self.thresholds.kept_candidates)
            .min(trials.len());
        let mut among: Vec<usize> = trials[..many].iter().map(|t| t.candidate).collect();
        // A candidate that repeats another one is scored only if the other one is in the set.
        for i in 0..self.candidates.len() {
            if self.candidates[i].repeats.is_some()
                && !among.contains(&i)
                && self.may_stand_beside(i, &among)
            {
                among.push(i);
            }
        }
        let grown = Grown {
            best: base.clone(),
            among,
            cut_short: self.limit.leaves_out(LARGER),
            of_singles: base.clone(),
            base,
            fitted: singles.iter().chain(&beam[few..]).cloned().collect(),
            singles,
            beam,
        };
        self.grow_on(grown, noise, max_effects)
    }

    /// Continues the search to larger sets.
    pub fn grow_on(&self, grown: Grown, noise: &Noise, max_effects: usize) -> Result<Grown, Error> {
        let Grown {
            base,
            mut singles,
            of_singles,
            mut best,
            among,
            mut beam,
            mut fitted,
            mut cut_short,
        } = grown;
        let first_size = base.added.len() + 1;
        let mut size = first_size.max(best.added.len());
        loop {
            beam = best_first(beam);
            self.converge(&mut beam, [&mut fitted, &mut singles], noise);
            beam = best_first(beam);
            let Some(first) = beam.first() else { break };
            let gain = first.gain_over(&best);
            if gain > 0.0 {
                best = first.clone();
            }
            if gain < self.thresholds.growth_margin && size > first_size
                || size >= base.added.len() + max_effects
            {
                break;
            }
            if self.limit.leaves_out(LARGER) {
                cut_short = true;
                break;
            }
            size += 1;
            let enough = self.thresholds.beam_share * beam[0].gain_over(&base);
            beam.retain(|node| node.gain_over(&base) >= enough);
            beam = self.distinct(beam, noise);
            let parents: Vec<Node> = beam
                .iter()
                .filter(|node| node.added.len() < base.added.len() + max_effects)
                .cloned()
                .collect();
            for parent in &parents {
                if self.limit.leaves_out(LARGER) {
                    cut_short = true;
                    break;
                }
                let trials = self.trials_among(parent, &among, noise);
                let best: Vec<Trial> = trials
                    .into_iter()
                    .filter(|trial| self.may_lower_the_criterion(trial))
                    .take(self.thresholds.refits)
                    .collect();
                for child in self.refits(parent, &best, noise) {
                    match fitted.iter_mut().find(|known| same_set(known, &child)) {
                        Some(known) if known.fit.cost <= child.fit.cost => continue,
                        Some(known) => *known = child.clone(),
                        None => fitted.push(child.clone()),
                    }
                    beam.retain(|known| !same_set(known, &child));
                    beam.push(child);
                }
            }
        }
        sort_by_criterion(&mut singles);
        let all = fitted.iter().chain([&best]);
        let least = all.min_by(|a, b| self.with_margin(a).total_cmp(&self.with_margin(b)));
        best = self.refitted(least.unwrap_or(&best), noise, FINE)?;
        Ok(Grown {
            base,
            singles,
            of_singles,
            best,
            among,
            beam,
            fitted,
            cut_short,
        })
    }

    /// The criterion, with the margin of the acceptance test for each effect. A pair must be better by this margin than every single effect,
    /// not only than its own two: a parameter that depends on two temperatures fits as well as radiation does.
    fn with_margin(&self, set: &Node) -> f64 {
        set.fit.bic() + self.thresholds.bic_margin * set.added.len() as f64
    }

    /// Fits the best sets to convergence. Along a valley of the cost a rough fit ends far from its minimum, because the linearised model
    /// predicts a small reduction there. `lists`: further copies of the same sets.
    fn converge(&self, sets: &mut [Node], lists: [&mut Vec<Node>; 2], noise: &Noise) {
        let best = sets.len().min(self.thresholds.converged);
        sets[..best].par_iter_mut().for_each(|set| {
            if self.limit.passed() {
                return;
            }
            if let Ok(converged) = self.refitted(set, noise, FINE)
                && converged.fit.cost < set.fit.cost
            {
                *set = converged;
            }
        });
        for copy in lists.into_iter().flatten() {
            let set = sets[..best].iter().find(|set| same_set(copy, set));
            if let Some(set) = set.filter(|set| set.fit.cost < copy.fit.cost) {
                *copy = set.clone();
            }
        }
    }

    /// The sets that are extended, at most as many as the beam is wide: sets, best first, without those that differ little from a better
    /// set with as many effects. Two such sets, with a dead zone and with a constant flow, say, have similar extensions, and would fill the
    /// beam. The difference of two sets is that of their whitened residuals.
    fn distinct(&self, sets: Vec<Node>, noise: &Noise) -> Vec<Node> {
        let residual = |set: &Node| -> Option<Vec<f64>> {
            let series = estimation::residuals(&self.setup(&set.model).ok()?, &set.fit.x)?;
            let weights = &set.fit.weights;
            let weighted = |(i, series): (usize, Vec<f64>)| {
                let weight = weights[i % weights.len()];
                let present = move |e: f64| if e.is_nan() { 0.0 } else { weight * e };
                series.into_iter().map(present)
            };
            let whitened = noise.whiten(&series).into_iter().enumerate();
            Some(whitened.flat_map(weighted).collect())
        };
        let residuals: Vec<Option<Vec<f64>>> = sets.par_iter().map(residual).collect();
        let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let mut chosen: Vec<(Node, Option<Vec<f64>>)> = Vec::new();
        for (set, own) in sets.into_iter().zip(residuals) {
            if chosen.len() >= self.thresholds.beam {
                break;
            }
            let is_same = |(other, of_other): &(Node, Option<Vec<f64>>)| {
                let (Some(own), Some(of_other)) = (&own, of_other) else {
                    return false;
                };
                let apart: Vec<f64> = own.iter().zip(of_other).map(|(a, b)| a - b).collect();
                other.added.len() == set.added.len()
                    && squares(&apart) < self.thresholds.same_residual.powi(2) * squares(of_other)
            };
            if !chosen.iter().any(is_same) {
                chosen.push((set, own));
            }
        }
        chosen.into_iter().map(|(set, _)| set).collect()
    }

    /// Whether a candidate might lower the criterion.
    pub fn may_lower_the_criterion(&self, trial: &Trial) -> bool {
        let fitted = self.candidates[trial.candidate].fitted().max(1) as f64;
        self.thresholds.fall_factor * trial.fall + self.thresholds.fall_margin
            > fitted * self.samples().ln()
    }

    /// A pair of candidates added to a set, from the best starts of each.
    fn pair(
        &self,
        base: &Node,
        (a, b): (usize, usize),
        trials: &[Trial],
        noise: &Noise,
    ) -> Result<Option<Node>, Error> {
        let (first, second) = (&trials[a], &trials[b]);
        let mut added = base.added.clone();
        added.push(first.candidate);
        let quick = self.fitted(
            added,
            first.model.clone(),
            first.starts.clone(),
            noise,
            ROUGH,
        )?;
        let Some(both) = self.trial(&quick, second.candidate, noise)? else {
            return Ok(None);
        };
        let mut added = quick.added.clone();
        added.push(second.candidate);
        Ok(Some(self.fitted(
            added,
            both.model,
            both.starts,
            noise,
            ROUGH,
        )?))
    }
}

/// Whether two sets contain the same effects in any order.
pub(crate) fn same_set(a: &Node, b: &Node) -> bool {
    a.added.len() == b.added.len() && a.added.iter().all(|i| b.added.contains(i))
}

/// Sorted by the criterion.
pub(crate) fn best_first(mut nodes: Vec<Node>) -> Vec<Node> {
    sort_by_criterion(&mut nodes);
    nodes
}

fn sort_by_criterion(nodes: &mut [Node]) {
    nodes.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
}
