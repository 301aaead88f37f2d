//! The monitor: rows in; innovations, estimates, notices and alarms out.

mod progress;

use serde::{Deserialize, Serialize};

use smallvec::SmallVec;

pub use self::progress::{Estimate, Gathered, Progress};
use crate::{
    Alarm, Error, Refused, ScatterAlarm, Settings, TimeAxis, Units, Watched,
    core::{Checkpoint, Core, Phase},
    fingerprint::{Fingerprint, TIME_UNIT, differences},
    intake::{Intake, Readings, Sample, usable},
};

/// A value for each input, output or state; nothing is allocated for eight or fewer.
pub type Each<T> = SmallVec<[T; 8]>;
/// The version of [`State`].
const VERSION: u32 = 6;

/// A row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Time \[s\], above that of the row before.
    pub time: f64,
    /// Inputs in the order of the model \[their units\].
    pub inputs: Each<f64>,
    /// Readings in the order of the outputs \[their units\], made before the inputs act. NaN where one is lost: the inputs and the other
    /// readings of the row are used all the same.
    pub outputs: Each<f64>,
}

impl Row {
    /// A row of time \[s\], the only input \[its unit\] and readings \[their units\]; outputs without one have lost it, and readings behind
    /// the last output are not looked at.
    #[must_use]
    pub fn new(time: f64, input: f64, readings: &[f64]) -> Self {
        Self::with_inputs(time, &[input], readings)
    }

    /// The same with any number of inputs.
    #[must_use]
    pub fn with_inputs(time: f64, inputs: &[f64], readings: &[f64]) -> Self {
        Self {
            time,
            inputs: Each::from_slice(inputs),
            outputs: Each::from_slice(readings),
        }
    }

    /// An input; NaN where the row has none.
    pub(crate) fn input(&self, at: usize) -> f64 {
        self.inputs.get(at).copied().unwrap_or(f64::NAN)
    }
}

/// What a row says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Step {
    /// The learned model beside the reading of each output; `None` while learning, within a block of rows, and without a reading.
    pub innovations: Each<Option<Innovation>>,
    /// Of each output why its reading is not used, where it is not; the inputs are.
    pub lost: Each<Option<Refused>>,
    /// Something about the rows or the phase, where there is something.
    pub notices: [Option<Notice>; 2],
    /// The model does not fit any more, or more is known of that.
    pub alarm: Option<Alarm>,
    /// Outputs whose noise has grown, or is back where it was.
    pub scatter: Vec<ScatterAlarm>,
}

/// The learned model beside a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured minus model, which runs on the command alone \[output unit\].
    pub residual: f64,
    /// What of it the noise's past does not foretell, in standard deviations.
    pub standardised: f64,
}

/// Something that is not an alarm.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// Rows are missing.
    Gap {
        /// Time of the row before \[s\].
        from: f64,
        /// Time of the row behind it \[s\].
        to: f64,
        /// How many.
        missing: u64,
        /// The command is taken to have been held; else what is not known of the levels is waited for.
        bridged: bool,
    },
    /// The clock was set back, as 100 rows in a row say: they are followed from here on, as behind a long gap.
    ClockSetBack {
        /// The latest time before \[s\].
        from: f64,
        /// The time now \[s\].
        to: f64,
    },
    /// The time steps by another interval now: the noise is learned anew.
    IntervalChanged {
        /// Since when \[s\].
        time: f64,
        /// The usual step before \[s\].
        from: f64,
        /// The usual step now \[s\].
        to: f64,
    },
    /// The learning is over.
    Learned {
        /// From so many rows.
        rows: usize,
        /// The slowest time constant \[s\].
        time_constant: f64,
        /// Standard deviation of the noise at each output \[output unit\].
        noise: Vec<f64>,
        /// Rows are watched in blocks of so many.
        every: usize,
        /// What a score has to pass; far above 6 where the noise is so slow that these rows hardly say how large it is.
        threshold: f64,
    },
    /// After an alarm the learned model fits again.
    FitsAgain {
        /// Now \[s\].
        time: f64,
        /// When the alarm was raised \[s\].
        since: f64,
    },
    /// What was gathered or learned is given up, and an alarm that was being followed ends.
    LearnsAnew {
        /// Why.
        why: &'static str,
    },
    /// The rows so far do not determine the model; it goes on learning.
    NotLearned {
        /// Why.
        why: String,
    },
}

/// A saved monitor: all of it, for [`Monitor::restore`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    version: u32,
    model: Fingerprint,
    units: Units,
    #[serde(default, skip_serializing_if = "TimeAxis::is_seconds")]
    axis: TimeAxis,
    intake: Intake,
    checkpoint: Checkpoint,
    since: Vec<Sample>,
}

impl State {
    /// The units of the signals when it was saved.
    #[must_use]
    pub fn units(&self) -> &Units {
        &self.units
    }

    /// Seconds in one unit of the time of a model of its user's own, as the state has it.
    #[must_use]
    pub fn time_unit(&self) -> Option<f64> {
        self.model.get(TIME_UNIT)?.parse().ok()
    }
}

/// A monitor; it owns a share of what it watches.
pub struct Monitor {
    model: Watched,
    intake: Intake,
    core: Core,
    fingerprint: Fingerprint,
    units: Units,
}

impl Monitor {
    /// A monitor that has seen nothing yet, of a [`Model`](crate::Model) of a plant or an [`OwnModel`](crate::OwnModel).
    ///
    /// `units` are those of a plant's rows; a model of its user's own has units itself.
    ///
    /// # Errors
    /// [`Error::Setting`]; of a plant [`Error::TwoPumps`], [`Error::Disturbance`], [`Error::ByClock`] for an effect in the model that follows
    /// the time since a record began, [`Error::Structure`]; of a model of its user's own [`Error::Time`], [`Error::NoParameters`].
    pub fn new(model: impl Into<Watched>, settings: Settings, units: Units) -> Result<Self, Error> {
        settings.check()?;
        let model: Watched = model.into();
        model.0.check()?;
        Ok(Self {
            intake: Intake::new(model.0.inputs(), model.0.outputs()),
            fingerprint: model.0.fingerprint(),
            core: Core::new(model.clone(), settings, units.clone()),
            units,
            model,
        })
    }

    /// Goes on where a saved monitor was; with the same model and settings what follows is the same, bit for bit.
    ///
    /// # Errors
    /// As [`Monitor::new`], and [`Error::Version`], [`Error::OtherModel`], [`Error::Damaged`].
    pub fn restore(
        model: impl Into<Watched>,
        settings: Settings,
        state: State,
    ) -> Result<Self, Error> {
        let mut monitor = Self::new(model, settings, state.units.clone())?;
        let model = monitor.model.clone();
        if state.version != VERSION {
            return Err(Error::Version {
                found: state.version,
                known: VERSION,
            });
        }
        if state.model != monitor.fingerprint {
            return Err(Error::OtherModel {
                differences: differences(&state.model, &monitor.fingerprint),
            });
        }
        if !state.intake.sound(model.0.inputs(), model.0.outputs()) {
            return Err(Error::Damaged {
                what: "its counts of rows do not go together".into(),
            });
        }
        monitor.core = Core::restore(model, settings, state.units, state.checkpoint, &state.since)
            .map_err(|what| Error::Damaged { what })?;
        monitor.core.axis = state.axis;
        monitor.intake = state.intake;
        Ok(monitor)
    }

    /// How times are said in sentences; a restored monitor goes on as before.
    #[must_use]
    pub fn axis(&self) -> &TimeAxis {
        &self.core.axis
    }

    /// Says when the times of the rows are zero: to be known before the first row.
    pub fn set_axis(&mut self, axis: TimeAxis) {
        self.core.axis = axis;
    }

    /// All of it, to be saved.
    #[must_use]
    pub fn state(&self) -> State {
        let (checkpoint, since) = self.core.saved();
        State {
            version: VERSION,
            model: self.fingerprint.clone(),
            units: self.units.clone(),
            axis: self.core.axis.clone(),
            intake: self.intake.clone(),
            checkpoint: checkpoint.clone(),
            since: since.to_vec(),
        }
    }

    /// Takes in a row.
    ///
    /// A reading that is not finite, too large, or far above the tank is lost ([`Step::lost`]): the model moves on under the row's command, and
    /// nothing is judged by what is lost.
    ///
    /// # Errors
    /// [`Refused`]: time or command cannot be used, and the row is not.
    pub fn update(&mut self, row: &Row) -> Result<Step, Refused> {
        let model = &self.model.0;
        let mut readings = Readings::new();
        let mut step = Step::default();
        for output in 0..model.outputs() {
            let value = row.outputs.get(output).copied().unwrap_or(f64::NAN);
            let reading = model
                .check_reading(value)
                .and_then(|()| usable("output", output, value));
            readings.push(reading.as_ref().ok().copied());
            step.lost.push(reading.err());
            step.innovations.push(None);
        }
        for input in 0..model.inputs() {
            model.check_input(row.input(input))?;
        }
        let taken = self.intake.take(row, &readings)?;
        step.notices[0] = taken.notice;
        if let Some(sample) = taken.sample {
            let fed = self.core.feed(sample);
            if let Some(said) = fed.said {
                step.innovations = said.innovations;
            }
            step.notices[1] = fed.notice;
            step.alarm = fed.alarm;
            step.scatter = fed.scatter;
            if self.core.every() != self.intake.every {
                self.intake.every = self.core.every();
                self.intake.begin();
            }
        }
        Ok(step)
    }

    /// Rows that were taken since the beginning, before a restoration too.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.intake.rows
    }

    /// Time of the latest row that was taken \[s\], before a restoration too.
    #[must_use]
    pub fn last_time(&self) -> Option<f64> {
        self.intake.last
    }

    /// How many outputs there are.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.model.0.outputs()
    }

    /// The parameters as they are tracked, with their band; empty while learning. Allocates.
    #[must_use]
    pub fn estimates(&self) -> Vec<Estimate> {
        self.core.estimates()
    }

    /// What there is to learn from; `None` where the learning is over.
    #[must_use]
    pub fn gathered(&self) -> Option<Gathered> {
        self.core.gathered()
    }

    /// Where it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let (score, threshold) = self.core.score().unwrap_or((f64::NAN, f64::NAN));
        match self.core.phase() {
            Phase::Learning { .. } => Progress::Learning(self.core.kept()),
            Phase::Watching => Progress::Watching { score, threshold },
            Phase::Alarmed(_) => Progress::Alarmed { score, threshold },
        }
    }

    /// The slowest time constant that was learned \[s\].
    #[must_use]
    pub fn time_constant(&self) -> Option<f64> {
        Some(self.core.learned()?.time_constant)
    }
}
