//! Watching: what scores and scatter say of a row, and the looks after an alarm.

use super::{Core, Fed, Following, KEPT, Phase, STRETCH};
use crate::{
    Alarm, Notice, ScatterAlarm, Stage, Verdict,
    alarm::alarm,
    bank::Bank,
    intake::Sample,
    isolate::{Kept, isolate},
    scatter::Moved,
};

/// After a long gap the levels are not known for so many slowest time constants.
const SETTLING: f64 = 6.0;
/// After an alarm it is looked again, so many slowest time constants later.
const LOOKS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 12.0];
/// At so many of them the tracker is let go again: the derivatives are those of parameters that stay, and while the change works its way
/// through the plant they mislead it.
const LET_GO: usize = 3;
/// A look comes at least so many rows after the alarm, and each later one twice as many.
const FEWEST: usize = 8;
/// The model fits again where every score has stayed below this share of the threshold ...
const QUIET: f64 = 0.75;
/// ... for so many slowest time constants, the longest window of the scores.
const QUIET_FOR: f64 = 6.0;

impl Core {
    /// After a long gap: what was gathered is no record, and levels are not known.
    pub(super) fn resume(&mut self, sample: &Sample) -> Option<Notice> {
        let Some(learned) = &self.now.learned else {
            if self.now.kept.is_empty() {
                return None;
            }
            let every = self.now.every;
            self.begin(every);
            return Some(Notice::LearnsAnew {
                why: "what was gathered before the long gap is no record with what follows",
            });
        };
        if let Phase::Alarmed(following) = &mut self.now.phase {
            // The rows in which it began are no record with what follows.
            following.looks = LOOKS.len();
            following.quiet = 0;
        }
        self.now.settling = (SETTLING * learned.rows_per_time_constant()).ceil() as usize;
        // The last vessel is read; the others are taken where they were.
        let mut levels = self
            .now
            .kept
            .back()
            .map_or(learned.scales.operating_level, |k| k.levels);
        let last = self.model.plant.vessels() - 1;
        if let Some(output) = sample.output {
            levels[last] = output;
        }
        self.now.kept.clear();
        self.now.judged = 0;
        self.now.scatter.begin();
        self.start(&levels, sample.input);
        None
    }

    pub(super) fn watch(&mut self, sample: Sample) -> Fed {
        let (Some(running), Some(bank)) = (&mut self.running, &mut self.now.bank) else {
            return Fed::default();
        };
        let said = running.watch.follow(&sample);
        if self.now.kept.len() == KEPT {
            self.now.kept.pop_front();
        }
        self.now.kept.push_back(said.of(sample));
        let mut fed = Fed {
            said: Some(said),
            ..Fed::default()
        };
        if said
            .innovation
            .is_some_and(|said| !said.standardised.is_finite())
        {
            // A level that left all bounds: what was learned is of no use any more.
            let every = self.now.every;
            self.begin(every);
            fed.notice = Some(Notice::LearnsAnew {
                why: "under these commands the learned model leaves all bounds",
            });
            return fed;
        }
        let settling = self.now.settling;
        if settling > 0 {
            self.now.settling -= 1;
        } else {
            self.now.judged = (self.now.judged + 1).min(self.now.kept.len());
        }
        // A row without a reading says nothing.
        if let (0, Some(innovation)) = (settling, said.innovation) {
            let share = match self.now.phase {
                Phase::Alarmed(_) => QUIET,
                _ => 1.0,
            };
            let passed = running.watch.judge(
                bank,
                running.tracker.as_mut(),
                &running.covariance,
                share * running.threshold,
                (said.step, self.now.scatter.growth()),
            );
            fed.scatter = self.scatter(innovation.standardised, sample.time);
            // A score of the smaller noise says nothing of the larger.
            let passed = passed && fed.scatter.is_none();
            (fed.alarm, fed.notice) = self.judge(passed, sample.time);
        }
        if self.since.len() >= STRETCH {
            self.settle_checkpoint();
        }
        fed
    }

    /// Whether the scatter has moved. Where an effect explains an alarm, its residual is no noise.
    fn scatter(&mut self, innovation: f64, time: f64) -> Option<ScatterAlarm> {
        let (learned, running) = (self.now.learned.as_ref()?, self.running.as_ref()?);
        if matches!(self.now.phase, Phase::Alarmed(following) if following.explained) {
            self.now.scatter.begin();
            return None;
        }
        let scatter = &mut self.now.scatter;
        let moved = scatter.update(innovation, &learned.scatter, &running.most)?;
        if let Some(bank) = &mut self.now.bank
            && matches!(moved, Moved::Grown(_))
        {
            // What was summed up of larger noise than was reckoned with says nothing.
            *bank = Bank::new(learned.rows_per_time_constant(), bank.directions() - 1);
        }
        let noise = learned.noise()?.stationary_std();
        Some(ScatterAlarm::new(moved, time, noise, &self.units))
    }

    /// What follows from whether a score has passed, or, while an alarm is followed, has not stayed small.
    fn judge(&mut self, passed: bool, time: f64) -> (Option<Alarm>, Option<Notice>) {
        match self.now.phase {
            Phase::Watching if passed && !self.now.scatter.is_suspicious() => {
                let Some((score, _)) = self.score() else {
                    return (None, None);
                };
                self.now.phase = Phase::Alarmed(Following {
                    score,
                    since: time,
                    rows: 0,
                    looks: 0,
                    explained: false,
                    quiet: 0,
                });
                let alarm = self.look(Stage::Alarm, time);
                self.let_go();
                (alarm, None)
            }
            Phase::Alarmed(following) => self.follow(following, passed, time),
            _ => (None, None),
        }
    }

    /// A row after an alarm.
    fn follow(
        &mut self,
        following: Following,
        passed: bool,
        time: f64,
    ) -> (Option<Alarm>, Option<Notice>) {
        let Some(learned) = &self.now.learned else {
            return (None, None);
        };
        let unit = learned.rows_per_time_constant();
        let (rows, at) = (following.rows + 1, following.looks);
        let quiet = if passed { 0 } else { following.quiet + 1 };
        self.now.phase = Phase::Alarmed(Following {
            rows,
            quiet,
            ..following
        });
        if quiet as f64 >= QUIET_FOR * unit.max(FEWEST as f64) {
            self.now.phase = Phase::Watching;
            self.let_go();
            let since = following.since;
            return (None, Some(Notice::FitsAgain { time, since }));
        }
        let Some(look) = LOOKS.get(at) else {
            return (None, None);
        };
        if rows < ((look * unit).ceil() as usize).max(FEWEST << at) {
            return (None, None);
        }
        self.now.phase = Phase::Alarmed(Following {
            rows,
            quiet,
            looks: at + 1,
            ..following
        });
        let stage = if at + 1 < LOOKS.len() {
            Stage::Update
        } else {
            Stage::Final
        };
        let alarm = self.look(stage, time);
        if at < LET_GO {
            self.let_go();
        } else {
            self.settle_checkpoint();
        }
        (alarm, None)
    }

    /// Looks which effect the latest rows are consistent with.
    fn look(&mut self, stage: Stage, time: f64) -> Option<Alarm> {
        let Phase::Alarmed(following) = self.now.phase else {
            return None;
        };
        let (learned, running) = (self.now.learned.as_ref()?, self.running.as_ref()?);
        let from = self.now.kept.len() - self.now.judged;
        let rows: Vec<Kept> = self.now.kept.range(from..).copied().collect();
        let growth = self.now.scatter.growth();
        let suspects = isolate(&running.structure, learned, self.hold(), &rows, growth);
        let alarm = alarm(
            (stage, time, following.since),
            (following.score, running.threshold),
            &suspects,
            &running.structure,
            &self.units,
        );
        self.now.phase = Phase::Alarmed(Following {
            explained: alarm.verdict != Verdict::Unexplained,
            ..following
        });
        Some(alarm)
    }
}
