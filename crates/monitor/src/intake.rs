//! Rows as they come: what is refused, where samples are missing, and the means of blocks of rows.
//!
//! The usual step of the time is the median of the first 21. A step of more than one and a half times the longest of them is
//! a gap: a short one is bridged by the held command, a longer one begins a new stretch. Where 20 steps in a
//! row are of another length, the sampling interval has changed. A time that goes back is refused; where 100 rows in a row do, in order
//! among themselves, the clock was set back, or ran ahead for a row, and a new stretch begins.
//!
//! A process that is sampled much faster than it moves is watched in blocks: time, command and reading are their means over
//! `every` rows, and the command runs in a straight line from one mean to the next.
//!
//! A row may lack its reading. In a block such a row is taken on the straight line between the readings beside it; a block whose last
//! row lacks its reading, or more than half of its rows, has none.

use serde::{Deserialize, Serialize};

use crate::{Notice, Refused, Row};

/// Steps from which the usual one is taken.
const STEPS: usize = 21;
/// A step above this many of the longest usual ones is a gap.
const GAP: f64 = 1.5;
/// Steps of another length in a row that make it the usual one.
const OTHER: usize = 20;
/// Rows in a row whose time goes back, after which it is the clock that did: more than a logger sends again when its line was down.
const BACK: usize = 100;
/// A gap of more than so many usual steps begins a new stretch.
const BRIDGED: f64 = 5.0;
/// Values beyond this cannot be raised to the powers that a fit takes.
const LARGEST: f64 = 1e15;
/// Rows that a monitor counts; at a million rows a second it comes to so many after 285 years.
const MOST_ROWS: u64 = 1 << 53;
/// Rows in a block.
pub(crate) const LONGEST_BLOCK: usize = 1 << 24;

/// A row, or the mean of a block of rows, as it is watched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sample {
    /// \[s\]
    pub time: f64,
    pub input: f64,
    /// `None` where the reading is lost.
    pub output: Option<f64>,
    /// How it follows the one before.
    pub follows: Follows,
}

/// How a sample follows the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Follows {
    /// After the usual step, or a gap that is bridged.
    On,
    /// After a long gap.
    Gap,
    /// The first one of another sampling interval.
    Interval,
}

/// What became of a row.
pub(crate) struct Taken {
    /// What is to be watched, where a block is complete.
    pub sample: Option<Sample>,
    pub notice: Option<Notice>,
}

/// A value that can be computed with.
pub(crate) fn usable(column: &'static str, value: f64) -> Result<f64, Refused> {
    if !value.is_finite() {
        return Err(Refused::NotFinite { column, value });
    }
    if value.abs() > LARGEST {
        return Err(Refused::TooLarge {
            column,
            value,
            limit: LARGEST,
        });
    }
    Ok(value)
}

/// The state between two rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Intake {
    /// Rows in a block.
    pub every: usize,
    /// Rows that were taken.
    pub rows: u64,
    pub last: Option<f64>,
    /// Of the latest rows that lie before that, in order among themselves: the last one's time, and how many.
    back: Option<(f64, usize)>,
    /// The latest steps, at most [`STEPS`].
    steps: Vec<f64>,
    /// Median and longest of the usual steps.
    usual: Option<(f64, f64)>,
    /// Steps of another length in a row.
    other: usize,
    /// Sums of the block's times (since its first), commands and readings; rows in it; its first time.
    sums: [f64; 3],
    filled: usize,
    begun: f64,
    follows: Follows,
    /// The latest reading of the stretch, and rows without one since.
    reading: Option<f64>,
    without: usize,
    /// Rows of the block with a reading.
    readings: usize,
}

impl Intake {
    pub(crate) fn new() -> Self {
        Self {
            every: 1,
            rows: 0,
            last: None,
            back: None,
            steps: Vec::with_capacity(STEPS),
            usual: None,
            other: 0,
            sums: [0.0; 3],
            filled: 0,
            begun: 0.0,
            follows: Follows::Gap,
            reading: None,
            without: 0,
            readings: 0,
        }
    }

    /// The numbers that a file may have spoilt.
    pub(crate) fn sound(&self) -> bool {
        (1..=LONGEST_BLOCK).contains(&self.every)
            && self.rows <= MOST_ROWS
            && self.steps.len() <= STEPS
            && self.back.is_none_or(|(_, count)| count < BACK)
            && self.other < OTHER
            && self.filled < self.every
            && self.readings <= self.filled
            && self.without as u64 <= self.rows
    }

    /// Begins a new block, after `every` has changed.
    pub(crate) fn begin(&mut self) {
        self.filled = 0;
        self.readings = 0;
        self.sums = [0.0; 3];
    }

    /// Takes in a row with its `reading`, where that can be used.
    pub(crate) fn take(&mut self, row: &Row, reading: Option<f64>) -> Result<Taken, Refused> {
        let time = usable("time", row.time)?;
        let input = usable("input", row.input)?;
        let mut notice = None;
        if let Some(previous) = self.last {
            if time == previous {
                return Err(Refused::Repeated { time });
            }
            notice = if time < previous {
                Some(self.set_back(previous, time)?)
            } else {
                self.step(previous, time)
            };
        }
        self.last = Some(time);
        self.back = None;
        self.rows += 1;
        if self.filled == 0 {
            self.begun = time;
        }
        self.sums[0] += time - self.begun;
        self.sums[1] += input;
        self.filled += 1;
        if let Some(reading) = reading {
            self.read(reading);
        } else {
            self.without += 1;
        }
        let has_reading = reading.is_some() && 2 * self.readings >= self.every;
        let sample = (self.filled == self.every).then(|| {
            let mean = |sum: f64| sum / self.every as f64;
            Sample {
                time: self.begun + mean(self.sums[0]),
                input: mean(self.sums[1]),
                output: has_reading.then(|| mean(self.sums[2])),
                follows: self.follows,
            }
        });
        if sample.is_some() {
            self.begin();
            self.follows = Follows::On;
        }
        Ok(Taken { sample, notice })
    }

    /// Adds a reading to the block, and what the rows of the block right before it lack.
    fn read(&mut self, reading: f64) {
        let in_block = self.without.min(self.filled - 1);
        let before = self.reading.unwrap_or(reading);
        let slope = (reading - before) / (self.without + 1) as f64;
        let first = (self.without - in_block + 1) as f64;
        let steps = in_block as f64 * (first + self.without as f64) / 2.0;
        self.sums[2] += in_block as f64 * before + slope * steps + reading;
        self.readings += 1;
        self.reading = Some(reading);
        self.without = 0;
    }

    /// Begins a new stretch.
    fn part(&mut self) {
        if self.follows == Follows::On {
            self.follows = Follows::Gap;
        }
        self.reading = None;
        self.without = 0;
        self.begin();
    }

    /// A row that goes back is refused, but not for ever: one wrong time that lies ahead would make the monitor deaf.
    fn set_back(&mut self, previous: f64, time: f64) -> Result<Notice, Refused> {
        let count = match self.back {
            Some((last, count)) if time >= last => count + usize::from(time > last),
            _ => 1,
        };
        self.back = Some((time, count));
        if count < BACK {
            return Err(Refused::Backward { time, previous });
        }
        self.part();
        Ok(Notice::ClockSetBack {
            from: previous,
            to: time,
        })
    }

    /// Looks at a step of the time.
    fn step(&mut self, previous: f64, time: f64) -> Option<Notice> {
        let step = time - previous;
        if self.steps.len() == STEPS {
            self.steps.remove(0);
        }
        self.steps.push(step);
        let Some((median, longest)) = self.usual else {
            if self.steps.len() == STEPS {
                self.usual = Some(self.median_and_longest());
            }
            return None;
        };
        if step <= GAP * longest && step * GAP >= median {
            self.other = 0;
            return None;
        }
        self.other += 1;
        if self.other == OTHER {
            self.other = 0;
            let now = self.median_and_longest();
            self.usual = Some(now);
            self.follows = Follows::Interval;
            self.every = 1;
            self.begin();
            return Some(Notice::IntervalChanged {
                time,
                from: median,
                to: now.0,
            });
        }
        if step <= GAP * longest {
            return None;
        }
        let bridged = step <= BRIDGED * longest;
        if !bridged {
            self.part();
        }
        Some(Notice::Gap {
            from: previous,
            to: time,
            missing: ((step / median).round() as u64).saturating_sub(1),
            bridged,
        })
    }

    /// Of the latest steps; a single long one is no usual one.
    fn median_and_longest(&self) -> (f64, f64) {
        let mut sorted = self.steps.clone();
        sorted.sort_by(f64::total_cmp);
        (sorted[STEPS / 2], sorted[STEPS - 2])
    }
}
