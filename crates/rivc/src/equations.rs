//! The estimating equations `sum z (p^n y_f - phi' x) = 0` over all records, and what follows from them.

use ct_signals::ArModel;
use nalgebra::{DMatrix, DVector};

use crate::Error;
use crate::bank::Bank;
use crate::layout::Layout;
use crate::pass::{Instruments, Pass};

/// Equations whose smallest singular value, scaled, is below this share of the largest do not determine the parameters.
const DEPENDENT: f64 = 1e-13;
/// Errors of this share of the output are those of rounding.
const ROUNDING: f64 = 1e-10;
/// Lower limit of the noise of a record, as a share of the largest noise of all records.
const LEAST_NOISE: f64 = 1e-9;

/// Sums over all records. Columns: what all records share, then of each record its own.
#[derive(Debug)]
pub(crate) struct Equations {
    pub(crate) layout: Layout,
    /// `sum z phi'`, `sum z z'`, `sum z p^n y_f`.
    zphi: DMatrix<f64>,
    zz: DMatrix<f64>,
    zy: DVector<f64>,
    /// Squares of phi, to scale the columns with.
    sizes: DVector<f64>,
    /// Number of rows with a reading.
    pub(crate) samples: usize,
    /// Squares of the measured output, in the same unit.
    measured_squares: f64,
    /// Sum of squared residuals, whitened if there is a noise model.
    residual_squares: f64,
    /// The residual of each record, NaN where the reading is missing; where the filter is that of the model `y - y^` on the measured
    /// inputs.
    pub(crate) residuals: Vec<Vec<f64>>,
}

impl Equations {
    pub(crate) fn new(layout: Layout, records: usize) -> Self {
        let p = layout.unknowns();
        Self {
            layout,
            zphi: DMatrix::zeros(p, p),
            zz: DMatrix::zeros(p, p),
            zy: DVector::zeros(p),
            sizes: DVector::zeros(p),
            samples: 0,
            measured_squares: 0.0,
            residual_squares: 0.0,
            residuals: Vec::with_capacity(records),
        }
    }

    /// Adds a record, whitened by a model of its noise and divided by that model's standard deviation.
    pub(crate) fn add(
        &mut self,
        pass: &Pass,
        bank: &Bank,
        instruments: Instruments,
        noise: Option<&ArModel>,
    ) {
        let p = pass.columns();
        let x = pass.x();
        let mut residuals = Vec::with_capacity(pass.record.len());
        let mut whitener = noise.map(|noise| noise.whitener(2 * p + 1));
        let weight = noise.map_or(1.0, |noise| 1.0 / noise.sigma());
        let mut values = vec![0.0; 2 * p + 1];
        let (mut zphi, mut zz) = (vec![0.0; p * p], vec![0.0; p * p]);
        let (mut zy, mut sizes) = (vec![0.0; p], vec![0.0; p]);
        let error = |phi: &[f64], target: f64| {
            target - phi.iter().zip(&x).map(|(phi, x)| phi * x).sum::<f64>()
        };
        let (mut squares, mut measured) = (0.0, 0.0);
        let mut missing = 0;
        pass.rows(bank, instruments, |row| {
            if row.missing {
                missing += 1;
                residuals.push(f64::NAN);
                if let Some(whitener) = &mut whitener {
                    whitener.skip();
                }
                return;
            }
            let mut residual = error(row.phi, row.target);
            residuals.push(residual);
            measured += (row.y * weight).powi(2);
            let (mut z, mut phi, mut target) = (row.z, row.phi, row.target);
            if let Some(whitener) = &mut whitener {
                values[..p].copy_from_slice(z);
                values[p..2 * p].copy_from_slice(phi);
                values[2 * p] = target;
                whitener.push(&mut values);
                values.iter_mut().for_each(|value| *value *= weight);
                (z, phi) = (&values[..p], &values[p..2 * p]);
                target = values[2 * p];
                residual = error(phi, target);
            }
            squares += residual * residual;
            for ((zy, a), (size, phi)) in zy.iter_mut().zip(z).zip(sizes.iter_mut().zip(phi)) {
                *zy += a * target;
                *size += phi * phi;
            }
            let rows = zphi.chunks_exact_mut(p).zip(zz.chunks_exact_mut(p));
            for ((zphi, zz), a) in rows.zip(z) {
                for ((zphi, zz), (phi, z)) in zphi.iter_mut().zip(zz).zip(phi.iter().zip(z)) {
                    *zphi += a * phi;
                    *zz += a * z;
                }
            }
        });
        for i in 0..p {
            let row = self.layout.place(pass.index, i);
            self.zy[row] += zy[i];
            self.sizes[row] += sizes[i];
            for j in 0..p {
                let column = self.layout.place(pass.index, j);
                self.zphi[(row, column)] += zphi[i * p + j];
                self.zz[(row, column)] += zz[i * p + j];
            }
        }
        self.samples += residuals.len() - missing;
        self.measured_squares += measured;
        self.residual_squares += squares;
        self.residuals.push(residuals);
    }

    /// Adds a matrix of one record's columns, p by p, to one of all columns.
    pub(crate) fn add_block(&self, of_record: &[f64], index: usize, to: &mut DMatrix<f64>) {
        let p = self.layout.columns();
        for i in 0..p {
            for j in 0..p {
                to[(self.layout.place(index, i), self.layout.place(index, j))] +=
                    of_record[i * p + j];
            }
        }
    }

    /// An AR model of each record's residual, of at most this order, one for all parts of a record; a record without noise gets a billionth
    /// of the largest noise.
    pub(crate) fn residual_noise(&self, order: usize) -> Result<Vec<ArModel>, Error> {
        let mut models = Vec::with_capacity(self.residuals.len());
        for group in self.layout.groups() {
            let parts: Vec<&[f64]> = self.residuals[group].iter().map(Vec::as_slice).collect();
            let model = ArModel::fit(&parts, order)?;
            models.resize(models.len() + parts.len(), model);
        }
        let largest = models.iter().map(ArModel::sigma).fold(0.0, f64::max);
        let least = (LEAST_NOISE * largest).max(f64::MIN_POSITIVE.sqrt());
        let at_least = |model: ArModel| match model.sigma() < least {
            true => ArModel::white(least),
            false => model,
        };
        Ok(models.into_iter().map(at_least).collect())
    }

    /// The same equations with some unknowns fixed at values, and so without their rows and columns; `places` are ascending.
    pub(crate) fn with_fixed(&self, places: &[usize], values: &[f64]) -> Self {
        let mut zy = self.zy.clone();
        for (place, value) in places.iter().zip(values) {
            zy -= self.zphi.column(*place) * *value;
        }
        let without = |m: &DMatrix<f64>| {
            let rows = m.clone().remove_rows_at(places);
            rows.remove_columns_at(places)
        };
        Self {
            zphi: without(&self.zphi),
            zz: without(&self.zz),
            zy: zy.remove_rows_at(places),
            sizes: self.sizes.clone().remove_rows_at(places),
            // Has the length of the records, and is not needed for the solution.
            residuals: Vec::new(),
            layout: self.layout.clone(),
            ..*self
        }
    }

    /// Mean square of the residual, not below that of rounding: of the output error where the filter is that of the model.
    pub(crate) fn mean_square(&self) -> f64 {
        let rounding = ROUNDING * ROUNDING * self.measured_squares;
        // NaN stays NaN.
        match self.residual_squares < rounding {
            true => rounding / self.samples as f64,
            false => self.residual_squares / self.samples as f64,
        }
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.zy.len()
    }

    /// `[sum z phi']^-1 sum z p^n y_f`.
    pub(crate) fn solve(&self) -> Result<Vec<f64>, Error> {
        let right = DMatrix::from_column_slice(self.unknowns(), 1, self.zy.as_slice());
        Ok(self.solve_for(right)?.iter().copied().collect())
    }

    /// `[sum z phi']^-1 X`, rows and columns scaled to units of 1.
    fn solve_for(&self, mut right: DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
        let undetermined = || Error::NotDetermined {
            parameters: self.unknowns(),
            samples: self.samples,
        };
        let of_z = self.zz.diagonal().map(|size| 1.0 / size.sqrt());
        let of_phi = self.sizes.map(|size| 1.0 / size.sqrt());
        let scaled = DMatrix::from_fn(right.nrows(), right.nrows(), |i, j| {
            self.zphi[(i, j)] * of_z[i] * of_phi[j]
        });
        for (mut row, scale) in right.row_iter_mut().zip(&of_z) {
            row *= *scale;
        }
        if !scaled.iter().chain(right.iter()).all(|v| v.is_finite()) {
            return Err(undetermined());
        }
        let svd = scaled.svd(true, true);
        if svd.singular_values.min() <= DEPENDENT * svd.singular_values.max() {
            return Err(undetermined());
        }
        let mut solution = svd.solve(&right, 0.0).map_err(|_| undetermined())?;
        for (mut row, scale) in solution.row_iter_mut().zip(&of_phi) {
            row *= *scale;
        }
        Ok(solution)
    }

    /// Variance of the residual, whitened if there is a noise model.
    pub(crate) fn variance(&self) -> f64 {
        self.residual_squares / (self.samples - self.unknowns()).max(1) as f64
    }

    /// `G^-1 S G^-T` with `G = sum z phi'`; S is `variance sum z z'` where the residual is white after whitening.
    pub(crate) fn covariance(&self, middle: Option<DMatrix<f64>>) -> Result<DMatrix<f64>, Error> {
        let middle = middle.unwrap_or_else(|| &self.zz * self.variance());
        let half = self.solve_for(middle)?;
        self.solve_for(half.transpose())
    }
}
