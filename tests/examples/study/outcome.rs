//! The result of a record.

use ctid_tests::{Drive, Rig};
use missing_effect::Verdict;
use serde_json::{Value, json};

use crate::mark;

/// Result of a record.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The answer; `None` where the effect can be given the size in no plant, or the diagnosis was refused.
    pub answer: Option<Answer>,
    /// Reason for the failure.
    pub refused: Option<String>,
}

/// A diagnosis in short.
#[derive(Debug, Clone)]
pub struct Answer {
    pub plant: &'static str,
    pub drive: Drive,
    /// Hidden effects.
    pub hidden: Vec<&'static str>,
    pub verdict: Verdict,
    pub effects: Vec<String>,
    pub groups: Vec<Vec<String>>,
    /// Result of an exhaustive refit for a record whose effect is not in a group.
    pub mark: Option<mark::Mark>,
    /// For a pair that is not completely named: difference of the criterion between the result and the pair, both refitted.
    pub pair_falls: Option<f64>,
    /// Whether feedback was detected.
    pub feedback: bool,
    /// On one core.
    pub seconds: f64,
}

impl Answer {
    /// An answer with these effects and groups; without feedback.
    pub fn new(
        rig: &Rig,
        verdict: Verdict,
        (effects, groups): (Vec<String>, Vec<Vec<String>>),
        seconds: f64,
    ) -> Self {
        Self {
            plant: rig.plant.id(),
            drive: rig.drive,
            hidden: rig.missing().iter().map(|(id, ..)| *id).collect(),
            verdict,
            effects,
            groups,
            mark: None,
            pair_falls: None,
            feedback: false,
            seconds,
        }
    }

    /// Whether an effect of the catalogue is named.
    pub fn named(&self) -> bool {
        matches!(
            self.verdict,
            Verdict::Effect | Verdict::Undecided | Verdict::Partial
        )
    }

    /// Number of hidden effects in groups.
    pub fn found(&self) -> usize {
        let found = |effect: &&&str| self.named() && self.group(effect).is_some();
        self.hidden.iter().filter(found).count()
    }

    /// The group that contains an effect.
    pub fn group(&self, effect: &str) -> Option<&Vec<String>> {
        let holds = |group: &&Vec<String>| group.iter().any(|member| member == effect);
        self.groups.iter().find(holds)
    }
}

impl Outcome {
    pub fn as_json(&self) -> Value {
        self.answer.as_ref().map_or_else(
            || json!({ "refused": self.refused }),
            |answer| {
                json!({
                    "plant": answer.plant,
                    "hidden": answer.hidden,
                    "verdict": answer.verdict,
                    "effects": answer.effects,
                    "groups": answer.groups,
                    "mark": answer.mark.as_ref().map(mark::Mark::as_json),
                    "pair_falls": answer.pair_falls,
                    "feedback": answer.feedback,
                    "seconds": answer.seconds,
                })
            },
        )
    }
}
