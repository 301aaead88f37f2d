//! The searches: with white noise, and with the noise model of the best set's residual.

use estimation::Noise;

use crate::Error;
use crate::base::problem::Phase;
use crate::fit::node::{Context, FINE, Node};
use crate::search::grow::Grown;

/// What the searches found.
pub(super) struct Searched {
    /// The search with the noise model of [`Self::noise`].
    pub grown: Grown,
    pub noise: Noise,
    /// All sets that were fitted with white noise.
    pub by_error: Vec<Node>,
    /// Single effects with white noise, best first, and the set that they were added to.
    pub singles_by_error: (Vec<Node>, Node),
}

impl Context<'_> {
    /// The searches in the simulated loop of the records. If the best set has a hard nonlinearity, all is searched on the measured inputs:
    /// in the loop the set would be biased ([`crate::NotSimulated::HardNonlinearity`]), and further effects would make up for that.
    pub(super) fn searched(
        self,
        base: Node,
        max_effects: usize,
    ) -> Result<(Self, Node, Searched), Error> {
        let searched = self.searched_once(&base, max_effects)?;
        match self.hard_nonlinearity(&searched.grown.best)? {
            Some(why) => {
                let (context, base) = self.not_simulated(&base, why)?;
                context.searched(base, max_effects)
            }
            None => Ok((self, base, searched)),
        }
    }

    /// The search with white noise, and the one with the noise model of the residual.
    fn searched_once(&self, base: &Node, max_effects: usize) -> Result<Searched, Error> {
        self.limit.begin(Phase::White);
        let white = Noise::white(self.problem.spec.outputs.len());
        let all: Vec<usize> = (0..self.candidates.len()).collect();
        let most = max_effects.min(self.thresholds.beam_effects);
        let few = most.min(self.thresholds.effects_before_noise);
        let mut grown = self.grow(base.clone(), (&all, &[]), &white, few)?;
        let (mut noise, slow) = self.noise_of(&grown.best)?;
        let full = grown.best.added.len() >= base.added.len() + few;
        if noise.order() == 0 && full && few < most {
            grown = self.grow_on(grown, &white, most)?;
            (noise, _) = self.noise_of(&grown.best)?;
        }
        let mut by_error = grown.fitted.clone();
        by_error.push(grown.best.clone());
        if slow {
            let timeless = self.timeless();
            let more = self.grow(base.clone(), (&timeless, &grown.singles), &white, few)?;
            by_error.extend(more.fitted);
            by_error.push(more.best);
        }
        let singles_by_error = (grown.singles.clone(), grown.base.clone());
        let (grown, noise) = self.with_noise_model(grown, noise, most)?;
        Ok(Searched {
            grown,
            noise,
            by_error,
            singles_by_error,
        })
    }

    /// The search with prewhitened fits, if the noise model is not white.
    fn with_noise_model(
        &self,
        by_error: Grown,
        noise: Noise,
        most: usize,
    ) -> Result<(Grown, Noise), Error> {
        if noise.order() == 0 {
            return Ok((by_error, noise));
        }
        let late = by_error.cut_short || self.limit.passed();
        self.limit.begin(Phase::Coloured);
        let Ok(begin) = self.refitted(&by_error.base, &noise, FINE) else {
            return Ok((by_error, Noise::white(noise.outputs())));
        };
        if late {
            // Sets are compared with one noise model, even if no time is left.
            let mut grown = by_error;
            let Ok(best) = self.refitted(&grown.best, &noise, FINE) else {
                return Ok((grown, Noise::white(noise.outputs())));
            };
            (grown.base, grown.best) = (begin, best);
            grown.cut_short = true;
            return Ok((grown, noise));
        }
        let all: Vec<usize> = (0..self.candidates.len()).collect();
        let mut grown = self.grow(begin, (&all, &by_error.singles), &noise, most)?;
        // The best set of the search with white noise may also be better with this noise model.
        if let Ok(other) = self.refitted(&by_error.best, &noise, FINE)
            && other.fit.bic() < grown.best.fit.bic()
        {
            grown.best = other;
        }
        let (own, _) = self.noise_of(&grown.best)?;
        if own.order() > 0
            && own.difference(&noise) > self.thresholds.same_noise
            && !self.limit.passed()
        {
            let base = self.refitted(&grown.base, &own, FINE);
            let best = self.refitted(&grown.best, &own, FINE);
            if let (Ok(base), Ok(best)) = (base, best) {
                (grown.base, grown.best) = (base, best);
                return Ok((grown, own));
            }
        }
        Ok((grown, noise))
    }
}
