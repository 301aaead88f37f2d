//! The monitor: rows in; innovations, estimates, notices and alarms out.

use serde::{Deserialize, Serialize};

use crate::{
    Alarm, Error, Model, Refused, ScatterAlarm, Settings, TimeAxis, Units,
    core::{Checkpoint, Core, Phase},
    fingerprint::{Fingerprint, differences, fingerprint},
    intake::{Intake, Sample, usable},
};

/// The most outputs that are watched.
pub const MAX_OUTPUTS: usize = plants::MAX_VESSELS;
/// The version of [`State`].
const VERSION: u32 = 5;
/// A command above so many times its full range is in another unit, or none, as in a record.
const BEYOND: f64 = 1.01;
/// A reading above so many times the tank's height is in another unit, or none; below it a sensor may be off, which is to be seen.
const ABOVE: f64 = 1.5;

/// A row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time \[s\], above that of the row before.
    pub time: f64,
    /// Command \[input unit\].
    pub input: f64,
    /// Readings in the order of the outputs \[output unit\], made before the command acts. NaN where one is lost: the command and the other
    /// readings of the row are used all the same. Entries behind the last output are not looked at.
    pub outputs: [f64; MAX_OUTPUTS],
}

impl Row {
    /// A row of time \[s\], command \[input unit\] and readings \[output unit\]; outputs without one have lost it, and readings behind
    /// [`MAX_OUTPUTS`] are left out.
    #[must_use]
    pub fn new(time: f64, input: f64, readings: &[f64]) -> Self {
        let mut outputs = [f64::NAN; MAX_OUTPUTS];
        for (output, reading) in outputs.iter_mut().zip(readings) {
            *output = *reading;
        }
        Self {
            time,
            input,
            outputs,
        }
    }
}

/// What a row says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Step {
    /// The learned model beside the reading of each output; `None` while learning, within a block of rows, and without a reading.
    pub innovations: [Option<Innovation>; MAX_OUTPUTS],
    /// Why the reading of an output is not used, where it is not; the command is.
    pub lost: [Option<Refused>; MAX_OUTPUTS],
    /// Something about the rows or the phase, where there is something.
    pub notices: [Option<Notice>; 2],
    /// The model does not fit any more, or more is known of that.
    pub alarm: Option<Alarm>,
    /// The noise of an output has grown, or is back where it was.
    pub scatter: [Option<ScatterAlarm>; MAX_OUTPUTS],
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

/// A parameter as it is tracked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// As it was learned.
    pub learned: f64,
    /// As it is now.
    pub value: f64,
    /// Half the width of the 95 % interval; `None` for one that is fixed.
    pub half_width: Option<f64>,
}

/// Where the monitor is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// It learns, and has so many rows (or blocks of rows).
    Learning(usize),
    /// The learned model is watched: the largest score now and the threshold.
    Watching {
        /// The largest score, by magnitude.
        score: f64,
        /// What it has to pass.
        threshold: f64,
    },
    /// The model does not fit: the same.
    Alarmed {
        /// The largest score, by magnitude.
        score: f64,
        /// What it had to pass.
        threshold: f64,
    },
}

/// What is there to learn from, and what is needed at least before the next fit is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gathered {
    /// Rows.
    pub rows: usize,
    /// From the first to the last \[s\].
    pub span: f64,
    /// Rows that are needed.
    pub rows_needed: usize,
    /// Slowest time constants that are needed.
    pub time_constants: f64,
    /// What these last \[s\], by the latest fit; `None` before the first.
    pub span_needed: Option<f64>,
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
}

/// A monitor.
pub struct Monitor {
    intake: Intake,
    core: Core,
    fingerprint: Fingerprint,
    units: Units,
    outputs: usize,
}

impl Monitor {
    /// A monitor that has seen nothing yet.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::TwoPumps`], [`Error::Disturbance`], [`Error::TooManyOutputs`], [`Error::ByClock`] for an effect in the model that follows the time since a record began, [`Error::Structure`].
    pub fn new(model: Model, settings: Settings, units: Units) -> Result<Self, Error> {
        settings.check()?;
        if model.plant.pumps() > 1 {
            return Err(Error::TwoPumps {
                plant: model.plant.id(),
            });
        }
        if model.known.disturbance.is_some() {
            return Err(Error::Disturbance);
        }
        let outputs = model.known.outputs(model.plant).len();
        if outputs > MAX_OUTPUTS {
            return Err(Error::TooManyOutputs { outputs });
        }
        if let Some(placed) = model.effects.iter().find(|placed| placed.effect.by_clock) {
            return Err(Error::ByClock {
                effect: placed.effect.id.to_string(),
            });
        }
        if let Some(term) = model
            .terms
            .iter()
            .find(|term| term.variable == plants::Variable::Time)
        {
            return Err(Error::ByClock {
                effect: term.name.clone(),
            });
        }
        model.structure(plants::Scales::from_ranges(
            (0.0, 1.0),
            (0.0, 1.0),
            1.0,
            1.0,
        ))?;
        Ok(Self {
            intake: Intake::new(outputs),
            fingerprint: fingerprint(&model),
            core: Core::new(model, settings, units.clone()),
            units,
            outputs,
        })
    }

    /// Goes on where a saved monitor was; with the same model and settings what follows is the same, bit for bit.
    ///
    /// # Errors
    /// As [`Monitor::new`], and [`Error::Version`], [`Error::OtherModel`], [`Error::Damaged`].
    pub fn restore(model: Model, settings: Settings, state: State) -> Result<Self, Error> {
        let mut monitor = Self::new(model.clone(), settings, state.units.clone())?;
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
        if !state.intake.sound(monitor.outputs) {
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
        let known = self.core.known();
        let mut readings = [None; MAX_OUTPUTS];
        let mut step = Step::default();
        for (output, &value) in row.outputs[..self.outputs].iter().enumerate() {
            let reading = match known.tank_height {
                Some(height) if value > ABOVE * height => Err(Refused::AboveTank { value, height }),
                _ => usable("output", value),
            };
            match reading {
                Ok(reading) => readings[output] = Some(reading),
                Err(lost) => step.lost[output] = Some(lost),
            }
        }
        if let Some(range) = known.input_range
            && row.input.abs() > BEYOND * range
        {
            return Err(Refused::BeyondRange {
                value: row.input,
                range,
            });
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
        self.outputs
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
