//! The monitor: rows in; innovations, estimates, notices and alarms out.

mod progress;

use plants::Domain;
use serde::{Deserialize, Serialize};

use smallvec::SmallVec;

pub use self::progress::{Estimate, Gathered, Progress};
use crate::{
    Alarm, Error, NotUsed, ScatterAlarm, Settings, TimeAxis, Units, Watched,
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
    /// Readings in the order of the outputs \[their units\], taken before the inputs act. NaN for a missing one: the inputs and the other
    /// readings of the row are still used.
    pub outputs: Each<f64>,
}

impl Row {
    /// A row of time \[s\], the only input \[its unit\] and readings \[their units\]; outputs without a reading count as missing, and
    /// readings after the last output are ignored.
    #[must_use]
    pub fn new(time: f64, input: f64, readings: &[f64]) -> Self {
        Self::with_inputs(time, &[input], readings)
    }

    /// A sample with any number of inputs.
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

/// Result of a row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowResult {
    /// The innovation of each output; `None` while learning, within a block of rows, and without a reading.
    pub innovations: Each<Option<Innovation>>,
    /// For each output the reason why its reading is not used, if so; the inputs are used.
    pub lost: Each<Option<NotUsed>>,
    /// Notices about the rows or the phase.
    pub notices: [Option<Notice>; 2],
    /// Alarm that the model does not fit any more, or an update of an alarm.
    pub alarm: Option<Alarm>,
    /// Outputs whose noise has increased, or is back at the learned level.
    pub scatter: Vec<ScatterAlarm>,
}

/// Prediction error of the learned model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured minus the model's simulation from the command alone \[output unit\].
    pub residual: f64,
    /// Innovation in standard deviations: the part of the residual that its past does not predict.
    pub standardised: f64,
}

/// Notice that is not an alarm.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// Rows are missing.
    Gap {
        /// Time of the row before \[s\].
        from: f64,
        /// Time of the row after it \[s\].
        to: f64,
        /// Number of missing rows.
        missing: u64,
        /// Whether the command is assumed to have been held; otherwise the monitor waits until the levels have settled.
        bridged: bool,
    },
    /// The clock was set back, as 100 consecutive rows show: these rows are used from here on, as after a long gap.
    ClockSetBack {
        /// The latest time before \[s\].
        from: f64,
        /// The time now \[s\].
        to: f64,
    },
    /// The time step has changed: the noise is learned again.
    IntervalChanged {
        /// Time of the change \[s\].
        time: f64,
        /// The usual step before \[s\].
        from: f64,
        /// The usual step now \[s\].
        to: f64,
    },
    /// Learning is finished.
    Learned {
        /// Number of rows.
        rows: usize,
        /// The slowest time constant \[s\].
        time_constant: f64,
        /// Standard deviation of the noise at each output \[output unit\].
        noise: Vec<f64>,
        /// Number of rows in a block.
        every: usize,
        /// Threshold of a score; far above 6 if the noise is so slow that these rows hardly determine its variance.
        threshold: f64,
    },
    /// After an alarm, the learned model fits again.
    FitsAgain {
        /// Now \[s\].
        time: f64,
        /// Time of the alarm \[s\].
        since: f64,
    },
    /// The collected rows or the learned model are dropped, and a present alarm ends.
    LearnsAnew {
        /// Why.
        why: &'static str,
    },
    /// The rows so far do not determine the model; learning continues.
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

    /// Seconds in one unit of the time of a user's own model, as saved in the state.
    #[must_use]
    pub fn time_unit(&self) -> Option<f64> {
        self.model.get(TIME_UNIT)?.parse().ok()
    }
}

/// A monitor; it owns its model.
pub struct Monitor {
    model: Watched,
    intake: Intake,
    core: Core,
    fingerprint: Fingerprint,
    units: Units,
}

impl Monitor {
    /// A new monitor of a [`Model`](crate::Model) of a plant or an [`OwnModel`](crate::OwnModel).
    ///
    /// `units` are those of a plant's rows; a user's own model has units itself.
    ///
    /// # Errors
    /// [`Error::Setting`]; of a plant [`Error::TwoPumps`], [`Error::Disturbance`], [`Error::ByClock`] for an effect in the model that follows
    /// the time since a record began, [`Error::Structure`]; of a user's own model [`Error::Time`], [`Error::NoParameters`].
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

    /// Continues a saved monitor; with the same model and settings all results are the same, bit for bit.
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
                what: "its counts of rows are inconsistent".into(),
            });
        }
        monitor.core = Core::restore(model, settings, state.units, state.checkpoint, &state.since)
            .map_err(|what| Error::Damaged { what })?;
        monitor.core.axis = state.axis;
        monitor.intake = state.intake;
        Ok(monitor)
    }

    /// Format of times in sentences; a restored monitor keeps its format.
    #[must_use]
    pub fn axis(&self) -> &TimeAxis {
        &self.core.axis
    }

    /// Sets the date of time zero; call it before the first row.
    pub fn set_axis(&mut self, axis: TimeAxis) {
        self.core.axis = axis;
    }

    /// The domain of a plant, with its words for sentences; `None` for a user's own model.
    #[must_use]
    pub fn domain(&self) -> Option<Domain> {
        self.model.0.domain(&self.units)
    }

    /// Complete state, for saving.
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

    /// Processes a row.
    ///
    /// A reading that is not finite, too large, or far above the tank is lost ([`RowResult::lost`]): the model moves on under the row's command,
    /// and no test uses a missing reading.
    ///
    /// # Errors
    /// [`NotUsed`]: time or command cannot be used, and the row is not.
    pub fn update(&mut self, row: &Row) -> Result<RowResult, NotUsed> {
        let model = &self.model.0;
        let mut readings = Readings::new();
        let mut step = RowResult::default();
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

    /// Number of rows since the beginning, including rows before a restoration.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.intake.rows
    }

    /// Time of the latest row \[s\], also from before a restoration.
    #[must_use]
    pub fn last_time(&self) -> Option<f64> {
        self.intake.last
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.model.0.outputs()
    }

    /// The tracked parameters with their bands; empty while learning. Allocates.
    #[must_use]
    pub fn estimates(&self) -> Vec<Estimate> {
        self.core.estimates()
    }

    /// Rows collected for learning; `None` if learning is finished.
    #[must_use]
    pub fn gathered(&self) -> Option<Gathered> {
        self.core.gathered()
    }

    /// Phase and progress.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let (score, threshold) = self.core.score().unwrap_or((f64::NAN, f64::NAN));
        match self.core.phase() {
            Phase::Learning { .. } => Progress::Learning(self.core.kept()),
            Phase::Watching => Progress::Watching { score, threshold },
            Phase::Alarmed(_) => Progress::Alarmed { score, threshold },
        }
    }

    /// The slowest learned time constant \[s\].
    #[must_use]
    pub fn time_constant(&self) -> Option<f64> {
        Some(self.core.learned()?.time_constant)
    }
}
