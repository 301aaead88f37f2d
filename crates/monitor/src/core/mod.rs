//! The phases of watching, and how it is saved: learn, watch, alarm, look again, wait until it fits again.
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

/// Rows that are kept.
pub(crate) const KEPT: usize = 2048;
/// Rows between checkpoints.
const STRETCH: usize = 2048;
/// Half the width of the interval that holds a Gaussian value with a probability of 95 %.
const BAND: f64 = 1.96;

const OTHER_NUMBERS: &str = "its numbers are not those of this model";

/// Where the watching is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Rows are gathered; at `next` a fit is tried. The one before has found that `span` seconds are needed.
    Learning { next: usize, span: Option<f64> },
    /// The learned model is watched.
    Watching,
    /// It does not fit, and stays as it was learned until it fits again.
    Alarmed(Following),
}

/// An alarm that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Following {
    /// What passed, and the output at which it shows most.
    score: f64,
    output: usize,
    /// When it was raised \[s\].
    since: f64,
    /// So many rows ago.
    rows: usize,
    /// Looked at so many times.
    looks: usize,
    /// An effect of the catalogue explained it, the last time.
    explained: bool,
    /// For so many rows all scores have been small.
    quiet: usize,
}

/// All that has to be saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Checkpoint {
    pub phase: Phase,
    /// Rows in a block.
    pub every: usize,
    pub kept: VecDeque<Kept>,
    /// So many of the latest kept rows have been judged without a break.
    pub judged: usize,
    /// Rows until the levels are known again.
    pub settling: usize,
    pub learned: Option<Learned>,
    pub bank: Option<Bank>,
    /// Of each output.
    pub scatter: Vec<Scatter>,
    pub tracker: Option<TrackerState>,
}

/// What became of a sample.
#[derive(Default)]
pub(crate) struct Fed {
    pub said: Option<Said>,
    pub notice: Option<Notice>,
    pub alarm: Option<Alarm>,
    pub scatter: Vec<ScatterAlarm>,
}

/// What is built from the learned numbers.
struct Running {
    watch: Watch,
    tracker: Option<Tracker>,
    covariance: Vec<f64>,
    threshold: f64,
    /// Of each output the pairs beyond the limit that make the scatter an alarm.
    most: Vec<Most>,
}

pub(crate) struct Core {
    model: Watched,
    settings: Settings,
    units: Units,
    pub(crate) axis: TimeAxis,
    /// The present state, but for the tracker, which is as of the last checkpoint.
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

    /// From a checkpoint and the rows since; in words what does not go together.
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
        // What is gathered has not been simulated yet.
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

    /// Every parameter as it was learned and as it is tracked; none while learning.
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

    /// The output at which a change shows most.
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
        // Behind a checkpoint that a new beginning has set: the sample belongs to what follows it.
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
