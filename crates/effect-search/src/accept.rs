//! The acceptance test: which effects of a set stay when the noise may explain what they explain.

use ct_signals::Record;
use estimation::{Fit, Noise, coloured};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::Error;
use crate::node::{Context, FINE, Node};

/// Largest order of the noise model.
pub(crate) const NOISE_ORDER: usize = 6;
/// An effect is accepted where the criterion falls by more than this ...
pub(crate) const BIC_MARGIN: f64 = 6.0;
/// ... and where chance would let so large a fall happen less often than this, counted over all candidates and their starts.
pub(crate) const FALSE_CLAIM: f64 = 0.003;

impl Context<'_> {
    /// Whether a set lowers the deviance by more than chance would against one that lacks some of its effects: chi-square, corrected
    /// (Bonferroni) for all candidates and starts that were looked at.
    pub fn beyond_chance(&self, gained: (&Node, &Fit), lacking: (&Node, &Fit)) -> bool {
        let new = gained
            .0
            .added
            .iter()
            .filter(|i| !lacking.0.added.contains(i));
        let mut freedom = 0;
        let mut looks = 1.0;
        for &i in new {
            let candidate = &self.candidates[i];
            freedom += candidate.fitted().max(1);
            looks *= self.candidates.len() as f64 * (candidate.starts().len() as f64).max(1.0);
        }
        let freedom = freedom.max(gained.1.parameters.saturating_sub(lacking.1.parameters));
        let fall = lacking.1.deviance - gained.1.deviance;
        let chance =
            ChiSquared::new(freedom.max(1) as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
        chance * looks < FALSE_CLAIM
    }

    /// Takes out, one by one, what the noise explains as well, first what is worth least.
    pub fn confirm(&self, mut node: Node, base: &Node, noise: &Noise) -> Result<Node, Error> {
        loop {
            let lacking = self.each_lacking(&node, base, noise);
            let doubtful = lacking.into_iter().filter(|lacking| {
                node.gain_over(lacking) <= BIC_MARGIN
                    || !self.beyond_chance((&node, &node.fit), (lacking, &lacking.fit))
            });
            let Some(least) = doubtful.min_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic())) else {
                return Ok(node);
            };
            node = least;
        }
    }

    /// The set without each of the effects that the search added.
    pub fn each_lacking(&self, node: &Node, base: &Node, noise: &Noise) -> Vec<Node> {
        (base.added.len()..node.added.len())
            .into_par_iter()
            .filter_map(|position| self.without(node, position, noise, FINE).ok())
            .collect()
    }

    /// The fit of a set with the noise model of its own residual.
    pub fn in_own_noise(&self, node: &Node) -> Result<Fit, Error> {
        let setup = self.setup(&node.model)?;
        Ok(coloured(&setup, node.fit.clone(), NOISE_ORDER, FINE)?)
    }

    /// The noise model of a set's residual, with a memory of at most a part of the longest record: a root near one takes every slow effect
    /// for noise. And whether the memory had to be limited: then what remains may be slow physics.
    pub fn noise_of(&self, node: &Node) -> Result<(Noise, bool), Error> {
        let setup = self.setup(&node.model)?;
        let noise = estimation::noise_of(&setup, &node.fit, NOISE_ORDER)?;
        let slow = self.slow_output(&noise).is_some();
        Ok((noise.with_memory_at_most(self.longest_memory()), slow))
    }

    /// The first output whose noise has a longer memory than noise that a search may trust.
    pub fn slow_output(&self, noise: &Noise) -> Option<usize> {
        /// Noise of an ordinary colour forgets within so many samples, however short the record is.
        const ORDINARY_MEMORY: f64 = 12.0;
        /// Records that hold fewer times this memory do not tell slow physics from noise.
        const TIMES: f64 = 10.0;
        if self.longest_record() < TIMES * ORDINARY_MEMORY {
            return None;
        }
        let longest = self.longest_memory().max(ORDINARY_MEMORY);
        let limited = noise.with_memory_at_most(longest);
        let mut pairs = noise.iter().zip(limited.iter());
        pairs.position(|(noise, limited)| noise != limited)
    }

    /// Whether the memory of a noise model is longer than that of noise that a search may trust.
    pub fn is_slow(&self, noise: &Noise) -> bool {
        self.slow_output(noise).is_some()
    }

    /// The longest memory of a noise model in whose metric effects are searched \[samples\].
    pub fn longest_memory(&self) -> f64 {
        /// Noise whose memory is longer has left fewer than some ten independent samples.
        const LONGEST_MEMORY: f64 = 1.0 / 15.0;
        LONGEST_MEMORY * self.longest_record()
    }

    /// Rows of the longest record.
    fn longest_record(&self) -> f64 {
        let lengths = self.problem.records.iter().map(Record::len);
        lengths.max().unwrap_or(1) as f64
    }
}
