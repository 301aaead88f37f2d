//! Monitoring: evaluation of scores and noise for each row, and evaluations after an alarm.

use super::{Core, Fed, Following, KEPT, Phase, STRETCH, learning::at_rest};
use crate::{
    Alarm, Each, Innovation, Notice, ScatterAlarm, Stage, Verdict,
    intake::Sample,
    isolate::Kept,
    scatter::{Moved, Scatter},
    watched::Raised,
};

/// After a long gap the levels are unknown for this number of slowest time constants.
const SETTLING: f64 = 6.0;
/// After an alarm the rows are evaluated again after these numbers of slowest time constants.
const LOOKS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 12.0];
/// At the evaluations before this number the covariance of the tracker is increased again: its derivatives are those of constant parameters,
/// and are wrong while the effect of the change propagates through the plant.
const LET_GO: usize = 3;
/// Least number of rows from the alarm to the first evaluation; each later one needs twice as many.
const FEWEST: usize = 8;
/// The model fits again if every score has stayed below this share of the threshold ...
const QUIET: f64 = 0.75;
/// ... for this number of slowest time constants, the longest window of the scores.
const QUIET_FOR: f64 = 6.0;

impl Core {
    /// After a long gap: the collected rows do not continue, and levels are not known.
    pub(super) fn resume(&mut self, sample: &Sample) -> Option<Notice> {
        let Some(learned) = &self.now.learned else {
            if self.now.kept.is_empty() {
                return None;
            }
            let every = self.now.every;
            self.begin(every);
            return Some(Notice::LearnsAnew {
                why: "the rows before the long gap and the rows after it do not form one record",
            });
        };
        if let Phase::Alarmed(following) = &mut self.now.phase {
            // The rows of the beginning do not form a record with later rows.
            following.looks = LOOKS.len();
            following.quiet = 0;
        }
        self.now.settling = (SETTLING * learned.rows_per_time_constant()).ceil() as usize;
        // Measured levels start at their readings, the others at their last values.
        let last = self.now.kept.back();
        let mut states = last.map_or_else(
            || Each::from_slice(&learned.operating),
            |kept| kept.states.clone(),
        );
        self.model.0.put_readings(&mut states, &sample.outputs);
        self.now.kept.clear();
        self.now.judged = 0;
        self.now.scatter.iter_mut().for_each(Scatter::begin);
        self.start(&states, at_rest(sample));
        None
    }

    pub(super) fn watch(&mut self, sample: Sample) -> Fed {
        let growth = self.growth();
        let (Some(running), Some(bank)) = (&mut self.running, &mut self.now.bank) else {
            return Fed::default();
        };
        let said = running.watch.follow(&sample);
        if self.now.kept.len() == KEPT {
            self.now.kept.pop_front();
        }
        let time = sample.time;
        self.now.kept.push_back(said.of(sample));
        let mut fed = Fed::default();
        let finite = |said: &Innovation| said.standardised.is_finite();
        if !said.innovations.iter().flatten().all(finite) {
            // A level has diverged: the learned model cannot be used any more.
            let every = self.now.every;
            self.begin(every);
            fed.notice = Some(Notice::LearnsAnew {
                why: "under these inputs the learned model diverges",
            });
            fed.said = Some(said);
            return fed;
        }
        let settling = self.now.settling;
        if settling > 0 {
            self.now.settling -= 1;
        } else {
            self.now.judged = (self.now.judged + 1).min(self.now.kept.len());
        }
        // A row without a reading contains no information.
        if settling == 0 && said.any() {
            let share = match self.now.phase {
                Phase::Alarmed(_) => QUIET,
                _ => 1.0,
            };
            let passed = running.watch.judge(
                bank,
                running.tracker.as_mut(),
                &running.covariance,
                share * running.threshold,
                (said.step, &growth),
            );
            for (output, innovation) in said.innovations.iter().enumerate() {
                if let Some(innovation) = innovation {
                    let e = innovation.standardised;
                    fed.scatter.extend(self.scatter(output, e, time));
                }
            }
            // Scores computed with the smaller noise are not valid for the larger noise.
            let passed = passed && fed.scatter.is_empty();
            (fed.alarm, fed.notice) = self.judge(passed, time);
        }
        if self.since.len() >= STRETCH {
            self.settle_checkpoint();
        }
        fed.said = Some(said);
        fed
    }

    /// Ratio of the present to the learned noise for each output.
    fn growth(&self) -> Each<f64> {
        self.now.scatter.iter().map(Scatter::growth).collect()
    }

    /// Whether the noise of an output has changed. If an effect explains an alarm, its residual is not noise.
    fn scatter(&mut self, output: usize, innovation: f64, time: f64) -> Option<ScatterAlarm> {
        let (learned, running) = (self.now.learned.as_ref()?, self.running.as_ref()?);
        let scatter = self.now.scatter.get_mut(output)?;
        if matches!(self.now.phase, Phase::Alarmed(following) if following.explained) {
            scatter.begin();
            return None;
        }
        let noise = learned.outputs.get(output)?;
        let moved = scatter.update(innovation, &noise.scatter, running.most.get(output)?)?;
        if let Some(bank) = &mut self.now.bank
            && matches!(moved, Moved::Grown(_))
        {
            // Sums over rows with noise above the assumed level are not valid.
            bank.begin();
        }
        let model = &self.model.0;
        let name = model.output_name(output);
        let noise = noise.model()?.stationary_std();
        let unit = model.output_unit(output, &self.units);
        Some(ScatterAlarm::new(moved, time, name, (noise, unit)))
    }

    /// Reaction to a score above its threshold or, during an alarm, to a score that has not stayed small.
    fn judge(&mut self, passed: bool, time: f64) -> (Option<Alarm>, Option<Notice>) {
        match self.now.phase {
            Phase::Watching if passed && !self.now.scatter.iter().any(Scatter::is_suspicious) => {
                let Some((score, _)) = self.score() else {
                    return (None, None);
                };
                self.now.phase = Phase::Alarmed(Following {
                    score,
                    output: self.most_at().unwrap_or(0),
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

    /// Processes a row after an alarm.
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

    /// Determines the effects that the latest rows are consistent with.
    fn look(&mut self, stage: Stage, time: f64) -> Option<Alarm> {
        let Phase::Alarmed(following) = self.now.phase else {
            return None;
        };
        let (learned, running) = (self.now.learned.as_ref()?, self.running.as_ref()?);
        let from = self.now.kept.len() - self.now.judged;
        let rows: Vec<Kept> = self.now.kept.range(from..).cloned().collect();
        let raised = Raised {
            stage,
            time,
            since: following.since,
            score: following.score,
            threshold: running.threshold,
            output: following.output,
        };
        let (hold, growth) = (self.hold(), self.growth());
        let model = &self.model.0;
        let alarm = model.look(learned, hold, &rows, &growth, &raised, &self.units);
        self.now.phase = Phase::Alarmed(Following {
            explained: alarm.verdict != Verdict::Unexplained,
            ..following
        });
        Some(alarm)
    }
}
