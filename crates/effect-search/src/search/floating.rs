//! Sets of effects that grow from what earlier searches found: one effect more at a time, then swap steps while they lower the
//! error (floating search).
//!
//! The effects of a measured record act together: two heaters on one board couple, their supply sags under both, and their sensors lag; any
//! one of these explains little without the others. A beam of the best pairs drops such a set in favour of functions of time, which fit any
//! slow error. Here sets are compared by their simulation error, without functions of time.
//!
//! **Reference**: P. Pudil, J. Novovicova, J. Kittler, Pattern Recognition Letters 15 (1994) 1119-1125 (floating search).

use estimation::{Fit, Noise};
use rayon::prelude::*;

use crate::fit::node::{Context, Node, ROUGH};
use crate::search::grow::{best_first, same_set};

impl Context<'_> {
    /// Floating search: sets of up to the given number of effects that are no functions of time, fitted with white noise. `sets`: sets of
    /// earlier searches, with any noise model.
    pub fn floating(&self, base: &Node, sets: &[Node], max_effects: usize) -> Vec<Node> {
        let white = Noise::white(base.spec().outputs.len());
        let timeless = self.timeless();
        let most = base.added.len() + max_effects;
        let mut fitted: Vec<Node> = Vec::new();
        for seed in self.seeds(base, sets, &white) {
            let all = seed.added.len();
            let mut set = self.exchanged(
                seed,
                (base.added.len(), all),
                &timeless,
                &white,
                &mut fitted,
            );
            while set.added.len() < most && !self.limit.passed() {
                let Some(more) = self.one_more(&set, &timeless, &white, &mut fitted) else {
                    break;
                };
                // The last effect is already the best one in combination with the others.
                let others = more.added.len() - 1;
                set = self.exchanged(
                    more,
                    (base.added.len(), others),
                    &timeless,
                    &white,
                    &mut fitted,
                );
            }
            fitted.push(set);
        }
        fitted
    }

    /// The set with the least criterion when each model has the noise model of its own residual, if this is less than that of a fit.
    pub fn better_in_own_noise(&self, sets: Vec<Node>, than: &Fit) -> Option<Node> {
        let best = best_first(sets)
            .into_iter()
            .take(self.thresholds.floating_compared);
        let fits: Vec<Node> = best
            .collect::<Vec<Node>>()
            .into_par_iter()
            .filter_map(|mut set| {
                set.fit = self.in_own_noise(&set).ok()?;
                Some(set)
            })
            .collect();
        let least = best_first(fits).into_iter().next()?;
        (least.fit.bic() < than.bic() - self.thresholds.growth_margin).then_some(least)
    }

    /// The best sets without their functions of time, fitted with white noise.
    fn seeds(&self, base: &Node, sets: &[Node], white: &Noise) -> Vec<Node> {
        let (by_error, coloured): (Vec<Node>, Vec<Node>) = sets
            .iter()
            .cloned()
            .partition(|set| set.fit.noise.order() == 0);
        let mut seeds: Vec<Node> = Vec::new();
        for of_metric in [by_error, coloured] {
            let before = seeds.len();
            for set in best_first(of_metric) {
                let timeless =
                    |i: &usize| base.added.contains(i) || !self.candidates[*i].follows_time();
                let mut seed = set;
                let kept: Vec<usize> = seed.added.iter().copied().filter(timeless).collect();
                if kept.len() <= base.added.len()
                    || seeds.len() - before >= self.thresholds.floating_seeds
                {
                    continue;
                }
                if kept.len() < seed.added.len() {
                    let Ok(part) = self.subset(&seed, kept, white, ROUGH) else {
                        continue;
                    };
                    seed = part;
                }
                if !seeds.iter().any(|known| same_set(known, &seed)) {
                    seeds.push(seed);
                }
            }
        }
        let fits = seeds
            .into_par_iter()
            .filter_map(|seed| self.refitted(&seed, white, ROUGH).ok());
        let seeds = best_first(fits.collect());
        // The best small set, and the best of all: sets that were grown together with functions of time may be wrong.
        let few = |seed: &&Node| {
            seed.added.len() <= base.added.len() + self.thresholds.floating_small_set
        };
        let first = seeds.iter().find(few).into_iter();
        let mut begin: Vec<Node> = first.chain(seeds.first()).cloned().collect();
        begin.dedup_by(|a, b| same_set(a, b));
        begin
    }

    /// The set with the one additional effect that lowers the criterion most. Beside several effects, the score of another one is often far
    /// too low.
    fn one_more(
        &self,
        set: &Node,
        of: &[usize],
        white: &Noise,
        fitted: &mut Vec<Node>,
    ) -> Option<Node> {
        let mut trials = self.trials_among(set, of, white);
        trials.truncate(self.thresholds.first_refits);
        let children = self.refits(set, &trials, white);
        fitted.extend(children.iter().cloned());
        let best = children.into_iter().next()?;
        (best.gain_over(set) > self.thresholds.growth_margin).then_some(best)
    }

    /// The set improved by swaps or removals of effects, one by one, while the criterion falls. `first`, `end`: the positions of the effects
    /// with which it begins; after a swap these are all.
    fn exchanged(
        &self,
        mut set: Node,
        (first, mut end): (usize, usize),
        of: &[usize],
        white: &Noise,
        fitted: &mut Vec<Node>,
    ) -> Node {
        let mut position = first;
        while position < end && !self.limit.passed() {
            let taken_out = set.added[position];
            let others: Vec<usize> = of.iter().copied().filter(|i| *i != taken_out).collect();
            let better = self.without(&set, position, white, ROUGH).ok();
            let better = better.and_then(|lacking| {
                if lacking.gain_over(&set) > 0.0 {
                    return Some(lacking);
                }
                let loss = lacking.fit.deviance - set.fit.deviance;
                let mut trials = self.trials_among(&lacking, &others, white);
                trials.retain(|trial| {
                    self.thresholds.fall_factor * trial.fall + self.thresholds.fall_margin > loss
                });
                trials.truncate(self.thresholds.floating_swaps);
                let exchanged = self.refits(&lacking, &trials, white);
                fitted.extend(exchanged.iter().cloned());
                let best = exchanged.into_iter().next()?;
                (best.gain_over(&set) > self.thresholds.growth_margin).then_some(best)
            });
            match better {
                Some(better) => {
                    set = better;
                    (position, end) = (first, set.added.len());
                }
                None => position += 1,
            }
        }
        set
    }
}
