//! Records with missing rows or samples of an input: short gaps are bridged by holding the input, and records are cut at longer ones.
//!
//! A missing sample of an *output* is left out of the likelihood; nothing else is lost. What an *input* did while nothing was
//! recorded is not known. For a short while it is taken to have stayed as it was (or, of a [`Hold::First`] input, to have run in a
//! straight line), and the resulting error of the simulated output is small compared with the response. For longer the record is cut: its parts keep their time
//! stamps, so that they share a clock, and each begins with states of its own.

use serde::{Deserialize, Serialize};

use crate::record::quantile_of_steps;
use crate::{Channel, Hold, Record};

/// A step of the time of this number of sampling intervals or more means missing rows: half-way between one and two.
const GAP: f64 = 1.5;
/// Steps of an evenly sampled record differ from whole intervals by at most this part of one ...
const EVEN: f64 = 0.25;
/// ... if this share of the steps are multiples of it.
const MOST: f64 = 0.98;
/// Rows are missing, and steps are not uneven, if this share of the steps equals one interval.
const SINGLE: f64 = 0.6;
/// With rounded stamps, more than this share of the steps has two intervals; when rows are lost this often, longer steps occur too.
const ROUNDED: f64 = 0.05;
/// With uneven steps, a gap is a step longer than 1.5 times this quantile of the steps.
const USUAL: f64 = 0.95;
/// Steps that belong to one rate of a logger with several differ by at most this part of each other ...
const SAME_RATE: f64 = 0.2;
/// ... and at least this many occur one after the other: lost rows cause steps of any length, one at a time.
const STAYS: usize = 3;
/// A logger has several rates if this share of the long steps occurs in such a sequence.
const OF_A_RATE: f64 = 0.5;
/// Largest number of inserted rows.
const MOST_PUT_IN: usize = 100_000;
/// A part with fewer samples of an output contains less information than its initial states need.
pub(crate) const SHORTEST: usize = 8;

/// An input is the same before and after a gap if its values differ by at most this share of its range: a step differs by more, a slow
/// signal by less. Chosen.
const UNCHANGED: f64 = 0.1;

/// The longest time for which inputs are held through a gap \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongestHold {
    /// If all inputs are the same after the gap as before it.
    pub unchanged: f64,
    /// If an input has changed: when, is not known.
    pub changed: f64,
}

impl From<f64> for LongestHold {
    fn from(longest: f64) -> Self {
        Self {
            unchanged: longest,
            changed: longest,
        }
    }
}

/// How missing rows and missing samples of inputs were handled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Gaps {
    /// Rows that are missing between the first and the last.
    pub rows: usize,
    /// Places where rows or samples of an input are missing.
    pub places: usize,
    /// Number of these gaps through which the inputs were held.
    pub held: usize,
    /// Number of these gaps where the record was cut; a new part begins after the gap.
    pub cut: usize,
    /// Rows of parts that were too short to be used.
    pub unused: usize,
    /// The longest time for which an input was held \[s\].
    pub longest_hold: f64,
}

impl Gaps {
    /// Together with those of another record.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            rows: self.rows + other.rows,
            places: self.places + other.places,
            held: self.held + other.held,
            cut: self.cut + other.cut,
            unused: self.unused + other.unused,
            longest_hold: self.longest_hold.max(other.longest_hold),
        }
    }
}

/// The sampling of a record, rows that are missing aside.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sampling {
    /// The interval \[s\].
    interval: f64,
    /// A longer step is a gap \[s\].
    usual: f64,
}

impl Sampling {
    /// If the steps are whole multiples of one interval, that interval; otherwise their median. For a logger that reduces its rate while
    /// the signals are slow, such as a battery tester, the steps of the slowest rate are no gaps.
    fn of(time: &[f64]) -> Self {
        let plain = Self::of_one_rate(time);
        match slowest_rate(time, plain.interval) {
            Some(slowest) => Self {
                usual: plain.usual.max(slowest),
                ..plain
            },
            None => plain,
        }
    }

    fn of_one_rate(time: &[f64]) -> Self {
        let short = quantile_of_steps(time, 0.1);
        let near: Vec<f64> = steps(time).filter(|step| *step < GAP * short).collect();
        let interval = near.iter().sum::<f64>() / near.len().max(1) as f64;
        let whole = |step: &f64| {
            let intervals = (step / interval).round().max(1.0);
            (step / interval - intervals).abs() <= EVEN
        };
        let even = steps(time).filter(whole).count() as f64;
        let all = time.len().saturating_sub(1) as f64;
        // If more than a few steps are two intervals long and no step is longer, the time stamps were rounded.
        let double = all - near.len() as f64;
        let longest = steps(time).fold(0.0, f64::max);
        let rounded = double > ROUNDED * all && longest < 2.5 * interval;
        if even >= MOST * all && near.len() as f64 >= SINGLE * all && !rounded {
            Self {
                interval,
                usual: interval,
            }
        } else {
            Self {
                interval: quantile_of_steps(time, 0.5),
                usual: quantile_of_steps(time, USUAL),
            }
        }
    }

    /// Rows that are missing in a step of the time.
    fn missing(&self, step: f64) -> usize {
        if step > GAP * self.usual {
            ((step / self.interval).round() as usize).saturating_sub(1)
        } else {
            0
        }
    }
}

/// For a logger with several sampling rates, its longest sampling interval, if at least half of the steps longer than 1.5 `interval` occur in
/// runs of nearly equal steps.
fn slowest_rate(time: &[f64], interval: f64) -> Option<f64> {
    let steps: Vec<f64> = steps(time).collect();
    let long = |step: f64| step > GAP * interval;
    let same = |a: f64, b: f64| (a - b).abs() <= SAME_RATE * a.min(b);
    let of_a_rate = steps.chunk_by(|a, b| same(*a, *b) && long(*a) && long(*b));
    let of_a_rate = of_a_rate.filter(|chunk| long(chunk[0]) && chunk.len() >= STAYS);
    let (count, slowest) = of_a_rate.fold((0, 0.0_f64), |(count, slowest), chunk| {
        let longest = chunk.iter().copied().fold(slowest, f64::max);
        (count + chunk.len(), longest)
    });
    let all = steps.iter().filter(|step| long(**step)).count();
    (count > 0 && count as f64 >= OF_A_RATE * all as f64).then_some(slowest)
}

/// The first row after which rows are missing, and how many.
pub(crate) fn first_gap(time: &[f64]) -> Option<(usize, usize)> {
    let sampling = Sampling::of(time);
    let missing = steps(time).map(|step| sampling.missing(step));
    missing.enumerate().find(|(_, missing)| *missing > 0)
}

fn steps(time: &[f64]) -> impl Iterator<Item = f64> + '_ {
    time.windows(2).map(|pair| pair[1] - pair[0])
}

impl Record {
    /// Rows that are missing between the first and the last, by the steps of the time.
    #[must_use]
    pub fn missing_rows(&self) -> usize {
        let sampling = Sampling::of(&self.time);
        steps(&self.time).map(|step| sampling.missing(step)).sum()
    }

    /// The time of the row after which the first row is missing \[s\].
    #[must_use]
    pub fn before_missing_row(&self) -> Option<f64> {
        let sampling = Sampling::of(&self.time);
        let at = steps(&self.time).position(|step| sampling.missing(step) > 0);
        at.map(|at| self.time[at])
    }

    /// Whether rows are missing, or samples of an input.
    #[must_use]
    pub fn has_gaps(&self) -> bool {
        self.inputs.iter().any(|u| u.missing() > 0) || self.missing_rows() > 0
    }

    /// The record without gaps, as the head of this file says: inputs are held for at most `longest` (from 0 s on, infinite: for as
    /// long as it takes), and the parts between longer gaps are records of their own, numbered, under one name and on one clock. A missing row
    /// that is held through becomes a row without outputs. A reference is held for as long as it takes, as a set point is.
    ///
    /// A record without gaps comes back as it is. No part comes back where no row has all inputs.
    #[must_use]
    pub fn without_gaps(&self, longest: impl Into<LongestHold>) -> (Vec<Record>, Gaps) {
        if !self.has_gaps() && self.references.iter().all(|r| r.missing() == 0) {
            return (vec![self.clone()], Gaps::default());
        }
        let longest = longest.into();
        let mut gaps = Gaps::default();
        let sampling = Sampling::of(&self.time);
        let whole = self.with_missing_rows(sampling, longest, &mut gaps);
        let mut parts = Vec::new();
        for rows in whole.stretches(sampling, longest, &mut gaps) {
            let mut part = whole.rows(rows);
            part.inputs.iter_mut().for_each(hold);
            part.references.iter_mut().for_each(hold);
            let samples = part.outputs.iter().map(|y| part.len() - y.missing());
            if samples.min().is_none_or(|samples| samples >= SHORTEST) {
                parts.push(part);
            } else {
                gaps.unused += part.len();
            }
        }
        if parts.len() > 1 {
            for (number, part) in parts.iter_mut().enumerate() {
                part.part = number + 1;
            }
        }
        (parts, gaps)
    }

    /// Puts rows without a sample where rows are missing for at most `longest`.
    fn with_missing_rows(
        &self,
        sampling: Sampling,
        longest: LongestHold,
        gaps: &mut Gaps,
    ) -> Record {
        // For every row the index of the original row; none for an inserted row.
        let mut from: Vec<Option<usize>> = Vec::with_capacity(self.len());
        let mut time = Vec::with_capacity(self.len());
        for (k, &t) in self.time.iter().enumerate() {
            if let Some(before) = k.checked_sub(1) {
                let begin = self.time[before];
                let missing = sampling.missing(t - begin);
                gaps.rows += missing;
                let known = self.inputs.iter().all(|u| !u.values[before].is_nan());
                let hold = || self.longest_hold(longest, (before, k));
                if missing > 0 && (!known || t - begin - sampling.interval <= hold()) {
                    let step = (t - begin) / (missing + 1) as f64;
                    if missing < MOST_PUT_IN {
                        time.extend((1..=missing).map(|i| begin + step * i as f64));
                        from.extend((0..missing).map(|_| None));
                    }
                }
            }
            time.push(t);
            from.push(Some(k));
        }
        let put = |channel: &Channel| {
            let values = from
                .iter()
                .map(|k| k.map_or(f64::NAN, |k| channel.values[k]));
            channel.with_values(values.collect())
        };
        let all = |channels: &[Channel]| channels.iter().map(put).collect();
        Record {
            name: self.name.clone(),
            time,
            inputs: all(&self.inputs),
            outputs: all(&self.outputs),
            references: all(&self.references),
            part: self.part,
            calendar: self.calendar.clone(),
        }
    }

    /// The longest hold between two rows.
    fn longest_hold(&self, longest: LongestHold, (before, after): (usize, usize)) -> f64 {
        let same = |input: &Channel| {
            let (low, high) = input.range();
            let change = (input.values[after] - input.values[before]).abs();
            // A value that is missing there shows no change.
            change.is_nan() || change <= UNCHANGED * (high - low)
        };
        if self.inputs.iter().all(same) {
            longest.unchanged
        } else {
            longest.changed
        }
    }

    /// Rows between gaps that are too long to be held through.
    fn stretches(
        &self,
        sampling: Sampling,
        longest: LongestHold,
        gaps: &mut Gaps,
    ) -> Vec<std::ops::Range<usize>> {
        let known = |k: usize| self.inputs.iter().all(|u| !u.values[k].is_nan());
        let lines = self.hold() == Hold::First;
        let mut stretches = Vec::new();
        let Some(mut begin) = (0..self.len()).find(|&k| known(k)) else {
            gaps.unused += self.len();
            return stretches;
        };
        gaps.unused += begin;
        // The last row of which all inputs are known.
        let mut last = begin;
        for k in begin + 1..=self.len() {
            let end = k == self.len();
            if !end && !known(k) {
                continue;
            }
            let unknown = if end {
                0.0
            } else {
                self.time[k] - self.time[last] - sampling.interval
            };
            if !end && (k > last + 1 || sampling.missing(self.time[k] - self.time[last]) > 0) {
                gaps.places += 1;
                if unknown <= self.longest_hold(longest, (last, k)) {
                    gaps.held += 1;
                    gaps.longest_hold = gaps.longest_hold.max(unknown);
                } else {
                    gaps.cut += 1;
                    // A held input is valid until its next sample is due: the output in that row still depends on known inputs only.
                    let next = last + 1;
                    let acts = !lines
                        && next < k
                        && self.time[next] - self.time[last] <= GAP * sampling.usual;
                    stretches.push(begin..last + 1 + usize::from(acts));
                    begin = k;
                }
            }
            if end {
                // After the last known input, only the row that still depends on that input is kept.
                let next = last + 1;
                let acts = !lines && next < self.len();
                stretches.push(begin..next + usize::from(acts));
                gaps.unused += self.len() - next - usize::from(acts);
            } else {
                last = k;
            }
        }
        stretches
    }
}

/// Fills missing samples: with the last value, or by linear interpolation if the channel is linear between samples; those at the beginning
/// with the first available value.
fn hold(channel: &mut Channel) {
    if channel.hold == Hold::First {
        channel.values = channel.interpolated();
        return;
    }
    let first = channel.present().next();
    let mut before = first.unwrap_or(0.0);
    for value in &mut channel.values {
        if value.is_nan() {
            *value = before;
        } else {
            before = *value;
        }
    }
}

#[cfg(test)]
mod tests;
