//! The verdict: whether the answer is a whole explanation, a partial one or none.

use estimation::Fit;

use super::answer::Answer;
use crate::Error;
use crate::accept::partial::explained;
use crate::fit::node::{Context, Node};
use crate::residual_tests::NotNoise;
use crate::result::diagnosis::Verdict;
use crate::search::grow::Grown;

/// An answer with its verdict.
pub(super) struct Graded {
    pub set: Node,
    /// The set's fit with the noise model of its own residual.
    pub own: Fit,
    pub verdict: Verdict,
    /// For each effect the candidates that explain as much, best first.
    pub groups: Vec<Vec<usize>>,
    pub not_noise: Option<NotNoise>,
    /// The share of the error above the noise that the effects explain.
    pub share: Option<f64>,
    /// The residual looks like correlated noise, and is large beside what the effects explain: it may be unmodelled physics.
    pub rest_is_correlated: bool,
}

impl Context<'_> {
    /// The verdict of an answer, and the groups of its effects.
    pub(super) fn graded(
        &self,
        answer: Answer,
        base: &Node,
        grown: &Grown,
    ) -> Result<Graded, Error> {
        let found = answer.set.added.len() > grown.base.added.len();
        // After a search that was cut short, the noise model describes what was not tried; the effects are then at most a part of the answer.
        let open = grown.cut_short && answer.own.noise.order() > 0;
        let above = |floors: &[f64]| explained(&base.fit, &answer.set.fit, floors);
        let above_innovations = above(&answer.own.noise.sigmas());
        // Unmodelled physics that its own past predicts cannot be distinguished from correlated noise.
        let rest_is_correlated = found
            && !open
            && answer.not_noise.is_none()
            && above_innovations < self.thresholds.whole_share;
        let part = open || rest_is_correlated || answer.reduced || answer.has_many(self, base);
        // The noise level: the standard deviation of the residual of a whole explanation, otherwise that of its innovations.
        let share = found.then(|| {
            if part || answer.not_noise.is_some() {
                above_innovations
            } else {
                above(&self.noise_levels(&answer.own))
            }
        });
        let least = self.thresholds.partial_share;
        let mut verdict = match (share, &answer.not_noise) {
            (None, None) => Verdict::Adequate,
            (None, Some(_)) => Verdict::Unexplained,
            (Some(_), None) if part => Verdict::Partial,
            (Some(_), None) => Verdict::Effect,
            (Some(share), Some(_)) if share >= least => Verdict::Partial,
            (Some(_), Some(_)) => Verdict::Unexplained,
        };
        let set = match verdict {
            Verdict::Unexplained => grown.base.clone(),
            _ => answer.set,
        };
        let (set, groups) = self.groups(set, &grown.base, &answer.noise, answer.slowness)?;
        if verdict == Verdict::Effect && groups.iter().any(|group| group.len() > 1) {
            verdict = Verdict::Undecided;
        }
        Ok(Graded {
            set,
            own: answer.own,
            verdict,
            groups,
            not_noise: answer.not_noise,
            share,
            rest_is_correlated,
        })
    }

    /// Adds the rounding that the readings show to an answer, without an acceptance test; gives the added effects.
    pub(super) fn add_rounding(
        &self,
        graded: &mut Graded,
        base: &Node,
        max_effects: usize,
    ) -> Vec<usize> {
        if matches!(graded.verdict, Verdict::Partial | Verdict::Unexplained)
            && !graded.rest_is_correlated
        {
            return Vec::new();
        }
        let before = graded.set.added.len();
        let most = (base.added.len() + max_effects).saturating_sub(before);
        let (set, own) = self.with_rounding(graded.set.clone(), graded.own.clone(), most);
        (graded.set, graded.own) = (set, own);
        let rounded = graded.set.added[before..].to_vec();
        graded
            .groups
            .extend(rounded.iter().map(|&effect| vec![effect]));
        if graded.verdict == Verdict::Adequate && !rounded.is_empty() {
            graded.verdict = Verdict::Effect;
        }
        rounded
    }
}
