//! The program on inputs drawn at random: well formed ones with everything that a file may hold, and the same damaged.
//!
//! Each case is one run of the program as a process of its own, or a page with some requests, and is drawn from its kind and
//! number alone. [`run`] says what it must not do.
//!
//! | what | where |
//! |---|---|
//! | numbers, names and damage | `source` |
//! | records | `records` |
//! | model files | `models` |
//! | models of one's own, as text | `texts` |
//! | rows for the monitor, and its saved states | `streams`, `states` |
//! | requests to the page | `requests` |
//! | the process, and the checks | `process` |

mod models;
mod process;
mod records;
mod requests;
mod source;
mod states;
mod streams;
mod texts;

use std::fmt::{Display, Formatter};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

pub use process::as_program;
use source::Source;

/// Kind of a random test case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A record, for `compare`, `diagnose`, `identify` and `design`.
    Record,
    /// A model file, for the same commands, and to be edited.
    Model,
    /// A model of one's own as text, for commands that read one.
    Text,
    /// Rows that come to `monitor`.
    Stream,
    /// A saved state of `monitor`.
    State,
    /// A page, and requests to it.
    Request,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::Record,
        Self::Model,
        Self::Text,
        Self::Stream,
        Self::State,
        Self::Request,
    ];
}

impl Display for Kind {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Record => "record",
            Self::Model => "model",
            Self::Text => "text",
            Self::Stream => "stream",
            Self::State => "state",
            Self::Request => "request",
        })
    }
}

impl FromStr for Kind {
    type Err = String;
    fn from_str(word: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.to_string() == word);
        found.ok_or_else(|| format!("no such kind: {word}"))
    }
}

/// Results of the cases of a kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The kind.
    pub kind: Kind,
    /// Cases that were run.
    pub cases: u64,
    /// Number of cases that ended with a result; the others were rejected.
    pub accepted: u64,
    /// The longest processor time of a case \[s\].
    pub longest: f64,
    /// The largest memory of a process \[MB\].
    pub largest: f64,
    /// Messages of the rejected cases, with the case's number.
    pub refusals: Vec<(u64, String)>,
    /// Faults, with the case's number.
    pub faults: Vec<(u64, String)>,
}

/// End of a case.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ended {
    pub accepted: bool,
    /// Processor time \[s\].
    pub seconds: f64,
    /// Largest memory \[MB\].
    pub megabytes: f64,
    /// Message of a rejection.
    pub refusal: String,
    pub fault: Option<String>,
}

impl Ended {
    /// For a case without a separate process.
    fn without_process(accepted: bool, refusal: String, fault: Option<String>) -> Self {
        Self {
            accepted,
            seconds: 0.0,
            megabytes: 0.0,
            refusal,
            fault,
        }
    }
}

/// Runs the cases `first..first + cases` of a kind on all cores, and calls `progress` with how many are done.
///
/// A fault is: a panic, an abort, a signal, an exit code other than 0 and 2, above 20 s of processor time, above 500 MB of memory,
/// a result with NaN, an error that is not one line, is longer than 300 characters or has control or direction characters in it,
/// an input that is changed or an output that is there after a refusal; of the page also a status of 500 and above, and another
/// request that is not answered within 2 s.
///
/// The executable calls [`as_program`] first.
pub fn run(kind: Kind, first: u64, cases: u64, progress: impl Fn(u64) + Sync) -> Report {
    let (next, done, stop) = (
        AtomicU64::new(first),
        AtomicU64::new(0),
        AtomicBool::new(false),
    );
    let case = match kind {
        Kind::Record => records::case,
        Kind::Model => models::case,
        Kind::Text => texts::case,
        Kind::Stream => streams::case,
        Kind::State => states::case,
        Kind::Request => requests::case,
    };
    let end = first + cases;
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let mut all: Vec<(u64, Ended)> = thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                progress(done.load(Ordering::Relaxed));
                thread::sleep(Duration::from_millis(100));
            }
        });
        let work = || {
            let mut ended = Vec::new();
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= end {
                    break ended;
                }
                ended.push((number, case(&mut Source::new(number))));
                done.fetch_add(1, Ordering::Relaxed);
            }
        };
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let joined = threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap_or_default())
            .collect();
        stop.store(true, Ordering::Relaxed);
        joined
    });
    all.sort_by_key(|(number, _)| *number);
    Report {
        kind,
        cases: all.len() as u64,
        accepted: all.iter().filter(|(_, case)| case.accepted).count() as u64,
        longest: all.iter().map(|(_, case)| case.seconds).fold(0.0, f64::max),
        largest: all
            .iter()
            .map(|(_, case)| case.megabytes)
            .fold(0.0, f64::max),
        refusals: all
            .iter()
            .filter(|(_, case)| !case.accepted)
            .map(|(number, case)| (*number, case.refusal.clone()))
            .collect(),
        faults: all
            .into_iter()
            .filter_map(|(number, case)| Some((number, case.fault?)))
            .collect(),
    }
}
