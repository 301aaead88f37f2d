//! Records, a controller and the orders of a plant: the criterion of the batch fit.
//!
//! Criterion (Baysse, Carrillo, Habbadi, (5)): `J = sum eps^2` over all samples of all records, `eps = y - y^`, each
//! record simulated from rest at its operating point; `J' = -2 sum eps sigma`, `J'' ~ 2 sum sigma sigma'` (31). Where
//! a record's offsets are estimated, `y^ = c_y + T(p) (r - c_r)` with `T = B R/P`, and its two levels join the
//! parameters, with the sensitivities `1` and `-T 1`.
//!
//! The sums are held as the triangle R of [`estimation::Triangle`]: `J'' = 2 R'R`, `J' = -2 R'z`, z its last column, so that the condition
//! of the sensitivities is not squared; [`Problem`] is one of [`estimation::Residuals`].
//!
//! Readings of y may be missing: the simulation runs on, and their rows have no residual and do not count.
//!
//! Cost per sample with p parameters: the simulation, and `2 (p + 1)^2` operations for the triangle.

mod rows;

use ct_lti::Hold;

use crate::control_check::{Mismatch, controller_mismatch};
use crate::{Controller, Error, LoopRecord, Offsets, Orders, PlantModel};

/// A fit with fewer samples than this, or than 5 for each parameter, is rejected.
const MIN_SAMPLES: usize = 20;
const SAMPLES_PER_PARAMETER: usize = 5;

/// A controller whose output differs from u by more than this share is rejected.
const LARGEST_MISMATCH: f64 = 0.1;

/// The levels of a record that were estimated.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Levels {
    /// Level of r, or of u in open loop, at which the loop rested before the record.
    pub drive: f64,
    /// Level of y.
    pub y: f64,
}

/// One record with the data for a fit.
#[derive(Debug, Clone)]
struct Prepared {
    name: String,
    step: f64,
    hold: Hold,
    /// Less the operating point; y is NaN where its reading is missing.
    drive: Vec<f64>,
    y: Vec<f64>,
    lacks_readings: bool,
    /// The operating point of the two.
    levels: Levels,
    /// Index of the parameter that is the offset of drive in this record, if offsets are estimated; the offset of y follows it.
    column: Option<usize>,
    /// Standard deviations of drive and y.
    spread: [f64; 2],
}

/// The least-squares problem.
#[derive(Debug, Clone)]
pub struct Problem {
    controller: Controller,
    orders: Orders,
    records: Vec<Prepared>,
    mismatches: Vec<Option<Mismatch>>,
    /// All columns: the parameters of the plant, followed by the estimated levels.
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    /// Number of samples of the single output.
    samples: [usize; 1],
}

/// Reason why the criterion is undefined for these parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Undefined {
    /// P^ is not Hurwitz.
    Unstable,
    /// Numbers out of range.
    NotFinite,
    /// J is above the limit.
    Higher,
}

/// Tolerance of the limit of J, for differences by the order of summation.
const ROUNDING: f64 = 1e-9;

impl Problem {
    /// Checks everything that can be checked before a fit.
    ///
    /// # Errors
    /// [`Error::NoRecord`]; [`Error::OrderZero`], [`Error::Improper`] for the orders; a record that is not valid, see
    /// [`LoopRecord::validate`]; [`Error::MissingReference`], [`Error::MissingInput`]; [`Error::ConstantDrive`]; [`Error::TooShort`];
    /// [`Error::ControllerMismatch`] where u is in the record and the controller misses more than 10 % of it.
    pub fn new(
        records: &[LoopRecord],
        controller: &Controller,
        orders: Orders,
    ) -> Result<Self, Error> {
        orders.check()?;
        if records.is_empty() {
            return Err(Error::NoRecord);
        }
        let mut columns = orders.parameters();
        let mut prepared = Vec::with_capacity(records.len());
        let mut mismatches = Vec::with_capacity(records.len());
        for record in records {
            record.validate()?;
            let (drive, hold) = record.drive(controller)?;
            let point = record.operating_point();
            let open = controller.is_open_loop();
            let levels = Levels {
                drive: if open { point.u } else { point.r },
                y: point.y,
            };
            let less =
                |v: &[f64], level: f64| -> Vec<f64> { v.iter().map(|v| v - level).collect() };
            let estimated = record.offsets == Offsets::Estimated;
            prepared.push(Prepared {
                name: record.name.clone(),
                step: record.step,
                hold,
                drive: less(drive, levels.drive),
                y: less(&record.y, levels.y),
                lacks_readings: record.lacks_readings(),
                levels,
                column: estimated.then_some(columns),
                spread: [spread(drive), spread(&record.y)],
            });
            if estimated {
                columns += 2;
            }
            mismatches.push(controller_mismatch(record, controller)?);
        }
        let samples = records.iter().map(LoopRecord::readings).sum();
        let rows: usize = records.iter().map(LoopRecord::len).sum();
        let needed = MIN_SAMPLES.max(SAMPLES_PER_PARAMETER * columns);
        if samples < needed {
            return Err(Error::TooShort {
                samples,
                missing: rows - samples,
                needed,
                parameters: columns,
            });
        }
        if prepared.iter().all(|record| constant(&record.drive)) {
            let first = &prepared[0];
            return Err(Error::ConstantDrive {
                signal: if controller.is_open_loop() { "u" } else { "r" },
                value: first.drive.first().unwrap_or(&0.0) + first.levels.drive,
            });
        }
        for (record, mismatch) in prepared.iter().zip(&mismatches) {
            if let Some(mismatch) = mismatch
                && mismatch.systematic > LARGEST_MISMATCH * mismatch.size
                && mismatch.systematic > 2.0 * mismatch.by_chance
            {
                return Err(Error::ControllerMismatch {
                    record: record.name.clone(),
                    mismatch: mismatch.systematic,
                    size: mismatch.size,
                });
            }
        }
        Ok(Self {
            controller: controller.clone(),
            orders,
            records: prepared,
            mismatches,
            free: (0..columns).collect(),
            bounds: vec![(f64::NEG_INFINITY, f64::INFINITY); columns],
            samples: [samples],
        })
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// n and m.
    pub fn orders(&self) -> Orders {
        self.orders
    }

    /// Samples in all records.
    pub fn samples(&self) -> usize {
        self.samples[0]
    }

    /// Difference between the controller's output and each record's u; none for a record without u, and in open loop.
    pub fn mismatches(&self) -> &[Option<Mismatch>] {
        &self.mismatches
    }

    /// Sampling interval of each record, and whether its levels are estimated.
    pub(crate) fn steps_and_free_levels(&self) -> impl Iterator<Item = (f64, bool)> {
        let records = self.records.iter();
        records.map(|record| (record.step, record.column.is_some()))
    }

    /// Parameters of the plant and estimated levels.
    pub(crate) fn columns(&self) -> usize {
        self.free.len()
    }

    /// The vector of all unknowns at this plant: theta, and each estimated level's distance from its start, 0.
    pub(crate) fn start(&self, plant: &PlantModel) -> Vec<f64> {
        let mut x = plant.theta().to_vec();
        x.resize(self.columns(), 0.0);
        x
    }

    /// Sizes of the unknowns beyond theta, by which they are scaled: spreads of drive and output.
    pub(crate) fn scales(&self) -> Vec<f64> {
        let estimated = self.records.iter().filter(|r| r.column.is_some());
        estimated.flat_map(|record| record.spread).collect()
    }

    /// The levels of each record: given, or estimated at x.
    pub(crate) fn levels(&self, x: &[f64]) -> Vec<Levels> {
        let at = |record: &Prepared| match record.column {
            Some(column) => Levels {
                drive: record.levels.drive + x[column],
                y: record.levels.y + x[column + 1],
            },
            None => record.levels,
        };
        self.records.iter().map(at).collect()
    }

    /// The plant at x.
    pub(crate) fn plant(&self, x: &[f64]) -> Result<PlantModel, Error> {
        PlantModel::from_theta(self.orders, &x[..self.orders.parameters()])
    }
}

fn constant(values: &[f64]) -> bool {
    values.iter().all(|v| Some(v) == values.first())
}

/// Standard deviation of the present values.
fn spread(values: &[f64]) -> f64 {
    let there = values.iter().filter(|v| !v.is_nan());
    let n = there.clone().count().max(1) as f64;
    let mean = there.clone().sum::<f64>() / n;
    (there.map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
