//! Records, a controller and the orders of a plant: the criterion of the batch fit.
//!
//! Criterion (Baysse, Carrillo, Habbadi, (5)): `J = sum eps^2` over all samples of all records, `eps = y - y^`, each
//! record simulated from rest at its operating point; `J' = -2 sum eps sigma`, `J'' ~ 2 sum sigma sigma'` (31). Where
//! a record's offsets are estimated, `y^ = c_y + T(p) (r - c_r)` with `T = B R/P`, and its two levels join the
//! parameters, with the sensitivities `1` and `-T 1`.
//!
//! The sums are held as the triangle R of [`estimation::Triangle`]: `J'' = 2 R'R`, `J' = -2 R'z`, z its last column, so that the condition of
//! the sensitivities is not squared; [`Problem`] is one of [`estimation::Residuals`].
//!
//! Readings of y may be missing: the simulation runs on, and their rows have no residual and do not count.
//!
//! Cost per sample with p parameters: the simulation, and `2 (p + 1)^2` operations for the triangle.

use ct_lti::Hold;
use estimation::{Residuals, Sample, Triangle};

use crate::control_check::{Mismatch, controller_mismatch};
use crate::simulation::BLOCK;
use crate::{
    ClosedLoop, Controller, Error, LoopRecord, LoopSimulator, Offsets, Orders, PlantModel,
};

/// A fit of parameters to fewer samples than this, or than 5 for each of them, is refused.
const MIN_SAMPLES: usize = 20;
const SAMPLES_PER_PARAMETER: usize = 5;

/// A controller that misses more of u than this share is refused.
const LARGEST_MISMATCH: f64 = 0.1;

/// The levels of a record that were estimated.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Levels {
    /// Level of r, or of u in open loop, at which the loop rested before the record.
    pub drive: f64,
    /// Level of y there.
    pub y: f64,
}

/// One record, ready to be fitted.
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
    /// Where its two columns begin, if its offsets are estimated.
    column: Option<usize>,
    /// Spread of drive and y.
    spread: [f64; 2],
}

/// What is fitted to what.
#[derive(Debug, Clone)]
pub struct Problem {
    controller: Controller,
    orders: Orders,
    records: Vec<Prepared>,
    mismatches: Vec<Option<Mismatch>>,
    /// All columns: the parameters of the plant, then the estimated levels.
    free: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    /// Of the one output.
    samples: [usize; 1],
}

/// Why parameters have no criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refused {
    /// P^ is not Hurwitz.
    Unstable,
    /// Numbers out of range.
    NotFinite,
    /// J is above the limit.
    Higher,
}

/// J may be above its limit by this part: sums in another order differ by less.
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

    /// How far the controller is from each record's u; none for a record without u, and in open loop.
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

    /// J and its derivatives at x, or the residual's column alone, unless J is above a limit: that is known before the last sample as a rule.
    pub(crate) fn evaluate(
        &self,
        x: &[f64],
        limit: f64,
        sensitivities: bool,
    ) -> Result<Triangle, Refused> {
        let plant = self.plant(x).map_err(|_| Refused::NotFinite)?;
        let closed = ClosedLoop::new(&plant, &self.controller).map_err(|_| Refused::NotFinite)?;
        if !closed.is_stable() {
            return Err(Refused::Unstable);
        }
        // Each record's rows have few columns other than zero: they are folded by themselves.
        let of_record = |index| {
            let places = self.places(index, sensitivities);
            (index, Triangle::new(places.len()), places)
        };
        let mut all = Triangle::new(if sensitivities { self.columns() + 1 } else { 1 });
        let mut own = of_record(0);
        let limit = limit * (1.0 + ROUNDING);
        let mut there: Vec<Vec<f64>> = Vec::new();
        let seen = self.visit(&closed, &plant, x, sensitivities, |index, y, columns| {
            if index != own.0 {
                let (_, mut record, places) = std::mem::replace(&mut own, of_record(index));
                record.finish();
                all.append(&record, &places);
            }
            if self.records[index].lacks_readings {
                there.resize(columns.len(), Vec::new());
                for (there, column) in there.iter_mut().zip(columns) {
                    there.clear();
                    let rows = column.iter().zip(y).filter(|(_, y)| !y.is_nan());
                    there.extend(rows.map(|(value, _)| value));
                }
                let there: Vec<&[f64]> = there.iter().map(Vec::as_slice).collect();
                own.1.push_columns(&there);
            } else {
                own.1.push_columns(columns);
            }
            // A cost that is no number is found out below.
            let cost = all.cost() + own.1.cost();
            !(cost > limit && cost.is_finite())
        });
        if !seen.map_err(|_| Refused::NotFinite)? {
            return Err(Refused::Higher);
        }
        let (_, mut record, places) = own;
        record.finish();
        all.append(&record, &places);
        all.finish();
        if all.is_finite() {
            Ok(all)
        } else {
            Err(Refused::NotFinite)
        }
    }

    /// Where the columns that a record shows have their places: those of theta, its levels, the residual; or the residual alone.
    fn places(&self, index: usize, sensitivities: bool) -> Vec<usize> {
        if !sensitivities {
            return vec![0];
        }
        let mut places: Vec<usize> = (0..self.orders.parameters()).collect();
        if let Some(column) = self.records[index].column {
            places.extend([column, column + 1]);
        }
        places.push(self.columns());
        places
    }

    /// Simulates all records at x and shows the index of the record, its readings (NaN where they are missing) and, if asked for, the columns of its sensitivities (theta, then its
    /// levels), the residual's last, up to [`BLOCK`] samples at a time, until `see` has seen enough; whether it has seen all.
    fn visit(
        &self,
        closed: &ClosedLoop,
        plant: &PlantModel,
        x: &[f64],
        sensitivities: bool,
        mut see: impl FnMut(usize, &[f64], &[&[f64]]) -> bool,
    ) -> Result<bool, Error> {
        let mut last: Option<(f64, Hold, LoopSimulator)> = None;
        let parameters = self.orders.parameters();
        for (index, record) in self.records.iter().enumerate() {
            let mut simulator = match last.take() {
                Some((step, hold, mut simulator)) if step == record.step && hold == record.hold => {
                    simulator.reset();
                    simulator
                }
                _ => LoopSimulator::of_loop(
                    closed,
                    plant,
                    &self.controller,
                    record.hold,
                    record.step,
                )?,
            };
            let mut steps = record.column.filter(|_| sensitivities).map(|_| {
                let mut steps = simulator.clone();
                steps.reset();
                steps
            });
            let (level, y_level) = match record.column {
                Some(column) => (x[column], x[column + 1]),
                None => (0.0, 0.0),
            };
            let (mut drive, mut e, mut step_response) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
            for (r, y) in record.drive.chunks(BLOCK).zip(record.y.chunks(BLOCK)) {
                let len = r.len();
                for (drive, r) in drive.iter_mut().zip(r) {
                    *drive = r - level;
                }
                let mut error = |model: &[f64]| {
                    for ((e, y), model) in e.iter_mut().zip(y).zip(model) {
                        *e = y - model - y_level;
                    }
                };
                if !sensitivities {
                    error(&simulator.outputs(&drive[..len]));
                    if !see(index, y, &[&e[..len]]) {
                        return Ok(false);
                    }
                    continue;
                }
                let block = simulator.sensitivities(&drive[..len]);
                error(block.y());
                let mut columns: Vec<&[f64]> = (0..parameters).map(|j| block.sigma(j)).collect();
                if let Some(steps) = &mut steps {
                    let response = steps.outputs(&ONES[..len]);
                    for (s, response) in step_response.iter_mut().zip(&response) {
                        *s = -response;
                    }
                    columns.extend([&step_response[..len], &ONES[..len]]);
                }
                columns.push(&e[..len]);
                if !see(index, y, &columns) {
                    return Ok(false);
                }
            }
            last = Some((record.step, record.hold, simulator));
        }
        Ok(true)
    }

    /// Shows the rows of all samples, or those of the residual alone.
    fn each(
        &self,
        x: &[f64],
        sensitivities: bool,
        mut each: impl FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        let plant = self.plant(x).ok()?;
        let closed = ClosedLoop::new(&plant, &self.controller).ok()?;
        if !closed.is_stable() {
            return None;
        }
        let mut row = vec![0.0; if sensitivities { self.columns() + 1 } else { 1 }];
        let mut places = Vec::new();
        let mut present = None;
        let seen = self.visit(&closed, &plant, x, sensitivities, |index, y, columns| {
            let mut first = present != Some(index);
            if first {
                present = Some(index);
                places = self.places(index, sensitivities);
            }
            let samples = columns.first().map_or(0, |column| column.len());
            (0..samples).all(|k| {
                // The caller may change the row.
                row.fill(0.0);
                for (&place, column) in places.iter().zip(columns) {
                    row[place] = column[k];
                }
                let sample = Sample {
                    output: 0,
                    first: std::mem::take(&mut first),
                    missing: y[k].is_nan(),
                };
                let shown = row.len() - usize::from(sample.missing);
                row[..shown].iter().all(|value| value.is_finite()) && each(sample, &mut row)
            })
        });
        seen.ok()?.then_some(())
    }
}

/// The residual `y - y^` of all records as one output, NaN where the reading is missing; its entries are theta, and each estimated level's distance from where it started (drive, then y,
/// record by record). It is not finite where the loop is not stable.
impl Residuals for Problem {
    fn free(&self) -> &[usize] {
        &self.free
    }

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn samples(&self) -> &[usize] {
        &self.samples
    }

    fn each_row(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.each(x, true, each)
    }

    fn each_residual(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.each(x, false, each)
    }
}

const ONES: [f64; BLOCK] = [1.0; BLOCK];

fn constant(values: &[f64]) -> bool {
    values.iter().all(|v| Some(v) == values.first())
}

/// Standard deviation of the values that are there.
fn spread(values: &[f64]) -> f64 {
    let there = values.iter().filter(|v| !v.is_nan());
    let n = there.clone().count().max(1) as f64;
    let mean = there.clone().sum::<f64>() / n;
    (there.map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
