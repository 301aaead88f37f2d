//! Limits of an experiment from the user, checked against the record and the plant.

use ct_signals::{MIN_ROWS, ROWS_PER_PARAMETER, Record, shown};
use effect_search::design::Room;
use serde::Serialize;

use crate::{Problem, numbers::significant};

/// Largest distance of a range from zero, as a multiple of that of the records.
const WIDEST: f64 = 1e6;

/// The value rounded up to three digits.
fn at_least(value: f64) -> String {
    let digit = 10_f64.powf(value.abs().max(f64::MIN_POSITIVE).log10().floor() - 2.0);
    let rounded = (value / digit - 1e-9).ceil() * digit;
    format!("{}", significant(rounded, 3).parse().unwrap_or(rounded))
}

/// Limits of an experiment; `None` is derived from the records.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Smallest and largest value of the applied signal: the command, or in a loop the reference. By default the range of the records.
    pub range: Option<(f64, f64)>,
    /// Largest change of the applied signal per second; none by default.
    pub slew: Option<f64>,
    /// Length \[s\]. Without it that of the longest record.
    pub duration: Option<f64>,
    /// Seed of the sequences that are drawn.
    pub seed: u64,
}

/// An experiment that cannot be proposed. A message about an argument begins with its name: `range`, `duration`, `slew`, `between`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoExperiment {
    /// The two effects are the same.
    #[error(
        "between {effect} {effect}: an effect cannot be distinguished from itself; give two different effects"
    )]
    SameEffect {
        /// The effect.
        effect: String,
    },
    /// An effect could not be fitted.
    #[error("{effect} cannot be fitted to these records")]
    NoFit {
        /// The effect.
        effect: String,
    },
    /// A record with two inputs.
    #[error(
        "{record} has two inputs, {first} and {second}, and an experiment is designed for one command: take a record in which the second pump is off, or nothing disturbs, and delete input_2 (and disturbance), or play an experiment of your own"
    )]
    TwoCommands {
        /// The record.
        record: String,
        /// The first command's column.
        first: String,
        /// The second one's.
        second: String,
    },
    /// The range's ends are exchanged, equal or no numbers.
    #[error(
        "range {} {}: the smaller value comes first, and they have to differ",
        shown(*low),
        shown(*high)
    )]
    Range {
        /// First end.
        low: f64,
        /// Second end.
        high: f64,
    },
    /// The range is too large for the computation.
    #[error(
        "range {low:e} {high:e} goes beyond {most:.2e}, a million times what the records visited; stay within it"
    )]
    TooWide {
        /// Lower end as given.
        low: f64,
        /// As given.
        high: f64,
        /// Largest permitted absolute value of either end of the range: a million times the largest value of the records.
        most: f64,
    },
    /// The range exceeds the plant's limits.
    #[error("{}", self.worded("the model"))]
    Beyond {
        /// First end.
        low: f64,
        /// Second end.
        high: f64,
        /// Lower end of the possible range.
        from: f64,
        /// Upper end of the possible range.
        to: f64,
        /// Name of the bound: `tank_height` or `input_range`.
        what: &'static str,
    },
    /// The applied signal is constant in the records, and no range is given.
    #[error(
        "the records hold one {what} of {} alone, so its permitted range is not known; give a range",
        shown(*value)
    )]
    NoRange {
        /// The command, or the reference.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Too few samples.
    #[error(
        "duration {} s holds {samples} samples at one every {} s, and {needed} are needed to fit the parameters; give at least {} s",
        shown(*duration),
        shown(*interval),
        at_least(*needed as f64 * interval)
    )]
    Duration {
        /// The length \[s\].
        duration: f64,
        /// Samples in it.
        samples: usize,
        /// Samples that are needed.
        needed: usize,
        /// The sampling interval \[s\].
        interval: f64,
    },
    /// More samples than any reasonable experiment has.
    #[error(
        "duration {} s holds {samples} samples at one every {} s, and {most} are the most that are searched; give a shorter one",
        shown(*duration),
        shown(*interval)
    )]
    TooLong {
        /// The length \[s\].
        duration: f64,
        /// Samples in it.
        samples: usize,
        /// Largest number of samples.
        most: usize,
        /// The sampling interval \[s\].
        interval: f64,
    },
    /// Too slow to get anywhere.
    #[error("slew {} a second moves by {} in {} s, less than the {} of the range; give at least {}", shown(*slew), significant(*moves, 3), shown(*duration), significant(*span, 3), at_least(span / duration))]
    Slew {
        /// Largest change in a second.
        slew: f64,
        /// Resulting change.
        moves: f64,
        /// The length \[s\].
        duration: f64,
        /// Width of the range.
        span: f64,
    },
    /// The time limit was reached before there was a result.
    #[error(
        "the time did not suffice to fit both effects and to try experiments; allow more time, or give fewer rows or a shorter duration"
    )]
    OutOfTime,
    /// Every tried sequence would overfill a tank.
    #[error(
        "every experiment between {} and {} would lead above the tank_height of {}; give a range that stays lower",
        shown(*low),
        shown(*high),
        shown(*height)
    )]
    Overfull {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
        /// Height of the tank.
        height: f64,
    },
}

impl NoExperiment {
    /// The message, where `place` says in what the limits of the plant are given.
    #[must_use]
    pub fn worded(&self, place: &str) -> String {
        match self {
            Self::Beyond {
                low,
                high,
                from,
                to,
                what,
            } => format!(
                "range {} {} leaves {} .. {}, the {what} of {place}; stay within it",
                shown(*low),
                shown(*high),
                shown(*from),
                shown(*to)
            ),
            _ => self.to_string(),
        }
    }
}

/// Largest number of samples of an experiment: a week at one sample per second is too long for the search.
const MOST_SAMPLES: usize = 200_000;

/// The checked limits, in seconds and the units of the applied signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Smallest and largest value in the records.
    pub visited: (f64, f64),
    /// Source of the two values.
    pub range_from: &'static str,
    /// Largest change in a second, where there is a limit.
    pub slew: Option<f64>,
    /// Length \[s\].
    pub duration: f64,
    /// Sampling interval \[s\].
    pub interval: f64,
    /// Samples.
    pub samples: usize,
}

/// Range of the applied signal in the records.
fn visited(records: &[Record], looped: bool) -> (f64, f64) {
    let applied = |record: &Record| match (record.references.first(), looped) {
        (Some(reference), true) => reference.range(),
        _ => record.input_range(),
    };
    records
        .iter()
        .map(applied)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| {
            (a.0.min(b.0), a.1.max(b.1))
        })
}

/// The limits of the applied signal, and their origin.
fn possible(problem: &Problem, looped: bool) -> Option<(f64, f64, &'static str)> {
    if looped {
        let height = problem.known.tank_height?;
        return Some((0.0, height, "tank_height"));
    }
    let most = problem.known.input_range?;
    // A command that has been negative may be negative again.
    let low = visited(&problem.records, false).0.min(0.0);
    Some((low, most, "input_range"))
}

impl Bounds {
    /// Limits for sequences.
    pub(crate) fn room(&self) -> Room {
        Room {
            low: self.low,
            high: self.high,
            visited: self.visited,
            slew: self.slew,
            duration: self.duration,
            interval: self.interval,
            samples: self.samples,
        }
    }

    /// The limits for the records of a problem; `parameters` are fitted to the experiment alone.
    pub(crate) fn new(
        problem: &Problem,
        limits: &Limits,
        looped: bool,
        parameters: usize,
    ) -> Result<Self, NoExperiment> {
        let seen = visited(&problem.records, looped);
        let ((low, high), range_from) = match limits.range {
            Some(range) => (range, "as given"),
            None => (seen, "what the records visited"),
        };
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(match limits.range {
                Some((low, high)) => NoExperiment::Range { low, high },
                None => NoExperiment::NoRange {
                    what: if looped { "reference" } else { "command" },
                    value: low,
                },
            });
        }
        if let (Some((from, to, what)), Some(_)) = (possible(problem, looped), limits.range)
            && (low < from || high > to)
        {
            return Err(NoExperiment::Beyond {
                low,
                high,
                from,
                to,
                what,
            });
        }
        let largest = seen.0.abs().max(seen.1.abs());
        let most = WIDEST * if largest > 0.0 { largest } else { 1.0 };
        if low.abs().max(high.abs()) > most {
            return Err(NoExperiment::TooWide { low, high, most });
        }
        let longest = |of: fn(&Record) -> f64| problem.records.iter().map(of).fold(0.0, f64::max);
        let interval = problem
            .records
            .iter()
            .map(Record::sample_interval)
            .fold(f64::INFINITY, f64::min);
        let duration = limits
            .duration
            .unwrap_or_else(|| longest(Record::duration) + interval);
        let samples = (duration / interval + 1e-9).floor();
        let samples = if samples.is_finite() && samples > 0.0 {
            samples as usize
        } else {
            0
        };
        let needed = MIN_ROWS.max(parameters * ROWS_PER_PARAMETER);
        if samples < needed {
            return Err(NoExperiment::Duration {
                duration,
                samples,
                needed,
                interval,
            });
        }
        if samples > MOST_SAMPLES {
            return Err(NoExperiment::TooLong {
                duration,
                samples,
                most: MOST_SAMPLES,
                interval,
            });
        }
        if let Some(slew) = limits.slew {
            let moves = slew * duration;
            if slew.is_nan() || moves < high - low {
                return Err(NoExperiment::Slew {
                    slew,
                    moves,
                    duration,
                    span: high - low,
                });
            }
        }
        Ok(Self {
            low,
            high,
            visited: seen,
            range_from,
            slew: limits.slew.filter(|slew| slew.is_finite()),
            duration,
            interval,
            samples,
        })
    }

    /// A wider range that the user might allow: the largest possible one, or half as much again in each direction.
    pub(crate) fn wider(&self, problem: &Problem, looped: bool) -> Option<Self> {
        let (low, high) = match possible(problem, looped) {
            Some((from, to, _)) if !looped => (from, to),
            other => {
                let more = 0.25 * (self.high - self.low);
                let (from, to) = other.map_or((f64::NEG_INFINITY, f64::INFINITY), |p| (p.0, p.1));
                // A signal that has never been negative stays nonnegative.
                let from = if self.low >= 0.0 { from.max(0.0) } else { from };
                ((self.low - more).max(from), (self.high + more).min(to))
            }
        };
        // A range that the slew limit cannot cross is no wider range.
        let reaches = self
            .slew
            .is_none_or(|slew| slew * self.duration >= high - low);
        (high - low > 1.01 * (self.high - self.low) && reaches).then(|| Self {
            low,
            high,
            range_from: "a wider range",
            ..self.clone()
        })
    }
}
