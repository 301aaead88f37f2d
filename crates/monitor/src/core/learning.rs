//! Collects rows for learning, and starts monitoring with the learned model.

use std::collections::VecDeque;

use ct_signals::ArModel;

use super::{Core, Fed, KEPT, Phase};
use crate::{
    Each, Gathered, Notice,
    bank::Bank,
    intake::{LONGEST_BLOCK, Sample},
    isolate::Kept,
    learn::Learned,
    lost::interpolated,
    scatter::Scatter,
    watch::as_learned,
};

impl Core {
    /// Starts learning again.
    pub(super) fn begin(&mut self, every: usize) {
        self.now.phase = Phase::Learning {
            next: self.settings.learning_rows,
            span: None,
        };
        self.now.every = every;
        self.now.kept.clear();
        self.now.judged = 0;
        self.now.settling = 0;
        self.now.learned = None;
        self.now.bank = None;
        self.now.scatter.fill(Scatter::default());
        self.now.tracker = None;
        self.running = None;
        self.set_checkpoint();
    }

    /// Rows collected for learning, during learning.
    pub(crate) fn gathered(&self) -> Option<Gathered> {
        let Phase::Learning { next, span } = self.now.phase else {
            return None;
        };
        let ends = self.now.kept.front().zip(self.now.kept.back());
        Some(Gathered {
            rows: self.now.kept.len() * self.now.every,
            span: ends.map_or(0.0, |(first, last)| last.sample.time - first.sample.time),
            rows_needed: next.min(KEPT) * self.now.every,
            time_constants: self.settings.learning_time_constants,
            span_needed: span,
        })
    }

    /// Collects a row for learning; a fit is tried at `next` rows. `span`: required time in seconds, if known.
    pub(super) fn gather(&mut self, sample: Sample, next: usize, span: Option<f64>) -> Fed {
        let time = sample.time;
        self.now.kept.push_back(Kept {
            stands: at_rest(&sample),
            sample,
            states: Each::new(),
            modelled: Each::new(),
            innovations: Each::new(),
        });
        if self.now.kept.len() < next.min(KEPT) {
            return Fed::default();
        }
        let samples: Vec<Sample> = self
            .now
            .kept
            .iter()
            .map(|kept| kept.sample.clone())
            .collect();
        let notice = match self.model.0.learn(&samples, self.hold()) {
            Err(why) => {
                // The older half is dropped: later rows may contain more information.
                self.later(2 * next, span, |kept, _| {
                    kept.drain(..KEPT / 2);
                });
                Some(Notice::NotLearned { why })
            }
            Ok((learned, states)) => {
                let span = time - samples[0].time;
                let needed = self.settings.learning_time_constants * learned.time_constant;
                if span < needed {
                    let full = self.now.kept.len() == KEPT;
                    let rows = self.now.kept.len() as f64 * needed / span;
                    // Slightly more, because the estimate of the time constant changes.
                    self.later((1.02 * rows).ceil() as usize, Some(needed), halve);
                    if full {
                        self.now.every = (2 * self.now.every).min(LONGEST_BLOCK);
                        self.set_checkpoint();
                    }
                    None
                } else {
                    self.take_over(learned, &states)
                }
            }
        };
        Fed {
            notice,
            ..Fed::default()
        }
    }

    /// Postpones the next fit to this number of rows; if they do not fit into memory, older rows are dropped.
    fn later(
        &mut self,
        next: usize,
        span: Option<f64>,
        room: impl FnOnce(&mut VecDeque<Kept>, usize),
    ) {
        let next = if self.now.kept.len() < KEPT {
            next.min(KEPT)
        } else {
            room(&mut self.now.kept, self.now.scatter.len());
            KEPT
        };
        self.now.phase = Phase::Learning { next, span };
        if self.now.kept.len() < KEPT && self.since.len() >= KEPT {
            self.set_checkpoint();
        }
    }

    /// Simulates the learned model over the rows that it was learned from, and starts monitoring.
    fn take_over(&mut self, learned: Learned, states: &[f64]) -> Option<Notice> {
        let (rows, time_constant) = (learned.rows() * self.now.every, learned.time_constant);
        let noise = learned
            .noise()?
            .iter()
            .map(ArModel::stationary_std)
            .collect();
        let unit = learned.rows_per_time_constant();
        let lanes = self.model.0.lanes(learned.theta.len());
        self.now.bank = Some(Bank::new(unit, lanes, learned.outputs.len()));
        self.now.tracker = Some(as_learned(&learned, lanes));
        self.now.learned = Some(learned);
        self.now.phase = Phase::Watching;
        self.now.settling = 0;
        let at_rest = at_rest(&self.now.kept.front()?.sample);
        self.start(states, at_rest);
        let mut kept = std::mem::take(&mut self.now.kept);
        if let Some(running) = &mut self.running {
            for kept in &mut kept {
                let said = running.watch.follow(&kept.sample);
                *kept = said.of(kept.sample.clone());
            }
        }
        self.now.judged = kept.len();
        self.now.kept = kept;
        self.settle_checkpoint();
        Some(Notice::Learned {
            rows,
            time_constant,
            noise,
            every: self.now.every,
            threshold: self.running.as_ref()?.threshold,
        })
    }
}

/// The first input of a sample, with the actuator at rest.
pub(super) fn at_rest(sample: &Sample) -> f64 {
    sample.inputs.first().copied().unwrap_or(0.0)
}

/// Means of pairs of rows; a pair without any reading of an output has no mean of it.
fn halve(kept: &mut VecDeque<Kept>, outputs: usize) {
    let pairs = kept.len() / 2;
    let of_output = |output: usize| {
        let readings: Vec<Option<f64>> = kept.iter().map(|k| k.sample.outputs[output]).collect();
        interpolated(&readings).unwrap_or_default()
    };
    let filled: Vec<Vec<f64>> = (0..outputs).map(of_output).collect();
    for i in 0..pairs {
        let (a, b) = (kept[2 * i].sample.clone(), kept[2 * i + 1].sample.clone());
        let mean = |(output, filled): (usize, &Vec<f64>)| {
            let any = a.outputs[output].or(b.outputs[output]);
            any.map(|_| 0.5 * (filled[2 * i] + filled[2 * i + 1]))
        };
        let inputs = a.inputs.iter().zip(&b.inputs);
        kept[i].sample = Sample {
            time: 0.5 * (a.time + b.time),
            inputs: inputs.map(|(a, b)| 0.5 * (a + b)).collect(),
            outputs: filled.iter().enumerate().map(mean).collect(),
            follows: a.follows,
        };
    }
    kept.truncate(pairs);
}
