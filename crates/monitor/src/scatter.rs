//! Noise monitor: tests whether the variance of an output's innovations has increased, whatever their structure is.
//!
//! The scores ask whether the residual has a structure, so innovations that only grow, as those of a loose cable do, fit. Here the rows
//! are taken in pairs: `d = |e_2j - e_2j-1|` is the scatter from a row to the next, which a residual that moves slowly leaves as it is, so
//! that a change of the plant is left to the scores. The limit is the `k`-th largest `d` of the `n` pairs that were learned
//! from. Where nothing has changed, the number of pairs beyond it in a block of `B` is beta-binomial,
//! ```text
//! P(c) = C(B, c) B(k + c, n - k + 1 + B - c)/B(k, n - k + 1)
//! ```
//! whatever the noise's distribution is (W. J. Conover, Practical Nonparametric Statistics, 1999, sec. 3.3: tolerance limits), heavy tails
//! too. A block that has more of them than it has with a probability of its share is an alarm. What was fitted lies a little closer to the
//! model than what comes later: the limit is wider by `sqrt((N + p)/(N - p))`, Akaike's final prediction error.

use serde::{Deserialize, Serialize};
use statrs::function::{beta::ln_beta, factorial::ln_binomial};

/// Share of the false alarm rate for the noise monitor; the scores have the rest.
pub(crate) const SHARE: f64 = 0.1;
/// Pairs in a block: short blocks detect a large increase early, long blocks detect a small increase.
const BLOCKS: [usize; 3] = [16, 64, 256];
/// In learning, one pair of this number exceeds the limit.
const BEYOND: usize = 10;
/// While the noise is increased, its variance is computed from blocks of this length ...
const SIZED: usize = 1;
/// ... and these blocks decide whether it has returned to normal.
const BACK: usize = 2;
/// This number of the latest eight pairs beyond the limit is suspicious: usually there is one.
const SUSPICIOUS: u32 = 3;

/// The learned limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Limit {
    /// Limit of the difference of two neighbours, in standard deviations of the innovations.
    difference: f64,
    /// Number of learned pairs, and of those at or beyond the limit.
    pairs: usize,
    beyond: usize,
    /// Root mean square of the learned innovations.
    rms: f64,
}

impl Limit {
    /// Limit from the learned innovations; `parameters` were fitted to them.
    pub(crate) fn learned(innovations: &[f64], parameters: usize) -> Option<Self> {
        let pairs = innovations.chunks_exact(2);
        let mut apart: Vec<f64> = pairs.map(|pair| (pair[0] - pair[1]).abs()).collect();
        let beyond = apart.len() / BEYOND;
        apart.sort_by(|a, b| b.total_cmp(a));
        let n = innovations.len() as f64;
        let p = (parameters as f64).min(0.5 * n);
        let squares: f64 = innovations.iter().map(|e| e * e).sum();
        let limit = Self {
            difference: apart.get(beyond.checked_sub(1)?)? * ((n + p) / (n - p)).sqrt(),
            pairs: apart.len(),
            beyond,
            rms: (squares / n).sqrt(),
        };
        limit.sound().then_some(limit)
    }

    pub(crate) fn sound(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        positive(self.difference)
            && positive(self.rms)
            && (1..=self.pairs).contains(&self.beyond)
            && self.pairs < 1 << 20
    }

    /// The fewest pairs beyond the limit that a block of `length` has with a probability below `probability`.
    fn most(&self, length: usize, probability: f64) -> usize {
        let (k, rest) = (self.beyond as f64, (self.pairs - self.beyond + 1) as f64);
        let whole = ln_beta(k, rest);
        let mut tail = 0.0;
        for count in (0..=length).rev() {
            let (c, other) = (count as f64, (length - count) as f64);
            tail += (ln_binomial(length as u64, count as u64) + ln_beta(k + c, rest + other)
                - whole)
                .exp();
            if tail > probability {
                return count + 1;
            }
        }
        0
    }

    /// The mean of that number plus a standard deviation: a typical value for a block.
    fn usual(&self, length: usize) -> f64 {
        let (k, rest, b) = (
            self.beyond as f64,
            (self.pairs - self.beyond + 1) as f64,
            length as f64,
        );
        let share = k / (k + rest);
        let variance = b * share * (1.0 - share) * (k + rest + b) / (k + rest + 1.0);
        b * share + variance.sqrt()
    }
}

/// Sums of a block so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Block {
    pairs: usize,
    beyond: usize,
    sum: f64,
    squares: f64,
}

impl Block {
    /// Standard deviation of its innovations.
    fn deviation(&self) -> f64 {
        let n = 2.0 * self.pairs as f64;
        let mean = self.sum / n;
        (self.squares / n - mean * mean).max(0.0).sqrt()
    }
}

/// State of the noise monitor between two rows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Scatter {
    first: Option<f64>,
    blocks: [Block; BLOCKS.len()],
    /// Whether the latest pairs were beyond the limit, a bit each.
    latest: u8,
    /// Ratio to the learned noise.
    grown: Option<f64>,
}

/// Change of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Moved {
    /// The noise has this ratio to the learned noise.
    Grown(f64),
    Back,
}

/// Number of pairs beyond the limit for an alarm, for each length of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Most([usize; BLOCKS.len()]);

impl Most {
    /// Limits for one of this number of outputs, which share the rate of false alarms; `samples` is the mean number of samples between
    /// false alarms of all kinds.
    pub(crate) fn new(limit: &Limit, samples: f64, outputs: usize) -> Self {
        let samples = samples * outputs as f64;
        Self(BLOCKS.map(|length| {
            let rows = 2.0 * length as f64;
            limit.most(length, SHARE * rows / (samples * BLOCKS.len() as f64))
        }))
    }
}

impl Scatter {
    pub(crate) fn sound(&self) -> bool {
        let grown = self.grown.unwrap_or(1.0);
        let blocks = self.blocks.iter().zip(BLOCKS);
        grown.is_finite() && grown >= 1.0 && blocks.into_iter().all(|(b, n)| b.pairs < n)
    }

    /// Ratio of the noise to the learned noise; one if it has not grown.
    pub(crate) fn growth(&self) -> f64 {
        self.grown.unwrap_or(1.0)
    }

    /// Whether an increase of the noise may soon be detected: a score above its threshold may have this cause.
    pub(crate) fn is_suspicious(&self) -> bool {
        self.grown.is_none() && self.latest.count_ones() >= SUSPICIOUS
    }

    /// Drops the started block: rows are missing, or are not suitable.
    pub(crate) fn begin(&mut self) {
        *self = Self {
            grown: self.grown,
            ..Self::default()
        };
    }

    /// Processes an innovation \[standard deviations\].
    pub(crate) fn update(&mut self, e: f64, limit: &Limit, most: &Most) -> Option<Moved> {
        let Some(first) = self.first.take() else {
            self.first = Some(e);
            return None;
        };
        let beyond = (e - first).abs() > limit.difference;
        self.latest = self.latest << 1 | u8::from(beyond);
        let mut moved = None;
        for (i, block) in self.blocks.iter_mut().enumerate() {
            block.pairs += 1;
            block.beyond += usize::from(beyond);
            block.sum += first + e;
            block.squares += first * first + e * e;
            if block.pairs < BLOCKS[i] {
                continue;
            }
            let ratio = (block.deviation() / limit.rms).max(1.0);
            match &mut self.grown {
                None if block.beyond >= most.0[i] => {
                    self.grown = Some(ratio);
                    moved = Some(Moved::Grown(ratio));
                }
                Some(_) if i == BACK && (block.beyond as f64) <= limit.usual(BLOCKS[i]) => {
                    self.grown = None;
                    moved = Some(Moved::Back);
                }
                Some(grown) if i == SIZED => *grown = ratio,
                _ => {}
            }
            *block = Block::default();
        }
        if moved.is_some() {
            self.begin();
        }
        moved
    }
}

/// The noise of the readings has increased, or has returned to normal. Its serialised form is one line of the program's output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScatterAlarm {
    /// [`SCHEMA`](crate::SCHEMA).
    pub schema: u32,
    /// The event.
    pub event: ScatterEvent,
    /// Time of the row after which it was raised \[s\].
    pub time: f64,
    /// The vessel whose level is read, of several outputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<String>,
    /// Learned standard deviation of the noise \[output unit\].
    pub learned: f64,
    /// Standard deviation of the noise now \[output unit\].
    pub now: f64,
    /// The output unit.
    pub unit: String,
}

/// Event of the noise monitor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScatterEvent {
    /// The noise has increased.
    ScatterGrown,
    /// The noise is at the learned level again.
    ScatterBack,
}

impl ScatterAlarm {
    /// `output`: its name, if there are several; `noise`: the learned noise, with its unit.
    pub(crate) fn new(
        moved: Moved,
        time: f64,
        output: Option<String>,
        (noise, unit): (f64, String),
    ) -> Self {
        let (event, now) = match moved {
            Moved::Grown(ratio) => (ScatterEvent::ScatterGrown, ratio * noise),
            Moved::Back => (ScatterEvent::ScatterBack, noise),
        };
        Self {
            schema: crate::SCHEMA,
            event,
            time,
            output,
            learned: noise,
            now,
            unit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::StudentT;

    fn student(n: usize, degrees: f64, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let student = StudentT::new(degrees).unwrap();
        (0..n).map(|_| rng.sample(student)).collect()
    }

    /// Rate of false alarms of increased noise, over many learned limits and the rows after each.
    fn false_alarms(degrees: f64, samples: f64) -> usize {
        let (learned, rows) = (1000, 10_000);
        let run = |seed| {
            let e = student(learned + rows, degrees, seed);
            let limit = Limit::learned(&e[..learned], 2).unwrap();
            let most = Most::new(&limit, samples, 1);
            let mut scatter = Scatter::default();
            let moved = e[learned..]
                .iter()
                .filter_map(|e| scatter.update(*e, &limit, &most));
            moved.filter(|m| matches!(m, Moved::Grown(_))).count()
        };
        (0..200).map(run).sum()
    }

    #[test]
    fn it_is_found_grown_as_seldom_as_promised_whatever_the_tails() {
        // Two million rows: a hundred were allowed.
        for degrees in [1e6, 5.0, 3.0] {
            let alarms = false_alarms(degrees, SHARE * 20_000.0);
            assert!((20..=110).contains(&alarms), "{alarms} at {degrees}");
        }
    }

    #[test]
    fn what_alternates_and_what_grows_is_seen_and_comes_back() {
        let e = student(1000, 1e6, 1);
        let limit = Limit::learned(&e, 2).unwrap();
        let most = Most::new(&limit, 1e6, 1);
        let seen = |values: &[f64]| {
            let mut scatter = Scatter::default();
            let (mut at, mut back) = (None, None);
            for (k, e) in values.iter().chain(&student(3000, 1e6, 2)).enumerate() {
                match scatter.update(*e, &limit, &most) {
                    Some(Moved::Grown(ratio)) => at = at.or(Some((k, ratio))),
                    Some(Moved::Back) => back = Some(k),
                    None => {}
                }
            }
            assert!(scatter.sound() && scatter.growth() == 1.0);
            (at, back.is_some_and(|k| k > values.len()))
        };
        let alternating: Vec<f64> = (0..640).map(|k| [5.0, -5.0][k % 2]).collect();
        let (at, back) = seen(&alternating);
        assert!(back && at.is_some_and(|(k, ratio)| k < 32 && (ratio - 5.0).abs() < 0.3));
        let grown: Vec<f64> = student(3000, 1e6, 3).iter().map(|e| 1.4 * e).collect();
        let (at, back) = seen(&grown);
        assert!(back && at.is_some_and(|(k, ratio)| k < 2048 && (1.2..1.8).contains(&ratio)));
        // A slow residual must not cause a noise alarm.
        let slow: Vec<f64> = student(3000, 1e6, 4)
            .iter()
            .enumerate()
            .map(|(k, e)| e + 4.0 * (0.02 * k as f64).sin())
            .collect();
        assert_eq!(seen(&slow).0, None);
    }
}
