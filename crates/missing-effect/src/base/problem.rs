//! The problem of a diagnosis and its options.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use ct_signals::Record;
use greybox::PriorValue;
use plants::{Known, Placed, Plant, Term, controller::Controller};

/// The problem of a diagnosis.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The believed plant.
    pub plant: Plant,
    /// Known constants of the plant.
    pub known: Known,
    /// The effects in the model.
    pub effects: Vec<Placed>,
    /// Terms of the user's own in the model; a fit changes their scale.
    pub terms: Vec<Term>,
    /// First guesses, by name: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names in `start` that are not fitted.
    pub fixed: Vec<String>,
    /// Priors of parameters, by the same names.
    pub priors: BTreeMap<String, PriorValue>,
    /// The records that are fitted together.
    pub records: Vec<Record>,
    /// The controller of the loop, if there is one: it must stabilise the fitted plant.
    pub controller: Option<Controller>,
    /// Held-out records, which are scored but not used for fits or selection.
    pub test: Vec<Record>,
}

/// Options of the search.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// Largest number of effects to add.
    pub max_effects: usize,
    /// Random starts of the base fit, at least ten; more are used until the best minimum is found twice.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// If a controller is known and the records contain its reference: the loop is simulated; otherwise the model runs on the measured
    /// command.
    pub simulate_loop: bool,
    /// Cancellation flag: when set, the computation ends soon with [`greybox::Error::Stopped`].
    pub stop: Option<&'a AtomicBool>,
    /// Time limit of the search: steps beyond it are left out, and [`crate::Effort`] lists them. `None`: no limit. A result depends on the
    /// speed of the computer only if the limit is reached.
    pub time_limit: Option<Duration>,
    /// Interruption flag: when set, the search ends soon with the best result so far.
    pub interrupt: Option<&'a AtomicBool>,
}

/// Time limit of the interactive program. [`Options::default`] has none, so that results do not depend on the computer.
pub const TIME_LIMIT: Duration = Duration::from_secs(40);

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            max_effects: 6,
            starts: 12,
            seed: 1,
            simulate_loop: true,
            stop: None,
            time_limit: None,
            interrupt: None,
        }
    }
}

/// Progress of the computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Name of the current phase.
    pub phase: &'static str,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}
