//! Phases of the monitor, and how it is saved: learn, monitor, alarm, evaluate again, wait until the model fits again.
//!
//! **Checkpoints.** Every [`STRETCH`] rows, and whenever the phase changes, all that is not plain numbers (the simulation, the
//! whitening filter, the tracker's factors) is built again from plain numbers and the rows that are kept. A saved
//! state is the last checkpoint and the rows since, and a restored monitor takes these rows again: it does what the one that was
//! never interrupted did, on the same numbers, bit for bit.

mod building;
mod learning;
mod watching;

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::{
    Alarm, Estimate, Notice, ScatterAlarm, Settings, TimeAxis, Units, Watched,
    bank::Bank,
    intake::{Follows, LONGEST_BLOCK, Sample},
    isolate::Kept,
    learn::Learned,
    scatter::{Most, Scatter},
    tracker::{Tracker, TrackerState},
    watch::{Said, Watch, tracked},
};

/// Number of stored rows.
pub(crate) const KEPT: usize = 2048;
/// Rows between checkpoints.
const STRETCH: usize = 2048;
/// Half the width of the interval that contains a Gaussian value with a probability of 95 %.
const BAND: f64 = 1.96;

const OTHER_NUMBERS: &str = "its numbers do not belong to this model";

/// Phase of the monitor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Rows are collected; at `next` a fit is tried. The preceding fit has determined the required time `span` in seconds.
    Learning { next: usize, span: Option<f64> },
    /// Monitoring with the learned model.
    Watching,
    /// The model does not fit, and keeps its learned parameters until it fits again.
    Alarmed(Following),
}

/// An alarm in progress.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Following {
    /// The score that exceeded its threshold, and the output with the largest deviation.
    score: f64,
    output: usize,
    /// Time of the alarm \[s\].
    since: f64,
    /// Number of rows since the alarm.
    rows: usize,
    /// Number of evaluations.
    looks: usize,
    /// Whether an effect of the catalogue explained the rows in the last evaluation.
    explained: bool,
    /// Number of rows since which all scores have been small.
    quiet: usize,
}

/// Data to be saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Checkpoint {
    pub phase: Phase,
    /// Rows in a block.
    pub every: usize,
    pub kept: VecDeque<Kept>,
    /// Number of the latest stored rows that were evaluated without a break.
    pub judged: usize,
    /// Rows until the levels are known again.
    pub settling: usize,
    pub learned: Option<Learned>,
    pub bank: Option<Bank>,
    /// Noise monitor of each output.
    pub scatter: Vec<Scatter>,
    pub tracker: Option<TrackerState>,
}

/// Result of a sample.
#[derive(Default)]
pub(crate) struct Fed {
    pub said: Option<Said>,
    pub notice: Option<Notice>,
    pub alarm: Option<Alarm>,
    pub scatter: Vec<ScatterAlarm>,
}

/// Objects that are built from the learned numbers.
struct Running {
    watch: Watch,
    tracker: Option<Tracker>,
    covariance: Vec<f64>,
    threshold: f64,
    /// For each output the number of pairs beyond the limit that raises an alarm of increased noise.
    most: Vec<Most>,
}

pub(crate) struct Core {
    model: Watched,
    settings: Settings,
    units: Units,
    pub(crate) axis: TimeAxis,
    /// The present state, except for the tracker, which is that of the last checkpoint.
    now: Checkpoint,
    running: Option<Running>,
    checkpoint: Checkpoint,
    since: Vec<Sample>,
}

impl Core {
    pub(crate) fn new(model: Watched, settings: Settings, units: Units) -> Self {
        let outputs = model.0.outputs();
        let now = Checkpoint {
            phase: Phase::Learning {
                next: settings.learning_rows,
                span: None,
            },
            every: 1,
            kept: VecDeque::with_capacity(KEPT),
            judged: 0,
            settling: 0,
            learned: None,
            bank: None,
            scatter: vec![Scatter::default(); outputs],
            tracker: None,
        };
        Self {
            model,
            settings,
            units,
            axis: TimeAxis::default(),
            checkpoint: now.clone(),
            now,
            running: None,
            since: Vec::with_capacity(STRETCH),
        }
    }

    /// Restores from a checkpoint and the rows since; inconsistent data are reported in words.
    pub(crate) fn restore(
        model: Watched,
        settings: Settings,
        units: Units,
        checkpoint: Checkpoint,
        since: &[Sample],
    ) -> Result<Self, String> {
        let learning = matches!(checkpoint.phase, Phase::Learning { .. });
        if checkpoint.kept.len() > KEPT
            || checkpoint.judged > checkpoint.kept.len()
            || !(1..=LONGEST_BLOCK).contains(&checkpoint.every)
            || matches!(checkpoint.phase, Phase::Learning { next, .. } if next > KEPT)
            || since.len() > KEPT + STRETCH
        {
            return Err("it holds more rows than a monitor keeps".into());
        }
        if learning == checkpoint.learned.is_some() || learning == checkpoint.bank.is_some() {
            return Err("what it has learned does not agree with its phase".into());
        }
        let mut core = Self::new(model, settings, units);
        let outputs = core.now.scatter.len();
        core.now = checkpoint;
        let (inputs, states) = (core.model.0.inputs(), core.model.0.states());
        let fits =
            |sample: &Sample| sample.inputs.len() == inputs && sample.outputs.len() == outputs;
        // Collected rows have not been simulated yet.
        let (states, shown) = if learning { (0, 0) } else { (states, outputs) };
        let whole = |kept: &Kept| {
            fits(&kept.sample)
                && kept.states.len() == states
                && kept.modelled.len() == shown
                && kept.innovations.len() == shown
        };
        if !(since.iter().all(fits) && core.now.kept.iter().all(whole)) {
            return Err(OTHER_NUMBERS.into());
        }
        let scatter = &core.now.scatter;
        if scatter.len() != outputs || !scatter.iter().all(Scatter::sound) {
            return Err(OTHER_NUMBERS.into());
        }
        if let Some(learned) = &core.now.learned {
            let parameters = core.model.0.parameters(learned, &core.units)?.len();
            let lanes = core.model.0.lanes(parameters);
            let bank = core.now.bank.as_ref();
            let scores = bank.is_some_and(|bank| bank.sound(lanes, outputs));
            if learned.operating.len() != states
                || !learned.sound(parameters, outputs)
                || !scores
                || core.now.kept.is_empty()
            {
                return Err(OTHER_NUMBERS.into());
            }
        }
        core.checkpoint = core.now.clone();
        if !learning {
            core.build().ok_or("its numbers make no model")?;
        }
        for sample in since {
            core.feed(sample.clone());
        }
        Ok(core)
    }

    pub(crate) fn saved(&self) -> (&Checkpoint, &[Sample]) {
        (&self.checkpoint, &self.since)
    }

    pub(crate) fn every(&self) -> usize {
        self.now.every
    }

    pub(crate) fn phase(&self) -> Phase {
        self.now.phase
    }

    pub(crate) fn learned(&self) -> Option<&Learned> {
        self.now.learned.as_ref()
    }

    pub(crate) fn kept(&self) -> usize {
        self.now.kept.len()
    }

    /// Learned and tracked value of every parameter; empty while learning.
    pub(crate) fn estimates(&self) -> Vec<Estimate> {
        let (Some(learned), Some(running)) = (&self.now.learned, &self.running) else {
            return Vec::new();
        };
        let lanes = tracked(learned, self.model.0.lanes(learned.theta.len()));
        let estimates: Vec<(f64, f64)> = running
            .tracker
            .as_ref()
            .map_or(Vec::new(), |tracker| tracker.estimates().collect());
        let named = self.model.0.parameters(learned, &self.units);
        let named = named.unwrap_or_default().into_iter();
        named
            .zip(&learned.theta)
            .enumerate()
            .map(|(i, ((name, unit), &learned))| {
                let at = lanes.iter().position(|(lane, _)| *lane == i);
                let tracked = at.and_then(|at| estimates.get(at));
                Estimate {
                    name,
                    unit,
                    learned,
                    value: tracked.map_or(learned, |(deviation, _)| learned + deviation),
                    half_width: tracked.map(|(_, error)| BAND * error),
                }
            })
            .collect()
    }

    /// The largest score and the threshold.
    pub(crate) fn score(&self) -> Option<(f64, f64)> {
        let (bank, running) = (self.now.bank.as_ref()?, self.running.as_ref()?);
        Some((bank.largest(&running.covariance), running.threshold))
    }

    /// The output with the largest deviation.
    fn most_at(&self) -> Option<usize> {
        let (bank, running) = (self.now.bank.as_ref()?, self.running.as_ref()?);
        Some(bank.most_at(&running.covariance))
    }

    pub(crate) fn feed(&mut self, sample: Sample) -> Fed {
        let mut notice = None;
        match sample.follows {
            Follows::On => {}
            Follows::Interval => self.begin(1),
            Follows::Gap => notice = self.resume(&sample),
        }
        // After a checkpoint of a new start, the sample belongs to the rows after the start.
        self.since.push(sample.clone());
        let fed = match self.now.phase {
            Phase::Learning { next, span } => self.gather(sample, next, span),
            _ => self.watch(sample),
        };
        Fed {
            notice: fed.notice.or(notice),
            ..fed
        }
    }
}
