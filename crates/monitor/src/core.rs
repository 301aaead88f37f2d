//! The phases of watching, and how it is saved: learn, watch, alarm, look again, learn anew.
//!
//! **Checkpoints.** Every [`STRETCH`] rows, and whenever the phase changes, all that is not plain numbers (the simulation, the
//! whitening filter, the tracker's factors) is built again from plain numbers and the rows that are kept. A saved
//! state is the last checkpoint and the rows since, and a restored monitor takes these rows again: it does what the one that was
//! never interrupted did, on the same numbers, bit for bit.

use std::collections::VecDeque;

use ct_signals::Hold;
use plants::Structure;
use serde::{Deserialize, Serialize};

use crate::{
    Alarm, Estimate, Model, Notice, Settings, Stage, Units,
    alarm::alarm,
    bank::{Bank, windows},
    intake::{Follows, Sample},
    isolate::{Kept, isolate},
    learn::{Learned, learn, record},
    threshold::{relative_error, threshold},
    tracker::{Tracker, TrackerState},
    watch::{Said, Watch, as_learned, tracked},
};

/// Rows that are kept.
pub(crate) const KEPT: usize = 2048;
/// Rows between checkpoints.
const STRETCH: usize = 2048;
/// Rows on which the simulation settles when it is built again.
const RUN_UP: usize = 1024;
/// After a long gap the levels are not known for so many slowest time constants.
const SETTLING: f64 = 6.0;
/// After an alarm it is looked again, so many slowest time constants later; the last time for good.
const LOOKS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 12.0];
/// At so many of them the tracker is let go again: the derivatives are those of parameters that stay, and while the change works its way
/// through the plant they mislead it.
const LET_GO: usize = 3;
/// A look comes at least so many rows after the alarm, and each later one twice as many.
const FEWEST: usize = 8;
/// Half the width of the interval that holds a Gaussian value with a probability of 95 %.
const BAND: f64 = 1.96;

/// Where the watching is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Rows are gathered; at so many a fit is tried.
    Learning { next: usize },
    /// The learned model is watched.
    Watching,
    /// It does not fit: so many rows ago, and looked at so many times.
    Alarmed {
        score: f64,
        rows: usize,
        looks: usize,
    },
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
    pub tracker: Option<TrackerState>,
}

/// What became of a sample.
#[derive(Default)]
pub(crate) struct Fed {
    pub said: Option<Said>,
    pub notice: Option<Notice>,
    pub alarm: Option<Alarm>,
}

/// What is built from the learned numbers.
struct Running {
    structure: Structure,
    watch: Watch,
    tracker: Option<Tracker>,
    covariance: Vec<f64>,
    threshold: f64,
}

pub(crate) struct Core {
    model: Model,
    settings: Settings,
    units: Units,
    /// The present state, but for the tracker, which is as of the last checkpoint.
    now: Checkpoint,
    running: Option<Running>,
    checkpoint: Checkpoint,
    since: Vec<Sample>,
}

impl Core {
    pub(crate) fn new(model: Model, settings: Settings, units: Units) -> Self {
        let now = Checkpoint {
            phase: Phase::Learning {
                next: settings.learning_rows,
            },
            every: 1,
            kept: VecDeque::with_capacity(KEPT),
            judged: 0,
            settling: 0,
            learned: None,
            bank: None,
            tracker: None,
        };
        Self {
            model,
            settings,
            units,
            checkpoint: now.clone(),
            now,
            running: None,
            since: Vec::with_capacity(STRETCH),
        }
    }

    /// From a checkpoint and the rows since; in words what does not go together.
    pub(crate) fn restore(
        model: Model,
        settings: Settings,
        units: Units,
        checkpoint: Checkpoint,
        since: &[Sample],
    ) -> Result<Self, String> {
        let learning = matches!(checkpoint.phase, Phase::Learning { .. });
        if checkpoint.kept.len() > KEPT
            || checkpoint.judged > checkpoint.kept.len()
            || checkpoint.every == 0
            || since.len() > KEPT + STRETCH
        {
            return Err("it holds more rows than a monitor keeps".into());
        }
        if learning == checkpoint.learned.is_some() || learning == checkpoint.bank.is_some() {
            return Err("what it has learned does not agree with its phase".into());
        }
        let mut core = Self::new(model, settings, units);
        core.now = checkpoint;
        if let Some(learned) = &core.now.learned {
            let parameters = core
                .model
                .structure(learned.scales.clone())
                .map_err(|error| error.to_string())?
                .parameters()
                .len();
            let lanes = crate::sensitivity::lanes(parameters);
            let bank = core.now.bank.as_ref().is_some_and(|b| b.sound(lanes));
            if !learned.sound(parameters) || !bank || core.now.kept.is_empty() {
                return Err("its numbers are not those of this model".into());
            }
        }
        core.checkpoint = core.now.clone();
        if !learning {
            core.build().ok_or("its numbers make no model")?;
        }
        for sample in since {
            core.feed(*sample);
        }
        Ok(core)
    }

    pub(crate) fn saved(&self) -> (&Checkpoint, &[Sample]) {
        (&self.checkpoint, &self.since)
    }

    /// The full range of the command, where it is known.
    pub(crate) fn input_range(&self) -> Option<f64> {
        self.model.known.input_range
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
        let lanes = tracked(learned);
        let estimates: Vec<(f64, f64)> = running
            .tracker
            .as_ref()
            .map_or(Vec::new(), |tracker| tracker.estimates().collect());
        let structure = &running.structure;
        let named = structure.parameter_names().into_iter();
        named
            .zip(&structure.parameters())
            .zip(&learned.theta)
            .enumerate()
            .map(|(i, ((name, info), &learned))| {
                let at = lanes.iter().position(|(lane, _)| *lane == i);
                let tracked = at.and_then(|at| estimates.get(at));
                Estimate {
                    name,
                    unit: structure.unit_label(info, &self.units.output, &self.units.input),
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

    pub(crate) fn feed(&mut self, sample: Sample) -> Fed {
        let mut notice = None;
        match sample.follows {
            Follows::On => {}
            Follows::Interval => self.begin(1),
            Follows::Gap => notice = self.resume(&sample),
        }
        // Behind a checkpoint that a new beginning has set: the sample belongs to what follows it.
        self.since.push(sample);
        let fed = match self.now.phase {
            Phase::Learning { next } => self.gather(sample, next),
            _ => self.watch(sample),
        };
        Fed {
            notice: fed.notice.or(notice),
            ..fed
        }
    }

    /// Begins to learn anew.
    fn begin(&mut self, every: usize) {
        self.now.phase = Phase::Learning {
            next: self.settings.learning_rows,
        };
        self.now.every = every;
        self.now.kept.clear();
        self.now.judged = 0;
        self.now.settling = 0;
        self.now.learned = None;
        self.now.bank = None;
        self.now.tracker = None;
        self.running = None;
        self.set_checkpoint();
    }

    /// After a long gap: what was gathered is no record, and levels are not known.
    fn resume(&mut self, sample: &Sample) -> Option<Notice> {
        match (self.now.phase, &self.now.learned) {
            (Phase::Watching, Some(learned)) => {
                self.now.settling = (SETTLING * learned.rows_per_time_constant()).ceil() as usize;
                // The last vessel is read; the others are taken where they were.
                let mut levels = self
                    .now
                    .kept
                    .back()
                    .map_or(learned.scales.operating_level, |k| k.levels);
                let last = self.model.plant.vessels() - 1;
                levels[last] = sample.output;
                self.now.kept.clear();
                self.now.judged = 0;
                self.start(&levels, sample.input);
                None
            }
            _ if self.now.kept.is_empty() => None,
            _ => {
                let every = self.now.every;
                self.begin(every);
                Some(Notice::LearnsAnew {
                    why: "what was gathered before the long gap is no record with what follows",
                })
            }
        }
    }

    fn set_checkpoint(&mut self) {
        self.since.clear();
        self.checkpoint.clone_from(&self.now);
    }

    fn hold(&self) -> Hold {
        if self.now.every > 1 {
            Hold::First
        } else {
            self.model.hold
        }
    }

    /// Gathers a row to learn from; a fit is tried at `next` rows.
    fn gather(&mut self, sample: Sample, next: usize) -> Fed {
        self.now.kept.push_back(Kept {
            sample,
            levels: [0.0; plants::MAX_VESSELS],
            stands: sample.input,
            innovation: 0.0,
        });
        if self.now.kept.len() < next.min(KEPT) {
            return Fed::default();
        }
        let records = [record(
            self.now.kept.iter().map(|kept| &kept.sample),
            self.hold(),
        )];
        let notice = match learn(&self.model, &records) {
            Err(why) => {
                // The older half goes: what comes next may say more.
                self.later(2 * next, |kept| {
                    kept.drain(..KEPT / 2);
                });
                Some(Notice::NotLearned { why })
            }
            Ok((learned, levels)) => {
                let span = records[0].duration();
                let needed = self.settings.learning_time_constants * learned.time_constant;
                if span < needed {
                    let full = self.now.kept.len() == KEPT;
                    let rows = self.now.kept.len() as f64 * needed / span;
                    // A little more, for the estimate of the time constant moves.
                    self.later((1.02 * rows).ceil() as usize, halve);
                    if full {
                        self.now.every *= 2;
                        self.set_checkpoint();
                    }
                    None
                } else {
                    self.take_over(learned, &levels)
                }
            }
        };
        Fed {
            notice,
            ..Fed::default()
        }
    }

    /// Puts the next try off to so many rows; where no more fit in, room is made.
    fn later(&mut self, next: usize, room: impl FnOnce(&mut VecDeque<Kept>)) {
        let next = if self.now.kept.len() < KEPT {
            next.min(KEPT)
        } else {
            room(&mut self.now.kept);
            KEPT
        };
        self.now.phase = Phase::Learning { next };
        if self.now.kept.len() < KEPT && self.since.len() >= KEPT {
            self.set_checkpoint();
        }
    }

    /// The learned model is run over the rows that it was learned from, and watched from now on.
    fn take_over(&mut self, learned: Learned, levels: &[f64]) -> Option<Notice> {
        let (rows, time_constant) = (learned.rows * self.now.every, learned.time_constant);
        let noise = learned.noise()?.stationary_std();
        let unit = learned.rows_per_time_constant();
        let lanes = crate::sensitivity::lanes(learned.theta.len());
        self.now.bank = Some(Bank::new(unit, lanes));
        self.now.tracker = Some(as_learned(&learned));
        self.now.learned = Some(learned);
        self.now.phase = Phase::Watching;
        self.now.settling = 0;
        let at_rest = self.now.kept.front()?.sample.input;
        self.start(levels, at_rest);
        let mut kept = std::mem::take(&mut self.now.kept);
        if let Some(running) = &mut self.running {
            for kept in &mut kept {
                let said = running.watch.follow(&kept.sample);
                kept.levels = said.levels;
                kept.stands = said.stands;
                kept.innovation = said.innovation;
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

    /// Builds what runs, from given levels on.
    fn start(&mut self, levels: &[f64], at_rest: f64) {
        self.running = self.running_from(levels, at_rest);
    }

    fn running_from(&self, levels: &[f64], at_rest: f64) -> Option<Running> {
        let learned = self.now.learned.as_ref()?;
        let bank = self.now.bank.as_ref()?;
        let structure = self.model.structure(learned.scales.clone()).ok()?;
        let watch = Watch::new(&structure, learned, self.hold(), levels, at_rest)?;
        let memory = self.settings.memory * learned.time_constant;
        let tracker = self
            .now
            .tracker
            .as_ref()
            .and_then(|state| Tracker::new(state, &tracked(learned), memory));
        let lanes: Vec<usize> = (0..bank.directions() - 1).collect();
        let threshold = threshold(
            &windows(learned.rows_per_time_constant()),
            bank.directions(),
            self.settings.rows_between_false_alarms,
            relative_error(&learned.noise()?, learned.rows),
        );
        Some(Running {
            structure,
            watch,
            tracker,
            covariance: learned.covariance_of(&lanes),
            threshold,
        })
    }

    /// A checkpoint, and everything built again from it.
    fn settle_checkpoint(&mut self) {
        if let Some(tracker) = self.running.as_ref().and_then(|r| r.tracker.as_ref()) {
            self.now.tracker = Some(tracker.state());
        }
        self.set_checkpoint();
        self.build();
    }

    /// A checkpoint after which the tracker finds the parameters again: they have jumped.
    fn let_go(&mut self) {
        self.settle_checkpoint();
        if let Some(tracker) = &mut self.now.tracker {
            tracker.open();
        }
        self.set_checkpoint();
        self.build();
    }

    /// Builds what runs from the present numbers and the kept rows.
    fn build(&mut self) -> Option<()> {
        let from = self.now.kept.len().saturating_sub(RUN_UP);
        let first = self.now.kept.get(from)?;
        let mut running = self.running_from(&first.levels, first.stands)?;
        for kept in self.now.kept.range(from..) {
            running.watch.follow(&kept.sample);
        }
        self.running = Some(running);
        Some(())
    }

    fn watch(&mut self, sample: Sample) -> Fed {
        let (Some(running), Some(bank)) = (&mut self.running, &mut self.now.bank) else {
            return Fed::default();
        };
        let said = running.watch.follow(&sample);
        if self.now.kept.len() == KEPT {
            self.now.kept.pop_front();
        }
        self.now.kept.push_back(Kept {
            sample,
            levels: said.levels,
            stands: said.stands,
            innovation: said.innovation,
        });
        let mut fed = Fed {
            said: Some(said),
            ..Fed::default()
        };
        if !said.innovation.is_finite() {
            // A level that left all bounds: what was learned is of no use any more.
            let every = self.now.every;
            self.begin(every);
            fed.notice = Some(Notice::LearnsAnew {
                why: "under these commands the learned model leaves all bounds",
            });
            return fed;
        }
        if self.now.settling > 0 {
            self.now.settling -= 1;
        } else {
            self.now.judged = (self.now.judged + 1).min(self.now.kept.len());
            let passed = running.watch.judge(
                bank,
                running.tracker.as_mut(),
                &running.covariance,
                running.threshold,
                said.step,
            );
            fed.alarm = self.judge(passed, sample.time);
        }
        if self.since.len() >= STRETCH {
            self.settle_checkpoint();
        }
        fed
    }

    /// What follows from whether a score has passed.
    fn judge(&mut self, passed: bool, time: f64) -> Option<Alarm> {
        match &mut self.now.phase {
            Phase::Watching if passed => {
                let score = self.score()?.0;
                self.now.phase = Phase::Alarmed {
                    score,
                    rows: 0,
                    looks: 0,
                };
                let alarm = self.look(Stage::Alarm, score, time);
                self.let_go();
                alarm
            }
            Phase::Alarmed { score, rows, looks } => {
                *rows += 1;
                let (score, rows, at) = (*score, *rows, *looks);
                let unit = self.now.learned.as_ref()?.rows_per_time_constant();
                let due = (LOOKS.get(at)? * unit).ceil() as usize;
                if rows < due.max(FEWEST << at) {
                    return None;
                }
                *looks += 1;
                if at + 1 < LOOKS.len() {
                    let alarm = self.look(Stage::Update, score, time);
                    if at < LET_GO {
                        self.let_go();
                    } else {
                        self.settle_checkpoint();
                    }
                    return alarm;
                }
                let alarm = self.look(Stage::Final, score, time);
                let every = self.now.every;
                self.begin(every);
                alarm
            }
            _ => None,
        }
    }

    /// Looks which effect the latest rows are consistent with.
    fn look(&self, stage: Stage, score: f64, time: f64) -> Option<Alarm> {
        let (learned, running) = (self.now.learned.as_ref()?, self.running.as_ref()?);
        let from = self.now.kept.len() - self.now.judged;
        let rows: Vec<Kept> = self.now.kept.range(from..).copied().collect();
        let suspects = isolate(&running.structure, learned, self.hold(), &rows);
        Some(alarm(
            (stage, time),
            (score, running.threshold),
            &suspects,
            &running.structure,
            &self.units,
        ))
    }
}

/// Means of pairs of rows.
fn halve(kept: &mut VecDeque<Kept>) {
    let pairs = kept.len() / 2;
    for i in 0..pairs {
        let (a, b) = (kept[2 * i].sample, kept[2 * i + 1].sample);
        kept[i].sample = Sample {
            time: 0.5 * (a.time + b.time),
            input: 0.5 * (a.input + b.input),
            output: 0.5 * (a.output + b.output),
            follows: a.follows,
        };
    }
    kept.truncate(pairs);
}
