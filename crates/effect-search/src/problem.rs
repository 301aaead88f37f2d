//! What is diagnosed: a model as text, records, what is known, and candidates.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ct_model::ModelSpec;
use ct_model::effects::OwnCandidate;
use ct_signals::Record;
use greybox::PriorValue;

/// A model and the records that it is held against.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The model that its user believes, without effects.
    pub spec: ModelSpec,
    /// Effects that the model has already, as [`ct_model::effects::Candidate::id`] has them.
    pub effects: Vec<String>,
    /// What is kept of effects from an earlier record, by their identifiers.
    pub kept: BTreeMap<String, Kept>,
    /// Records that are fitted, whose inputs and outputs are those of the model, in its order and units; inputs are whole.
    pub records: Vec<Record>,
    /// Records that take part in no fit and no choice.
    pub test: Vec<Record>,
    /// Parameters that are not fitted, by name \[unit of the text\].
    pub known: BTreeMap<String, f64>,
    /// What is known of parameters beside the records.
    pub priors: BTreeMap<String, PriorValue>,
    /// Candidates of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
    /// Seconds in one unit of the model's time.
    pub time_unit: f64,
    /// The unit of the model's time, as it is written: `s`, `h`.
    pub time_unit_name: String,
}

/// What is kept of an effect from an earlier record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Kept {
    /// The numbers of that record that the effect is written in ([`ct_model::effects::Candidate::record_numbers`]).
    pub numbers: BTreeMap<String, f64>,
    /// Where fits of its parameters begin, by their names in the effect \[unit of the parameter\].
    pub start: BTreeMap<String, f64>,
}

/// How to search.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Largest number of effects to add.
    pub max_effects: usize,
    /// Starts of the fit of the believed model.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Limit on the time of the search; what it does not allow is left out.
    pub time_limit: Option<Duration>,
    /// Interruption flag: when set, the search ends soon with the best that was found so far.
    pub interrupt: Option<&'a AtomicBool>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            max_effects: 4,
            starts: 12,
            seed: 1,
            time_limit: None,
            interrupt: None,
        }
    }
}

/// When a search has to end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limit<'a> {
    begun: Instant,
    limit: Option<Duration>,
    interrupt: Option<&'a AtomicBool>,
}

impl<'a> Limit<'a> {
    pub fn new(options: &Options<'a>) -> Self {
        Self {
            begun: Instant::now(),
            limit: options.time_limit,
            interrupt: options.interrupt,
        }
    }

    /// Whether this share of the time has passed.
    pub fn passed(&self, share: f64) -> bool {
        self.interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self
                .limit
                .is_some_and(|limit| self.begun.elapsed() > limit.mul_f64(share))
    }

    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}
