//! The answer: the effects of the best set that pass the acceptance test, or a set that explains a large part of the error.

use estimation::{Fit, Noise};
use greybox::weighted_rms;

use super::searched::Searched;
use crate::Error;
use crate::accept::partial::explained;
use crate::base::problem::{Options, Phase};
use crate::fit::node::{Context, FINE, Node};
use crate::residual_tests::NotNoise;

/// A set of effects as the answer.
pub(super) struct Answer {
    pub set: Node,
    /// The set's fit with the noise model of its own residual, ...
    pub own: Fit,
    /// ... and what shows that this residual is not noise.
    pub not_noise: Option<NotNoise>,
    /// The noise model with which effects are compared.
    pub noise: Noise,
    /// Number of samples per independent sample ([`Context::slowness`]) for a partial explanation, whose noise model is white; otherwise 1.
    pub slowness: f64,
    /// The set is a subset of an accepted set.
    pub reduced: bool,
}

impl Answer {
    /// Whether the set has enough effects to imitate another effect together.
    pub fn has_many(&self, context: &Context, base: &Node) -> bool {
        self.set.added.len() >= base.added.len() + context.thresholds.many_effects
    }

    /// Whether the set may describe a slow disturbance: several functions of time, which compensate for any, beside further effects or with
    /// correlated noise, which may be the rest of the disturbance.
    pub fn is_flexible(&self, context: &Context, base: &Node) -> bool {
        let in_time = context.in_time(&self.set.added[base.added.len()..]);
        in_time > context.thresholds.functions_of_time
            && (self.has_many(context, base) || self.own.noise.order() > 0)
    }
}

impl Context<'_> {
    fn answer(&self, set: Node, noise: Noise) -> Result<Answer, Error> {
        let own = self.in_own_noise(&set)?;
        Ok(Answer {
            not_noise: self.not_noise(&set, &own)?,
            set,
            own,
            noise,
            slowness: 1.0,
            reduced: false,
        })
    }

    /// The answer of the searches, by all tests.
    pub(super) fn answered(
        &self,
        base: &Node,
        searched: &mut Searched,
        options: &Options,
    ) -> Result<Answer, Error> {
        let mut answer = self.accepted(searched)?;
        if answer.not_noise.is_some()
            || answer.has_many(self, base)
            || answer.is_flexible(self, base)
        {
            answer = self.reconsidered(answer, searched, options.max_effects)?;
        }
        self.or_level_shift(answer, searched)
    }

    /// The effects of the best set that pass the acceptance test.
    fn accepted(&self, searched: &Searched) -> Result<Answer, Error> {
        let (grown, noise) = (&searched.grown, &searched.noise);
        let effects = grown.base.added.len();
        self.limit.begin(Phase::Minima);
        let best = self.in_lowest_minimum(grown.best.clone(), effects, noise);
        self.limit.begin(Phase::Confirm);
        let mut set = self.confirm(best.clone(), &grown.base, noise)?;
        if grown.cut_short && set.added.len() == effects {
            // After a search that was cut short, the noise model also describes effects that were not tried; the test below decides without
            // it.
            set = best;
        }
        if set.added.len() > effects && !self.better_with_own_noise_model(&set, &grown.base)? {
            set = grown.base.clone();
        }
        self.answer(set, noise.clone())
    }

    /// Whether a set is better than the model without it when each has the noise model of its own residual: what autocorrelated noise
    /// explains needs no effect.
    fn better_with_own_noise_model(&self, set: &Node, base: &Node) -> Result<bool, Error> {
        let own = self.in_own_noise(set)?;
        let bare = self.in_own_noise(base)?;
        let floors = own.noise.sigmas();
        let error =
            |node: &Node| weighted_rms(&node.fit.rmse, &floors, &node.fit.samples_per_output);
        // The simulation error must decrease too: in a prewhitened fit, a single reading can be a reason to add an effect.
        Ok(bare.bic() - own.bic() > self.thresholds.bic_margin
            && self.beyond_chance((set, &own), (base, &bare))
            && error(set) < error(base)
            && !self.is_fed_back_noise(set, base))
    }

    /// The answer after a floating search without functions of time: a better set, a set that explains a large part of the error, or the same.
    fn reconsidered(
        &self,
        answer: Answer,
        searched: &mut Searched,
        max_effects: usize,
    ) -> Result<Answer, Error> {
        let base = searched.singles_by_error.1.clone();
        let flexible = answer.is_flexible(self, &base);
        self.limit.begin(Phase::Floating);
        let mut sets = searched.by_error.clone();
        sets.extend(searched.grown.fitted.iter().cloned());
        sets.extend([searched.grown.best.clone(), answer.set.clone()]);
        let timeless = self.floating(&base, &sets, max_effects);
        self.limit.begin(Phase::Part);
        if answer.not_noise.is_none()
            && let Some(better) = self.better_in_own_noise(timeless.clone(), &answer.own)
        {
            return self.of_floating_search(better, searched);
        }
        if answer.not_noise.is_none() && !flexible {
            return Ok(answer);
        }
        // The noise model describes unmodelled physics as noise, and if that physics is slow, simulations of prewhitened fits drift.
        // The sets are therefore compared by their simulation error.
        sets.extend(timeless);
        let part = self.largest_part((&base, &answer.set), &sets)?;
        let part = part.and_then(|part| self.without_small_effects(part, &base));
        let part = part.filter(|part| flexible || !self.contains_part(&answer, part, &base));
        if let Some(part) = part {
            let (singles, base) = searched.singles_by_error.clone();
            let grown = &mut searched.grown;
            (grown.singles, grown.base, grown.of_singles) = (singles, base.clone(), base.clone());
            let noise = Noise::white(part.spec().outputs.len());
            let part = self.in_lowest_minimum(part, base.added.len(), &noise);
            let part = self.answer(part, noise)?;
            return Ok(Answer {
                slowness: self.slowness(&part.own.noise),
                reduced: answer.not_noise.is_none(),
                ..part
            });
        }
        if flexible && !self.limit.passed() {
            let bare = self.answer(searched.grown.base.clone(), answer.noise.clone())?;
            if bare.not_noise.is_some() {
                return Ok(bare);
            }
        }
        Ok(answer)
    }

    /// Whether an answer that explains enough contains a partial explanation, and further effects that passed the acceptance test. These are no
    /// functions of time, which compensate for any slow disturbance, and the answer's noise model is not one that may describe slow
    /// physics.
    fn contains_part(&self, answer: &Answer, part: &Node, base: &Node) -> bool {
        let is_part = part.added.iter().all(|i| answer.set.added.contains(i));
        let further = answer.set.added.iter().copied();
        let further: Vec<usize> = further.filter(|i| !part.added.contains(i)).collect();
        let floors = answer.own.noise.sigmas();
        is_part
            && !further.is_empty()
            && self.in_time(&further) == 0
            && !self.is_slow(&answer.own.noise)
            && explained(&base.fit, &answer.set.fit, &floors) >= self.thresholds.partial_share
    }

    /// A set of the floating search as the answer, after the acceptance test. `better`: with the noise model of its own residual.
    fn of_floating_search(&self, better: Node, searched: &mut Searched) -> Result<Answer, Error> {
        let grown = &mut searched.grown;
        // So many effects may imitate other effects, and the noise model may describe the rest of the error.
        let noise = better.fit.noise.clone();
        if let Ok(bare) = self.refitted(&grown.base, &noise, FINE) {
            grown.base = bare;
        }
        let refitted = self.refitted(&better, &noise, FINE);
        let set = refitted.unwrap_or_else(|_| better.clone());
        let size = set.added.len();
        let set = self.confirm(set, &grown.base, &noise)?;
        if set.added.len() < size {
            return self.answer(set, noise);
        }
        // The deviance of a fit with its own noise model is lower than that of a fit with the same model given.
        Ok(Answer {
            not_noise: self.not_noise(&set, &better.fit)?,
            own: better.fit,
            set,
            noise,
            slowness: 1.0,
            reduced: false,
        })
    }

    /// The model without effects, if a level shift of a reading explains more than those of the answer, or an abrupt change that they leave.
    fn or_level_shift(&self, answer: Answer, searched: &Searched) -> Result<Answer, Error> {
        let base = &searched.grown.base;
        let some = answer.set.added.len() > base.added.len();
        if !some && !matches!(answer.not_noise, Some(NotNoise::Instant { .. })) {
            return Ok(answer);
        }
        let margin = if some {
            0.0
        } else {
            self.thresholds.bic_margin
        };
        let shift = self.level_shift(base, &answer.noise)?;
        let Some(shift) = shift.filter(|shift| shift.bic < answer.set.fit.bic() - margin) else {
            return Ok(answer);
        };
        Ok(Answer {
            not_noise: Some(shift.found),
            own: self.in_own_noise(base)?,
            set: base.clone(),
            ..answer
        })
    }
}
