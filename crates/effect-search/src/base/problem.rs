//! The problem of a diagnosis: a model as text, records, prior knowledge, and the user's candidates; options and time limits of a search.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ct_model::ModelSpec;
use ct_model::effects::OwnCandidate;
use ct_signals::Record;
use greybox::{LoopController, ModelSetup, PriorValue, TimeLimit};
use serde::{Deserialize, Serialize};

use crate::base::gaps::MendedGaps;
use crate::thresholds::Thresholds;

/// A model and the records that it is compared with.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The believed model, without effects.
    pub spec: ModelSpec,
    /// Identifiers of the effects that the model already has ([`ct_model::effects::Candidate::id`]).
    pub effects: Vec<String>,
    /// Numbers and starts of effects from an earlier record, by effect identifier.
    pub kept: BTreeMap<String, Kept>,
    /// Records that are fitted, whose inputs and outputs are those of the model, in its order and units; inputs are whole.
    pub records: Vec<Record>,
    /// Held-out records: they are not used for fits or selection.
    pub test: Vec<Record>,
    /// Handling of the gaps of the records; `None` if there were none.
    pub gaps: Option<MendedGaps>,
    /// Parameters that are not fitted, by name \[unit of the text\].
    pub known: BTreeMap<String, f64>,
    /// Prior knowledge of parameters.
    pub priors: BTreeMap<String, PriorValue>,
    /// Candidates of the user's own.
    pub candidates: BTreeMap<String, OwnCandidate>,
    /// Identifiers of effects of the catalogue that are not candidates.
    pub left_out: BTreeSet<String>,
    /// Controllers that drove the inputs of the records; references are in [`Record::references`].
    pub controllers: Vec<LoopController>,
    /// Seconds in one unit of the model's time.
    pub time_unit: f64,
    /// The unit of the model's time, as it is written: `s`, `h`.
    pub time_unit_name: String,
}

/// Numbers and starts of an effect from an earlier record.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Kept {
    /// The numbers of that record that the effect is written in ([`ct_model::effects::Candidate::record_numbers`]).
    pub numbers: BTreeMap<String, f64>,
    /// Starts of its parameters, by their names in the effect \[unit of the parameter\].
    pub start: BTreeMap<String, f64>,
    /// Of a smooth function that has a name of the user's choice: its identifier as a function, `shape(T,u)`.
    #[serde(default)]
    pub function: Option<String>,
}

/// Options of a search.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Largest number of effects to add.
    pub max_effects: usize,
    /// Starts of the fit of the believed model.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Simulate the loop of the controllers from its references; otherwise the model runs on the measured inputs.
    pub simulate_loop: bool,
    /// Time limit of the search; steps beyond it are left out.
    pub time_limit: Option<Duration>,
    /// Interruption flag: when set, the search ends soon with the best that was found so far.
    pub interrupt: Option<&'a AtomicBool>,
    /// Thresholds of the claims and of the width of the search.
    pub thresholds: Thresholds,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            max_effects: 6,
            starts: 12,
            seed: 1,
            simulate_loop: true,
            time_limit: None,
            interrupt: None,
            thresholds: Thresholds::DEFAULT,
        }
    }
}

/// Time limit and interruption of a search.
#[derive(Debug, Clone)]
pub(crate) struct Limit<'a> {
    time: Arc<TimeLimit>,
    whole: Option<Duration>,
    interrupt: Option<&'a AtomicBool>,
    /// Share of the time that had passed when the phases began.
    from: f64,
}

/// A phase of a search, which ends when a share of the whole time has passed since the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The fit of the believed model.
    Believed,
    /// The search in white noise.
    White,
    /// The search, prewhitened by a noise model.
    Coloured,
    /// The fits of the best set from other values of its thresholds.
    Minima,
    /// The acceptance test of the effects.
    Confirm,
    /// Sets of effects that do not follow time, grown once more.
    Floating,
    /// Partial explanations.
    Part,
    /// The alternatives to each effect.
    Groups,
}

impl Phase {
    fn share(self) -> f64 {
        match self {
            Self::Believed => 0.2,
            Self::White => 0.4,
            Self::Coloured => 0.6,
            Self::Minima => 0.63,
            Self::Confirm => 0.67,
            Self::Floating => 0.8,
            Self::Part => 0.9,
            Self::Groups => 1.0,
        }
    }
}

impl<'a> Limit<'a> {
    pub fn new(options: &Options<'a>) -> Self {
        Self {
            time: Arc::new(TimeLimit::new(options.time_limit)),
            whole: options.time_limit,
            interrupt: options.interrupt,
            from: 0.0,
        }
    }

    /// Begins a phase: fits continue until its share of the time has passed.
    pub fn begin(&self, phase: Phase) {
        self.time
            .allow(self.from + (1.0 - self.from) * phase.share());
    }

    /// The same limit for phases that begin again in the time that is left.
    pub fn begun_again(&self) -> Self {
        let passed = |whole: Duration| self.time.elapsed().as_secs_f64() / whole.as_secs_f64();
        Self {
            time: Arc::new(self.time.begun_again()),
            from: self.whole.map_or(0.0, passed).min(1.0),
            ..self.clone()
        }
    }

    /// Whether the time of the phase has passed.
    pub fn passed(&self) -> bool {
        self.interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.time.passed()
    }

    /// Whether a part of the search has to be left out or cut short because of the time limit; the part is then noted.
    pub fn leaves_out(&self, part: &str) -> bool {
        let out = self.passed();
        if out {
            self.time.leave_out(part);
        }
        out
    }

    /// The parts that were left out, in order.
    pub fn left_out(&self) -> Vec<String> {
        self.time.left_out()
    }

    /// A separate limit for the work after the search, independent of the time that the search took.
    pub fn afterwards(&self) -> Self {
        /// Share of the time of the search.
        const SHARE: f64 = 0.15;
        let whole = self.whole.map(|whole| whole.mul_f64(SHARE));
        Self {
            time: Arc::new(TimeLimit::new(whole)),
            whole,
            interrupt: self.interrupt,
            from: 0.0,
        }
    }

    /// The same for the final fits of the result, which are made even after an interruption.
    pub fn of_report(&self) -> Self {
        Self {
            interrupt: None,
            ..self.afterwards()
        }
    }

    /// Ends the fits of a model when the time of the phase has passed.
    pub fn on<'b>(&self, setup: ModelSetup<'b>) -> ModelSetup<'b>
    where
        'a: 'b,
    {
        setup.with_time_limit(self.time.clone(), self.interrupt)
    }

    pub fn seconds(&self) -> f64 {
        self.time.elapsed().as_secs_f64()
    }
}
