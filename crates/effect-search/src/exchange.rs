//! Exchange of single effects of a set for others: a set that grew one effect at a time keeps its first ones, though others explain the
//! records better together with those that came later.
//!
//! **Reference**: A. J. Miller, Subset Selection in Regression, 2nd ed., 2002, section 3.4 (replacing one variable at a time).

use estimation::Noise;

use crate::node::{Context, Node, ROUGH};
use crate::score::Trial;
use crate::search::{Grown, best_first};

/// So many candidates are fitted in the place of an effect, those with the best scores.
const REFITS: usize = 6;
/// The criterion has to fall by this, or the set stays as it is.
const PAYS: f64 = 2.0;
/// Exchanges of one set at most.
const ROUNDS: usize = 6;
/// What is left out where the time has passed.
const EXCHANGE: &str = "other effects in the place of single ones";

impl Context<'_> {
    /// The set with single effects replaced, and others added, as long as that lowers the criterion.
    pub fn exchanged(&self, mut set: Node, grown: &Grown, noise: &Noise, most: usize) -> Node {
        let first = grown.base.added.len();
        for _ in 0..ROUNDS {
            if set.added.len() < first + 2 || self.limit.leaves_out(EXCHANGE) {
                break;
            }
            let mut better: Vec<Node> = (first..set.added.len())
                .filter_map(|position| {
                    let lacking = self.without(&set, position, noise, ROUGH).ok()?;
                    self.best_beside(&lacking, grown, noise)
                })
                .collect();
            if set.added.len() < first + most {
                better.extend(self.best_beside(&set, grown, noise));
            }
            match best_first(better).into_iter().next() {
                Some(best) if best.gain_over(&set) > PAYS => set = best,
                _ => break,
            }
        }
        set
    }

    /// A part of a set with the candidate beside it that lowers the criterion most: also the one that it lacks, where that acts at another
    /// place.
    fn best_beside(&self, part: &Node, grown: &Grown, noise: &Noise) -> Option<Node> {
        let trials = self.trials_among(part, grown.among(), noise);
        let promising: Vec<Trial> = trials
            .into_iter()
            .filter(|trial| self.may_lower_the_criterion(trial))
            .take(REFITS)
            .collect();
        self.refits(part, &promising, noise).into_iter().next()
    }
}
