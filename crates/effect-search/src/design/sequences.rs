//! Candidate sequences of the experiment: steps, staircases, binary and multi-level sequences, within a range and a slew limit, with clock
//! periods relative to the plant's slowest time constant.

use ct_signals::{Error, excitation};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::Serialize;

/// Limits for sequences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// Smallest value \[unit of the input\].
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Range in the records.
    pub visited: (f64, f64),
    /// Largest change in a second.
    pub slew: Option<f64>,
    /// Length \[s\].
    pub duration: f64,
    /// Time between samples \[s\].
    pub interval: f64,
    /// Samples.
    pub samples: usize,
}

/// A kind of sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Repetition of the longest record's experiment.
    Again,
    /// Two levels, changed after every clock period.
    Step,
    /// Levels up and down again, each held for a clock period.
    Staircase,
    /// A pseudo-random binary sequence.
    Binary,
    /// Levels drawn evenly from the range, each held for a clock period.
    MultiLevel,
    /// One value.
    Constant,
}

impl Kind {
    /// Name of the kind in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Again => "the same again",
            Self::Step => "step",
            Self::Staircase => "staircase",
            Self::Binary => "binary",
            Self::MultiLevel => "multi-level",
            Self::Constant => "constant",
        }
    }
}

/// A sequence and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Kind of the sequence.
    pub kind: Kind,
    /// Duration of each level \[s\].
    pub clock: f64,
    /// Levels of a staircase.
    pub levels: Option<usize>,
    /// Number of the random draw.
    pub draw: Option<u64>,
    /// Largest change per second, if it is smaller than the limits allow.
    pub slew: Option<f64>,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// A value for each sample.
    pub values: Vec<f64>,
}

/// Clock periods over the slowest time constant: short ones excite lags, long ones show static curves.
const CLOCKS: [f64; 6] = [0.03, 0.1, 0.3, 1.0, 2.0, 4.0];
/// Half periods of a square wave over the slowest time constant; the complete length is used too.
const STEPS: [f64; 2] = [2.0, 5.0];
const STAIRCASES: [usize; 3] = [3, 5, 9];
/// Draws of a multi-level sequence for each clock period.
const DRAWS: u64 = 2;
/// Longest duration of a level as a share of the experiment: a constant level contains no information.
const LONGEST: f64 = 0.25;
/// Length of the shift register: its sequence is longer than any experiment.
const REGISTER: u32 = 18;

/// Ranges to try: the whole range; its halves, one of which contains a threshold or a bend; and the range of the records, once and twice as
/// wide, where the models are validated.
fn parts(room: &Room) -> Vec<(f64, f64)> {
    let (low, high) = (room.low, room.high);
    let middle = 0.5 * (low + high);
    let mut parts = vec![(low, high), (low, middle), (middle, high)];
    let (from, to) = room.visited;
    for more in [0.0, 0.5 * (to - from)] {
        let part = ((from - more).max(low), (to + more).min(high));
        // A sequence over a very narrow range shows nothing, and a range slightly narrower than the whole is the whole.
        let share = (part.1 - part.0) / (high - low);
        if (0.01..0.9).contains(&share) {
            parts.push(part);
        }
    }
    parts
}

/// Consecutive bits from a random position of the shift register's sequence, not all equal.
fn bits(n: usize, low: f64, high: f64, rng: &mut ChaCha8Rng) -> Result<Vec<f64>, Error> {
    loop {
        let from = rng.random_range(0..1 << (REGISTER - 1));
        let mut bits = excitation::prbs(from + n, 1, low, high, REGISTER)?;
        bits.drain(..from);
        if n < 2 || bits.contains(&low) && bits.contains(&high) {
            return Ok(bits);
        }
    }
}

/// All sequences within the limits, for a plant with this slowest time constant \[s\].
///
/// # Errors
/// Where the room holds no sequence: no sample, a range without width.
pub fn sequences(room: &Room, time_constant: f64, seed: u64) -> Result<Vec<Sequence>, Error> {
    let n = room.samples;
    // A plant that does not settle within the experiment has no time constant that can be a scale.
    let slowest = time_constant.min(0.2 * room.duration);
    let samples = |clock: f64| -> usize {
        let most = (LONGEST * n as f64).max(1.0);
        (clock / room.interval).round().clamp(1.0, most) as usize
    };
    let mut clocks: Vec<usize> = CLOCKS.iter().map(|c| samples(c * slowest)).collect();
    clocks.dedup();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut all = Vec::new();
    let mut push = |kind, hold: usize, levels, draw, (low, high), values| {
        all.push(Sequence {
            kind,
            clock: hold as f64 * room.interval,
            levels,
            draw,
            slew: None,
            low,
            high,
            values,
        });
    };
    for range in parts(room) {
        let (low, high) = range;
        let mut halves: Vec<usize> = STEPS.iter().map(|s| samples(s * slowest)).collect();
        halves.push(n.div_ceil(2));
        halves.dedup();
        for half in halves {
            for pair in [[low, high], [high, low]] {
                let values = excitation::levels(n, half, &pair)?;
                push(Kind::Step, half, None, None, range, values);
            }
        }
        for &clock in &clocks {
            let bits = bits(n.div_ceil(clock), low, high, &mut rng)?;
            let values = excitation::levels(n, clock, &bits)?;
            push(Kind::Binary, clock, None, None, range, values);
        }
    }
    let whole = [(room.low, room.high)];
    let levels = whole.into_iter().chain(parts(room).split_off(3));
    for (range, count) in levels.flat_map(|range| STAIRCASES.map(|count| (range, count))) {
        let at = |i: usize| range.0 + (range.1 - range.0) * i as f64 / (count - 1) as f64;
        let rising = (0..count).map(at);
        let falling = (1..count - 1).rev().map(at);
        let ladder: Vec<f64> = rising.chain(falling).collect();
        let mut clocks: Vec<usize> = [samples(slowest), n.div_ceil(ladder.len())].to_vec();
        clocks.dedup();
        for clock in clocks {
            let values = excitation::levels(n, clock, &ladder)?;
            push(Kind::Staircase, clock, Some(count), None, range, values);
        }
    }
    for range in whole.into_iter().chain(parts(room).split_off(3)) {
        for (&clock, draw) in clocks
            .iter()
            .flat_map(|clock| (1..=DRAWS).map(move |d| (clock, d)))
        {
            let values = excitation::steps(n, clock..=clock, range.0, range.1, &mut rng)?;
            push(Kind::MultiLevel, clock, None, Some(draw), range, values);
        }
    }
    if let Some(slew) = room.slew {
        for sequence in &mut all {
            excitation::limit_slew(&mut sequence.values, slew * room.interval)?;
        }
    }
    Ok(all)
}

impl Sequence {
    /// The sequence with its change per second limited to `slew`.
    ///
    /// # Errors
    /// Where the slew is not positive.
    pub fn slowed(&self, slew: f64, interval: f64) -> Result<Self, Error> {
        let mut slower = self.clone();
        slower.slew = Some(slew);
        excitation::limit_slew(&mut slower.values, slew * interval)?;
        Ok(slower)
    }

    /// The sequence repeated, within the slew limit.
    ///
    /// # Errors
    /// Where the slew is not positive.
    pub fn repeated(&self, times: usize, room: &Room) -> Result<Self, Error> {
        let mut longer = self.clone();
        longer.values = self.values.repeat(times);
        let limits = [room.slew, self.slew].into_iter().flatten();
        let slew = limits.fold(f64::INFINITY, f64::min);
        excitation::limit_slew(&mut longer.values, slew * room.interval)?;
        Ok(longer)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn room(slew: Option<f64>) -> Room {
        Room {
            low: 2.0,
            high: 7.0,
            visited: (4.0, 4.5),
            slew,
            duration: 1200.0,
            interval: 2.0,
            samples: 600,
        }
    }

    #[test]
    fn every_sequence_keeps_range_slew_and_length() {
        for slew in [None, Some(0.01), Some(0.2), Some(100.0)] {
            for time_constant in [0.5, 60.0, 1e4, f64::INFINITY] {
                let room = room(slew);
                let all = sequences(&room, time_constant, 3).unwrap();
                assert!(all.len() > 15);
                for sequence in &all {
                    assert_eq!(sequence.values.len(), 600, "{:?}", sequence.kind);
                    let within = |u: &f64| (2.0..=7.0).contains(u);
                    assert!(sequence.values.iter().all(within), "{:?}", sequence.kind);
                    let most = slew.unwrap_or(f64::INFINITY) * 2.0 * (1.0 + 1e-12);
                    let steps = sequence.values.windows(2).map(|w| (w[1] - w[0]).abs());
                    assert!(steps.fold(0.0, f64::max) <= most, "{:?}", sequence.kind);
                    // The sequence has to change the input.
                    let (low, high) = sequence
                        .values
                        .iter()
                        .fold((9.0f64, 0.0f64), |(a, b), u| (a.min(*u), b.max(*u)));
                    assert!(high > low, "{:?} {}", sequence.kind, sequence.clock);
                }
            }
        }
    }

    #[test]
    fn a_seed_gives_the_same_sequences_and_another_one_others() {
        let of = |seed| sequences(&room(None), 60.0, seed).unwrap();
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
    }
}
