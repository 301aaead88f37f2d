//! A record of a loop: r, u and y on an even grid, the hold of r and u, and the operating point.

use std::borrow::Cow;

use ct_lti::Hold;
use serde::{Deserialize, Serialize};

use crate::{Controller, Error};

/// The levels around which the linear model is valid, units of r, u and y.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct OperatingPoint {
    /// Reference.
    pub r: f64,
    /// Input.
    pub u: f64,
    /// Output.
    pub y: f64,
}

/// Where zero of r, u and y is. A linear model holds for deviations from an operating point at which the loop rested
/// before the record; raw levels given as deviations put the gain at the secant instead of the tangent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Offsets {
    /// The signals are deviations already, and the loop is at rest at 0 when the record begins.
    Deviations,
    /// Known levels, which are subtracted: the loop is at rest there when the record begins.
    Known(OperatingPoint),
    /// The mean of the first rows, in which the loop rests: at least 1.
    FirstRows(usize),
    /// The means of the record: a choice for long records without better knowledge; the model starts at rest, so a transient at the
    /// beginning causes an error.
    Means,
    /// Unknown. The batch fit estimates the level of the drive (r, or u in open loop) at rest and the corresponding output level together
    /// with the parameters, starting from the first row.
    Estimated,
}

/// r, u and y of one experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRecord {
    /// Name in messages.
    pub name: String,
    /// Sampling interval \[time\], above 0.
    pub step: f64,
    /// Reference; needed in closed loop.
    pub r: Option<Vec<f64>>,
    /// Input of the plant, the controller's output; needed in open loop.
    pub u: Option<Vec<f64>>,
    /// Output as the controller reads it, at the sampling instants; NaN if the reading is missing.
    pub y: Vec<f64>,
    /// Hold of r between samples.
    pub r_hold: Hold,
    /// Hold of u between samples. With a continuous-time controller both choices are approximations.
    pub u_hold: Hold,
    /// Operating point.
    pub offsets: Offsets,
}

impl LoopRecord {
    /// A record of a loop, r held between samples.
    pub fn closed_loop(
        step: f64,
        r: Vec<f64>,
        u: Option<Vec<f64>>,
        y: Vec<f64>,
        offsets: Offsets,
    ) -> Self {
        Self {
            name: "record".into(),
            step,
            r: Some(r),
            u,
            y,
            r_hold: Hold::Zero,
            u_hold: Hold::Zero,
            offsets,
        }
    }

    /// A record without a loop, u held between samples.
    pub fn open_loop(step: f64, u: Vec<f64>, y: Vec<f64>, offsets: Offsets) -> Self {
        Self {
            name: "record".into(),
            step,
            r: None,
            u: Some(u),
            y,
            r_hold: Hold::Zero,
            u_hold: Hold::Zero,
            offsets,
        }
    }

    /// From a record as it is read from a file; times have to be evenly spaced to 1e-6 of the step; r is taken
    /// as held, u as the record says.
    ///
    /// # Errors
    /// [`Error::UnevenGrid`], [`Error::Signals`] where the record is not valid.
    pub fn from_record(record: &ct_signals::Record, offsets: Offsets) -> Result<Self, Error> {
        record.validate()?;
        let step = record.sample_interval();
        let steps = record.time.windows(2).map(|pair| pair[1] - pair[0]);
        for (k, found) in steps.enumerate() {
            if (found - step).abs() > 1e-6 * step {
                return Err(Error::UnevenGrid {
                    record: record.name.clone(),
                    index: k + 1,
                    step: found,
                    expected: step,
                });
            }
        }
        let hold = match record.hold() {
            ct_signals::Hold::Zero => Hold::Zero,
            ct_signals::Hold::First => Hold::First,
        };
        Ok(Self {
            name: record.name.clone(),
            step,
            r: record.references.first().map(|r| r.values.clone()),
            u: Some(record.inputs[0].values.clone()),
            y: record.outputs[0].values.clone(),
            r_hold: Hold::Zero,
            u_hold: hold,
            offsets,
        })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Number of present readings of the output.
    pub fn readings(&self) -> usize {
        self.y.iter().filter(|y| !y.is_nan()).count()
    }

    /// Whether readings are missing.
    pub(crate) fn lacks_readings(&self) -> bool {
        self.readings() < self.len()
    }

    /// y with linear interpolation of missing readings.
    pub(crate) fn y_on_lines(&self) -> Cow<'_, [f64]> {
        match self.lacks_readings() {
            true => Cow::Owned(ct_signals::interpolated(&self.y)),
            false => Cow::Borrowed(&self.y),
        }
    }

    /// Checks the step, the lengths and that all numbers are finite; readings of y may be missing (NaN), but not all of them, nor all of
    /// those that say where zero is.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::SignalLength`], [`Error::NotFinite`], [`Error::NoReading`].
    pub fn validate(&self) -> Result<(), Error> {
        crate::controller::positive("the sampling interval", self.step)?;
        if let Offsets::FirstRows(0) = self.offsets {
            return Err(Error::Setting {
                what: "the number of first rows",
                value: 0.0,
                range: "at least 1",
            });
        }
        let signals = [
            ("r", self.r.as_deref()),
            ("u", self.u.as_deref()),
            ("y", Some(&self.y[..])),
        ];
        for (signal, values) in signals {
            let Some(values) = values else { continue };
            if values.len() != self.len() {
                return Err(Error::SignalLength {
                    record: self.name.clone(),
                    signal,
                    expected: self.len(),
                    found: values.len(),
                });
            }
            let refused = |v: &f64| match signal {
                "y" => v.is_infinite(),
                _ => !v.is_finite(),
            };
            if let Some(index) = values.iter().position(refused) {
                return Err(Error::NotFinite {
                    record: self.name.clone(),
                    signal,
                    index,
                    value: values[index],
                });
            }
        }
        let first = match self.offsets {
            Offsets::FirstRows(rows) => rows.min(self.len()),
            _ => self.len(),
        };
        if first > 0 && self.y[..first].iter().all(|y| y.is_nan()) {
            return Err(Error::NoReading {
                record: self.name.clone(),
                rows: first,
                all: first == self.len(),
            });
        }
        Ok(())
    }

    /// The signal that drives the model, r in closed loop and u in open loop, and its hold.
    ///
    /// # Errors
    /// [`Error::MissingReference`], [`Error::MissingInput`].
    pub fn drive(&self, controller: &Controller) -> Result<(&[f64], Hold), Error> {
        let record = || self.name.clone();
        if controller.is_open_loop() {
            let u = self.u.as_deref();
            let u = u.ok_or_else(|| Error::MissingInput { record: record() })?;
            return Ok((u, self.u_hold));
        }
        let r = self.r.as_deref();
        let r = r.ok_or_else(|| Error::MissingReference { record: record() })?;
        Ok((r, self.r_hold))
    }

    /// The levels that are subtracted: where [`Offsets::Estimated`], those of the first row (of y of the first reading), as a start. 0 for
    /// a signal that is not there. Missing readings are left out of means.
    pub fn operating_point(&self) -> OperatingPoint {
        let level = |signal: Option<&[f64]>| {
            let signal = signal.unwrap_or_default();
            if self.offsets == Offsets::Estimated {
                let first = signal.iter().find(|v| !v.is_nan());
                return first.copied().unwrap_or(0.0);
            }
            let rows = match self.offsets {
                Offsets::Deviations | Offsets::Known(_) => 0,
                Offsets::FirstRows(rows) => rows.min(signal.len()),
                Offsets::Means | Offsets::Estimated => signal.len(),
            };
            let there = signal[..rows].iter().filter(|v| !v.is_nan());
            there.clone().sum::<f64>() / there.count().max(1) as f64
        };
        match self.offsets {
            Offsets::Known(point) => point,
            _ => OperatingPoint {
                r: level(self.r.as_deref()),
                u: level(self.u.as_deref()),
                y: level(Some(&self.y)),
            },
        }
    }
}
