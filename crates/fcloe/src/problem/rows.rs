//! The loop simulated over the records: residuals and their sensitivities, row by row.

use ct_lti::Hold;
use estimation::{Residuals, Sample, Triangle};

use super::{Problem, ROUNDING, Undefined};
use crate::simulation::BLOCK;
use crate::{ClosedLoop, Error, LoopSimulator, PlantModel};

impl Problem {
    /// Triangular factor of the sensitivities and the residual at x (without sensitivities: of the residual alone). Returns
    /// [`Undefined::Higher`] as soon as the partial sum of J exceeds the limit, usually before the last sample.
    pub(crate) fn evaluate(
        &self,
        x: &[f64],
        limit: f64,
        sensitivities: bool,
    ) -> Result<Triangle, Undefined> {
        let plant = self.plant(x).map_err(|_| Undefined::NotFinite)?;
        let closed = ClosedLoop::new(&plant, &self.controller).map_err(|_| Undefined::NotFinite)?;
        if !closed.is_stable() {
            return Err(Undefined::Unstable);
        }
        // Each record's rows have few nonzero columns: each record is reduced separately.
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
            // A NaN cost is detected below.
            let cost = all.cost() + own.1.cost();
            !(cost > limit && cost.is_finite())
        });
        if !seen.map_err(|_| Undefined::NotFinite)? {
            return Err(Undefined::Higher);
        }
        let (_, mut record, places) = own;
        record.finish();
        all.append(&record, &places);
        all.finish();
        if all.is_finite() {
            Ok(all)
        } else {
            Err(Undefined::NotFinite)
        }
    }

    /// Column positions of a record's quantities: those of theta, its levels, the residual; or the residual alone.
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

    /// Simulates all records at x and shows the index of the record, its readings (NaN where they are missing) and, if asked for, the
    /// columns of its sensitivities (theta, then its levels), the residual's last, up to [`BLOCK`] samples at a time, until `see` has seen
    /// enough; whether it has seen all.
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

    /// Passes each row of all samples, or the rows of the residual alone, to a function.
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

/// The residual `y - y^` of all records as one output, NaN if the reading is missing; its parameters are theta, and each estimated level's
/// distance from its start (drive, then y, record by record). It is not finite if the loop is not stable.
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
