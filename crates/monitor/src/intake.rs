//! Incoming rows: rejected rows, gaps, and means of blocks of rows.
//!
//! The usual step of the time is the median of the first 21. A step of more than one and a half times the longest of them is
//! a gap: a short one is bridged by the held command, a longer one begins a new stretch. Where 20 steps in a
//! row are of another length, the sampling interval has changed. A time that goes back is refused; where 100 rows in a row do, in order
//! among themselves, the clock was set back, or ran ahead for a row, and a new stretch begins.
//!
//! A process that is sampled much faster than its dynamics is monitored in blocks: time, command and reading are their means over
//! `every` rows, and the command runs in a straight line from one mean to the next.
//!
//! A row may lack the reading of an output. In a block such a row is interpolated linearly between the neighbouring readings; a
//! block whose last row lacks the reading, or more than half of whose rows lack it, has no reading of that output.

use serde::{Deserialize, Serialize};

use crate::{Each, NotUsed, Notice, Row};

/// Number of steps from which the usual one is computed.
const STEPS: usize = 21;
/// A step above this many of the longest usual ones is a gap.
const GAP: f64 = 1.5;
/// Number of consecutive steps of another length that make it the usual one.
const OTHER: usize = 20;
/// Number of consecutive rows with earlier times after which the clock counts as set back: more than a logger repeats after a broken
/// connection.
const BACK: usize = 100;
/// A gap of more than this number of usual steps starts a new part.
const BRIDGED: f64 = 5.0;
/// Larger values would overflow in the powers that a fit computes.
const LARGEST: f64 = 1e15;
/// Largest count of rows; at a million rows a second it is reached after 285 years.
const MOST_ROWS: u64 = 1 << 53;
/// Rows in a block.
pub(crate) const LONGEST_BLOCK: usize = 1 << 24;

/// A reading of each output; `None` where it is lost.
pub(crate) type Readings = Each<Option<f64>>;

/// A row, or the mean of a block of rows, for monitoring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sample {
    /// \[s\]
    pub time: f64,
    /// In the order of the inputs.
    pub inputs: Each<f64>,
    /// In the order of the outputs.
    pub outputs: Readings,
    /// Relation to the preceding sample.
    pub follows: Follows,
}

/// Relation of a sample to the preceding one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Follows {
    /// One step later, or after a gap that is bridged.
    On,
    /// After a long gap.
    Gap,
    /// The first sample with another sampling interval.
    Interval,
}

/// Result of a row.
pub(crate) struct Taken {
    /// The sample to be monitored, if a block is complete.
    pub sample: Option<Sample>,
    pub notice: Option<Notice>,
}

/// Checks that a value can be used in computations; `at`: index of the input or output.
pub(crate) fn usable(column: &'static str, at: usize, value: f64) -> Result<f64, NotUsed> {
    if !value.is_finite() {
        return Err(NotUsed::NotFinite { column, at, value });
    }
    if value.abs() > LARGEST {
        return Err(NotUsed::TooLarge {
            column,
            at,
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
    /// For the latest rows with earlier times, if their times increase: time of the last one, and their number.
    back: Option<(f64, usize)>,
    /// The latest steps, at most [`STEPS`].
    steps: Vec<f64>,
    /// Median and longest of the usual steps.
    usual: Option<(f64, f64)>,
    /// Number of consecutive steps of another length.
    other: usize,
    /// Sum of the block's times (since its first), and of each of its inputs; rows in it; its first time.
    sum: f64,
    inputs: Vec<f64>,
    filled: usize,
    begun: f64,
    follows: Follows,
    outputs: Vec<Output>,
}

/// The readings of an output.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Output {
    /// Sum of the block's readings.
    sum: f64,
    /// The latest reading of the part, and rows without a reading since.
    reading: Option<f64>,
    without: usize,
    /// Number of rows of the block with a reading.
    readings: usize,
}

impl Intake {
    pub(crate) fn new(inputs: usize, outputs: usize) -> Self {
        Self {
            every: 1,
            rows: 0,
            last: None,
            back: None,
            steps: Vec::with_capacity(STEPS),
            usual: None,
            other: 0,
            sum: 0.0,
            inputs: vec![0.0; inputs],
            filled: 0,
            begun: 0.0,
            follows: Follows::Gap,
            outputs: vec![Output::default(); outputs],
        }
    }

    /// The numbers that a damaged file may have changed.
    pub(crate) fn sound(&self, inputs: usize, outputs: usize) -> bool {
        (1..=LONGEST_BLOCK).contains(&self.every)
            && self.rows <= MOST_ROWS
            && self.steps.len() <= STEPS
            && self.back.is_none_or(|(_, count)| count < BACK)
            && self.other < OTHER
            && self.filled < self.every
            && self.inputs.len() == inputs
            && self.outputs.len() == outputs
            && self
                .outputs
                .iter()
                .all(|output| output.readings <= self.filled && output.without as u64 <= self.rows)
    }

    /// Begins a new block, after `every` has changed.
    pub(crate) fn begin(&mut self) {
        self.filled = 0;
        self.sum = 0.0;
        self.inputs.fill(0.0);
        for output in &mut self.outputs {
            (output.sum, output.readings) = (0.0, 0);
        }
    }

    /// Processes a row with its usable `readings`.
    pub(crate) fn take(&mut self, row: &Row, readings: &Readings) -> Result<Taken, NotUsed> {
        let time = usable("time", 0, row.time)?;
        for at in 0..self.inputs.len() {
            usable("input", at, row.input(at))?;
        }
        let mut notice = None;
        if let Some(previous) = self.last {
            if time == previous {
                return Err(NotUsed::Repeated { time });
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
        self.sum += time - self.begun;
        for (at, sum) in self.inputs.iter_mut().enumerate() {
            *sum += row.input(at);
        }
        self.filled += 1;
        for (output, reading) in self.outputs.iter_mut().zip(readings) {
            match reading {
                Some(reading) => output.read(*reading, self.filled),
                None => output.without += 1,
            }
        }
        let sample = (self.filled == self.every).then(|| {
            let mean = |sum: f64| sum / self.every as f64;
            let outputs = self.outputs.iter().zip(readings);
            let of_block = |(output, reading): (&Output, &Option<f64>)| {
                let enough = reading.is_some() && 2 * output.readings >= self.every;
                enough.then(|| mean(output.sum))
            };
            Sample {
                time: self.begun + mean(self.sum),
                inputs: self.inputs.iter().map(|sum| mean(*sum)).collect(),
                outputs: outputs.map(of_block).collect(),
                follows: self.follows,
            }
        });
        if sample.is_some() {
            self.begin();
            self.follows = Follows::On;
        }
        Ok(Taken { sample, notice })
    }

    /// Begins a new stretch.
    fn part(&mut self) {
        if self.follows == Follows::On {
            self.follows = Follows::Gap;
        }
        for output in &mut self.outputs {
            (output.reading, output.without) = (None, 0);
        }
        self.begin();
    }

    /// A row with an earlier time is rejected, but not for ever: after a single wrong future time the monitor would reject all rows.
    fn set_back(&mut self, previous: f64, time: f64) -> Result<Notice, NotUsed> {
        let count = match self.back {
            Some((last, count)) if time >= last => count + usize::from(time > last),
            _ => 1,
        };
        self.back = Some((time, count));
        if count < BACK {
            return Err(NotUsed::Backward { time, previous });
        }
        self.part();
        Ok(Notice::ClockSetBack {
            from: previous,
            to: time,
        })
    }

    /// Processes a step of the time.
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

    /// Median and longest of the latest steps; a single long step is unusual.
    fn median_and_longest(&self) -> (f64, f64) {
        let mut sorted = self.steps.clone();
        sorted.sort_by(f64::total_cmp);
        (sorted[STEPS / 2], sorted[STEPS - 2])
    }
}

impl Output {
    /// Adds a reading to a block of the given number of rows, including this one and the missing readings of the rows of the block directly
    /// before it.
    fn read(&mut self, reading: f64, filled: usize) {
        let in_block = self.without.min(filled - 1);
        let before = self.reading.unwrap_or(reading);
        let slope = (reading - before) / (self.without + 1) as f64;
        let first = (self.without - in_block + 1) as f64;
        let steps = in_block as f64 * (first + self.without as f64) / 2.0;
        self.sum += in_block as f64 * before + slope * steps + reading;
        self.readings += 1;
        self.reading = Some(reading);
        self.without = 0;
    }
}
