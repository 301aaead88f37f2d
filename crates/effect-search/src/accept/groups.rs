//! Ambiguity: candidates that fit as well as an effect of the result. Each candidate replaces the effect, and everything is fitted again.

use estimation::{Fit, Noise};
use rayon::prelude::*;

use crate::Error;
use crate::accept::partial::explained;
use crate::fit::node::{Context, FINE, Node};
use crate::search::grow::best_first;

/// Step that is left out if the time limit is reached.
const OTHERS: &str = "other effects that may explain the same";

impl Context<'_> {
    /// For each added effect: the effect and all candidates that fit as well in its place, best first; and the set, in which the user's own
    /// candidate replaces an equal effect of the catalogue. `slowness`: samples per independent sample, if the weighting by `noise` is not
    /// that of the actual noise ([`Context::slowness`]).
    pub fn groups(
        &self,
        mut last: Node,
        base: &Node,
        noise: &Noise,
        slowness: f64,
    ) -> Result<(Node, Vec<Vec<usize>>), Error> {
        let mut groups = Vec::new();
        let found = last.added[base.added.len()..].to_vec();
        for own in found {
            let mut group = vec![own];
            let position = last.added.iter().position(|i| *i == own);
            if position.is_some() && self.limit.leaves_out(OTHERS) {
                // Without refits: candidates whose sensitivities are collinear fit as well, to first order.
                group.extend(self.tied_to(own, &last));
            } else if let Some(position) = position {
                let others = self.stand_ins(&last, position, noise, slowness)?;
                let is_same = |node: &&Node| {
                    let further = node.fit.parameters > last.fit.parameters;
                    let worse = node.fit.deviance - last.fit.deviance;
                    self.ends_in_own(node)
                        && !further
                        && worse / slowness < self.thresholds.same_effect
                };
                let same = others.iter().find(is_same).cloned();
                group.extend(others.iter().filter_map(|node| node.added.last()));
                if let Some(same) = same.filter(|_| self.candidates[own].effect.is_some())
                    && let Some(at) = group.iter().position(|i| Some(i) == same.added.last())
                {
                    let users = group.remove(at);
                    group.insert(0, users);
                    last = same;
                }
            }
            groups.push(group);
        }
        Ok((last, groups))
    }

    /// The sets in which an alternative replaces an effect and explains the data as well, best first.
    fn stand_ins(
        &self,
        last: &Node,
        position: usize,
        noise: &Noise,
        slowness: f64,
    ) -> Result<Vec<Node>, Error> {
        let without = self.lacking(last, position, noise)?;
        let fall = without.fit.deviance - last.fit.deviance;
        let trials = self.trials(&without, noise);
        let trials: Vec<_> = trials
            .into_iter()
            .filter(|trial| !last.added.contains(&trial.candidate))
            .filter(|trial| !self.repeats_one_of(trial.candidate, &last.added))
            .filter(|trial| {
                trial.fall
                    > self.thresholds.group_predicted_share * fall
                        - self.thresholds.group_predicted_margin
            })
            .take(self.thresholds.group_refits)
            .collect();
        let near = |node: &Node| {
            node.fit.bic() - last.fit.bic() < self.thresholds.group_near * slowness
                || self.ends_in_own(node)
        };
        let rough = self.refits(&without, &trials, noise);
        let fine = rough
            .into_par_iter()
            .filter(near)
            .filter_map(|node| self.refitted(&node, noise, FINE).ok())
            // The set that they are compared with is in its lowest minimum too.
            .map(|node| {
                let last = node.added.len() - 1;
                self.in_lowest_minimum(node, last, noise)
            });
        let mut others = best_first(fine.collect());
        let of_users = others.iter().any(|node| self.ends_in_own(node));
        let own_last = of_users.then(|| self.in_limited_noise(last)).transpose()?;
        let of_last = self.own_deviance(last);
        others.retain(|node| {
            let deviance = (self.own_deviance(node) - of_last) / slowness;
            let further = node.fit.parameters as f64 - last.fit.parameters as f64;
            let bic = deviance + further * (self.samples() / slowness).ln();
            // With as many parameters or fewer, the deviances are compared; additional parameters have to lower the criterion.
            bic < self.thresholds.same_bic
                || deviance < self.thresholds.same_deviance
                    && node.fit.parameters <= last.fit.parameters
                || self.ends_in_own(node)
                    && own_last.as_ref().is_some_and(|own_last| {
                        !(own_last.noise.order() == 0 && bic > self.thresholds.own_candidate_bic)
                            && self
                                .explains_most((node, last), &without, own_last)
                                .unwrap_or(false)
                    })
        });
        self.limit.leaves_out(OTHERS);
        Ok(others)
    }

    /// Whether the last effect of a set is a candidate of the user's own.
    fn ends_in_own(&self, node: &Node) -> bool {
        let last = node.added.last();
        last.is_some_and(|&i| self.candidates[i].effect.is_none())
    }

    /// Whether a set explains most of what another one does of what a third leaves, and leaves what may be noise of another spectrum: with
    /// a noise model of its own, what the other one gains is not beyond chance. Users propose the likely physics of their model, and a
    /// measured record usually contains more: a more flexible effect of the catalogue would win by fitting the rest.
    fn explains_most(
        &self,
        (set, last): (&Node, &Node),
        without: &Node,
        own_last: &Fit,
    ) -> Result<bool, Error> {
        let floors = own_last.noise.sigmas();
        let of_last = explained(&without.fit, &last.fit, &floors);
        if explained(&without.fit, &set.fit, &floors)
            < self.thresholds.own_candidate_share * of_last
        {
            return Ok(false);
        }
        let own = self.in_limited_noise(set)?;
        let gained = own_last.bic() - own.bic() > self.thresholds.bic_margin;
        Ok(!(gained && self.beyond_chance((last, own_last), (set, &own))))
    }
}
