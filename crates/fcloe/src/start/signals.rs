//! Shared parts of all regressions: signals with their derivatives, all with the same filter, and the solution of the equations.

use ct_lti::{Hold, Polynomial, ReadingFilter, StateVariableFilter};
use nalgebra::{DMatrix, DVector};

use crate::{Controller, Error, LoopRecord, LoopSimulator, PlantModel};

/// Equations whose smallest singular value, scaled, is below this share of the largest do not determine the parameters.
const DEPENDENT: f64 = 1e-13;

/// u of a record.
pub(super) fn input(record: &LoopRecord) -> Result<&[f64], Error> {
    record
        .u
        .as_deref()
        .ok_or_else(|| Error::RegressionWithoutInput {
            record: record.name.clone(),
        })
}

/// u as the plant's input, through a sensor's filter if there is one, and y, NaN if its reading is missing: deviations.
#[derive(Debug, Clone)]
pub(super) struct Signals {
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    u_hold: Hold,
    step: f64,
}

impl Signals {
    pub(super) fn measured(record: &LoopRecord, controller: &Controller) -> Result<Self, Error> {
        record.validate()?;
        let point = record.operating_point();
        let u = input(record)?.iter().map(|u| u - point.u).collect();
        let y = record.y.iter().map(|y| y - point.y).collect();
        Self::new(u, y, record, controller)
    }

    /// Signals of a model of the loop driven by r, or by u in open loop: without the record's noise.
    pub(super) fn simulated(
        model: &PlantModel,
        record: &LoopRecord,
        controller: &Controller,
    ) -> Result<Self, Error> {
        let (drive, hold) = record.drive(controller)?;
        let point = record.operating_point();
        let level = if controller.is_open_loop() {
            point.u
        } else {
            point.r
        };
        let drive: Vec<f64> = drive.iter().map(|r| r - level).collect();
        let mut simulator = LoopSimulator::new(model, controller, hold, record.step)?;
        let (y, u) = simulator.outputs_and_inputs(&drive);
        Self::new(u, y, record, controller)
    }

    fn new(
        mut u: Vec<f64>,
        y: Vec<f64>,
        record: &LoopRecord,
        controller: &Controller,
    ) -> Result<Self, Error> {
        let mut u_hold = record.u_hold;
        if controller.filter().degree() > Some(0) {
            let mut filter = StateVariableFilter::new(controller.filter(), u_hold)?;
            for u in &mut u {
                *u = filter.update(*u, record.step)?[0];
            }
            // The filtered signal has no steps any more.
            u_hold = Hold::First;
        }
        Ok(Self {
            u,
            y,
            u_hold,
            step: record.step,
        })
    }

    /// Whether the reading of a sample is missing.
    pub(super) fn is_missing(&self, k: usize) -> bool {
        self.y[k].is_nan()
    }

    /// Replaces missing readings by those of another record.
    pub(super) fn filled(mut self, from: &Self) -> Self {
        for (y, from) in self.y.iter_mut().zip(&from.y) {
            if y.is_nan() {
                *y = *from;
            }
        }
        self
    }

    /// Passes the number of the sample, and y_f and u_f with their derivatives, 0 to n, to a function; not for a missing reading, nor
    /// before the filter has forgotten a long gap ([`ReadingFilter`]).
    pub(super) fn filtered(
        &self,
        filter: &Polynomial,
        mut see: impl FnMut(usize, &[f64], &[f64]),
    ) -> Result<(), Error> {
        let mut of_y = ReadingFilter::new(StateVariableFilter::new(filter, Hold::First)?);
        let mut of_u = StateVariableFilter::new(filter, self.u_hold)?;
        for (k, (&y, &u)) in self.y.iter().zip(&self.u).enumerate() {
            let u = of_u.update(u, self.step)?;
            if let Some(y) = of_y.update(y, self.step)? {
                see(k, y, u);
            }
        }
        Ok(())
    }
}

/// Sums of `z phi'` and `z y` over the rows: O(p^2) memory.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    rows: usize,
    m: DMatrix<f64>,
    v: DVector<f64>,
    /// Squares of z and phi.
    size: [DVector<f64>; 2],
}

impl Sums {
    pub(super) fn new(p: usize) -> Self {
        let zeros = || DVector::zeros(p);
        Self {
            rows: 0,
            m: DMatrix::zeros(p, p),
            v: zeros(),
            size: [zeros(), zeros()],
        }
    }

    pub(super) fn add(&mut self, z: &[f64], phi: &[f64], y: f64) {
        self.rows += 1;
        for (i, z) in z.iter().enumerate() {
            self.size[0][i] += z * z;
            self.v[i] += z * y;
            for (j, phi) in phi.iter().enumerate() {
                self.m[(i, j)] += z * phi;
            }
        }
        for (size, phi) in self.size[1].iter_mut().zip(phi) {
            *size += phi * phi;
        }
    }

    /// `[sum z phi']^-1 sum z y`.
    pub(super) fn solve(&self) -> Result<Vec<f64>, Error> {
        let x = self.solve_for(&DMatrix::from_column_slice(
            self.v.len(),
            1,
            self.v.as_slice(),
        ))?;
        Ok(x.column(0).iter().copied().collect())
    }

    /// `[sum z phi']^-1 X`, after a scaling of rows and columns that makes the result independent of units.
    pub(super) fn solve_for(&self, x: &DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
        let p = self.v.len();
        let undetermined = Error::NotDetermined {
            parameters: p,
            samples: self.rows,
        };
        let scale = |i: usize, which: usize| 1.0 / self.size[which][i].sqrt();
        let m = DMatrix::from_fn(p, p, |i, j| self.m[(i, j)] * scale(i, 0) * scale(j, 1));
        let mut x = x.clone();
        for (i, mut row) in x.row_iter_mut().enumerate() {
            row *= scale(i, 0);
        }
        if !m.iter().chain(x.iter()).all(|x| x.is_finite()) {
            return Err(undetermined);
        }
        let svd = m.svd(true, true);
        if svd.singular_values.min() <= DEPENDENT * svd.singular_values.max() {
            return Err(undetermined);
        }
        let Ok(mut x) = svd.solve(&x, 0.0) else {
            return Err(undetermined);
        };
        for (j, mut row) in x.row_iter_mut().enumerate() {
            row *= scale(j, 1);
        }
        Ok(x)
    }
}

/// Solution of [`Sums`] of all rows.
pub(super) fn solve<'a>(
    p: usize,
    rows: impl Iterator<Item = (&'a [f64], &'a [f64], f64)>,
) -> Result<Vec<f64>, Error> {
    let mut sums = Sums::new(p);
    for (z, phi, y) in rows {
        sums.add(z, phi, y);
    }
    sums.solve()
}
