//! Which candidates cannot be told from an effect of the answer: each is put in its place, and everything is fitted again.

use estimation::Noise;

use crate::Error;
use crate::node::{Context, FINE, Node};
use crate::search::best_first;

/// A candidate can stand in where the deviance is within this of the best: the 99 % quantile of chi-square with two degrees of freedom ...
pub(crate) const SAME_DEVIANCE: f64 = 9.21;
/// ... or the criterion within this.
pub(crate) const SAME_BIC: f64 = 6.0;
/// So many stand-ins are fitted, those with the best scores.
const REFITS: usize = 20;
/// Those whose first fit is within this are fitted to the end.
const NEAR: f64 = 60.0;

/// A stand-in is fitted where the fall of the deviance that one step predicts is at least this share of the effect's own, less this margin.
const PREDICTED_SHARE: f64 = 0.3;
const PREDICTED_MARGIN: f64 = 10.0;

impl Context<'_> {
    /// For each effect that the search added itself, then all that can stand in for it, best first. `slowness`: samples over independent
    /// ones, where the metric of `noise` is not that of the noise ([`Context::slowness`]).
    pub fn groups(
        &self,
        last: &Node,
        base: &Node,
        noise: &Noise,
        slowness: f64,
    ) -> Result<Vec<Vec<usize>>, Error> {
        let mut groups = Vec::new();
        for position in base.added.len()..last.added.len() {
            let own = last.added[position];
            let mut group = vec![own];
            if !self.limit.passed(0.95) {
                let without = self.without(last, position, noise, FINE)?;
                let fall = without.fit.deviance - last.fit.deviance;
                let trials = self.trials(&without, noise);
                let trials: Vec<_> = trials
                    .into_iter()
                    .filter(|trial| !last.added.contains(&trial.candidate))
                    .filter(|trial| !self.repeats_one_of(trial.candidate, &last.added))
                    .filter(|trial| trial.fall > PREDICTED_SHARE * fall - PREDICTED_MARGIN)
                    .take(REFITS)
                    .collect();
                let near = |node: &Node| node.fit.bic() - last.fit.bic() < NEAR * slowness;
                let rough = self.refits(&without, &trials, noise);
                let fine = rough
                    .into_iter()
                    .filter(near)
                    .filter_map(|node| self.refitted(&node, noise, FINE).ok());
                for node in best_first(fine.collect()) {
                    let deviance = (node.fit.deviance - last.fit.deviance) / slowness;
                    let further = node.fit.parameters as f64 - last.fit.parameters as f64;
                    let bic = deviance + further * (self.samples() / slowness).ln();
                    // As many parameters or fewer: the deviance decides; more have to pay for themselves.
                    let same = bic < SAME_BIC
                        || deviance < SAME_DEVIANCE && node.fit.parameters <= last.fit.parameters;
                    if same && let Some(&other) = node.added.last() {
                        group.push(other);
                    }
                }
            }
            groups.push(group);
        }
        Ok(groups)
    }
}
