//! The outputs of a fitted model on other inputs, and their uncertainty.
//!
//! To first order the simulated output moves with the parameters and the initial states by its exact sensitivities `S_p` and `S_x`:
//! ```text
//! dy = S_p dp + S_x dx0,     dx0 = A dp + e,     cov(y) = (S_p + S_x A) P (S_p + S_x A)' + S_x B S_x'
//! ```
//! `P` is the covariance of the parameters under the noise of the residual. Initial states are fitted to the first readings of the other
//! record, weighted by that noise model, with the parameters held at `p`: with `[J_x J_p]` the whitened sensitivities of these readings, `A
//! = -(J_x' J_x)^-1 J_x' J_p` and `B = (J_x' J_x)^-1`. Where the record has no readings they are what the model's text says: `A` is the
//! slope of that, `B` is zero.
//!
//! **Assumption**: the model is the plant, and close to linear in its parameters over their errors. What a model lacks is in no band.
//!
//! **Reference**: G. A. F. Seber, C. J. Wild, Nonlinear Regression, 1989, sections 2.1.2 and 5.1.

use ct_model::{Dual, Model, Scalar};
use estimation::{
    Fit, Noise, Prior, Residuals, Sample, Start, Stopping, fit_from, linearise, robust,
};
use serde::{Deserialize, Serialize};

use crate::Error;

/// Uncertainty of the parameters of a fit, and standard deviation of the readings' noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitUncertainty {
    /// Positions in the vector of the parameters with a standard error: fitted ones that are not at a bound.
    pub entries: Vec<usize>,
    /// Covariance of the parameters, row by row \[product of their units\].
    pub covariance: Vec<Vec<f64>>,
    /// Degrees of freedom: the quantile of Student's distribution times the standard error gives a band.
    pub freedom: f64,
    /// The noise of the residual at each output, with the scale of its innovations \[output unit\].
    pub noise: Noise,
    /// Standard deviation of a reading about the simulated output \[output unit\].
    pub reading: Vec<f64>,
}

impl FitUncertainty {
    /// Uncertainty of the first `parameters` entries of a fit's vector, under autoregressive noise of order zero to `order` at each output;
    /// `None` if the records do not determine all fitted entries.
    ///
    /// # Errors
    /// Where the model is not finite at the fit.
    pub fn of(
        model: &impl Residuals,
        fit: &Fit,
        parameters: usize,
        order: usize,
    ) -> Result<Option<Self>, Error> {
        if !fit.is_determined() {
            return Ok(None);
        }
        let (covariance, freedom, noise) = if fit.noise.order() > 0 {
            let variance = fit.variance();
            let scaled = |mut rows: Vec<Vec<f64>>| {
                rows.iter_mut().flatten().for_each(|c| *c *= variance);
                rows
            };
            let own = fit.triangle.covariance(fit.interior()).map(scaled);
            (own, fit.freedom(), fit.noise.clone())
        } else {
            let robust = robust(model, fit, order)?;
            (robust.covariance, robust.freedom, robust.noise)
        };
        let Some(covariance) = covariance else {
            return Ok(None);
        };
        let free = model.free();
        let entry = |column: &usize| free[*column];
        let own: Vec<usize> = (0..fit.interior().len())
            .filter(|&i| entry(&fit.interior()[i]) < parameters)
            .collect();
        let least = freedom
            .iter()
            .flatten()
            .copied()
            .fold(f64::INFINITY, f64::min);
        let left = fit.samples.saturating_sub(free.len()).max(1) as f64;
        let lost = (fit.samples as f64 / left).sqrt();
        Ok(Some(Self {
            entries: own.iter().map(|&i| entry(&fit.interior()[i])).collect(),
            covariance: own
                .iter()
                .map(|&i| own.iter().map(|&j| covariance[i][j]).collect())
                .collect(),
            freedom: if least.is_finite() { least } else { left },
            noise,
            reading: fit.rmse.iter().map(|rmse| rmse * lost).collect(),
        }))
    }

    /// Standard error of an entry of the vector \[its unit\]; `None` if it has none.
    #[must_use]
    pub fn std_error(&self, entry: usize) -> Option<f64> {
        let at = self.entries.iter().position(|own| *own == entry)?;
        Some(self.covariance[at][at].sqrt())
    }

    /// Half the width of the band with coverage `level` (0.95, say), in standard errors.
    #[must_use]
    pub fn quantile(&self, level: f64) -> f64 {
        ct_signals::student_half_width(level, self.freedom)
    }

    /// Adds an error that changes all entries together, by these amounts \[unit of each entry of the vector\].
    pub fn widen(&mut self, moved: &[f64]) {
        for (row, &i) in self.covariance.iter_mut().zip(&self.entries) {
            for (value, &j) in row.iter_mut().zip(&self.entries) {
                *value += moved[i] * moved[j];
            }
        }
    }
}

/// Initial states of a simulation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InitialStates {
    /// Values of the initial states \[unit of the state\].
    pub values: Vec<f64>,
    /// Derivatives with respect to [`FitUncertainty::entries`], a row for each state.
    by_parameters: Vec<Vec<f64>>,
    /// Covariance of the remaining uncertainty of the states, row by row.
    covariance: Vec<Vec<f64>>,
}

impl InitialStates {
    /// Known values.
    #[must_use]
    pub fn known(values: Vec<f64>, parameters: usize) -> Self {
        let n = values.len();
        Self {
            values,
            by_parameters: vec![vec![0.0; parameters]; n],
            covariance: vec![vec![0.0; n]; n],
        }
    }

    /// Initial states from the text of a model for these parameters; `entries` as [`FitUncertainty::entries`].
    #[must_use]
    pub fn of_text(model: &Model, parameters: &[f64], entries: &[usize]) -> Self {
        const LANES: usize = 4;
        let mut states = Self::known(model.starts(parameters), entries.len());
        for (first, chunk) in entries.chunks(LANES).enumerate() {
            let dual = |(i, value): (usize, &f64)| {
                let lane = chunk.iter().position(|entry| *entry == i);
                Dual::<LANES>::variable(*value, lane.unwrap_or(LANES))
            };
            let parameters: Vec<_> = parameters.iter().enumerate().map(dual).collect();
            let starts = model.starts(&parameters);
            for (row, start) in states.by_parameters.iter_mut().zip(starts) {
                let own = &mut row[first * LANES..][..chunk.len()];
                own.copy_from_slice(&start.eps[..chunk.len()]);
            }
        }
        states
    }

    /// A function of the parameters, with slopes by differences over a hundredth of each standard error; `None` if it has no value.
    #[must_use]
    pub fn of_parameters(
        values: impl Fn(&[f64]) -> Option<Vec<f64>>,
        parameters: &[f64],
        known: Option<&FitUncertainty>,
    ) -> Option<Self> {
        const STEP: f64 = 0.01;
        let entries: &[usize] = known.map_or(&[], |known| &known.entries);
        let mut states = Self::known(values(parameters)?, entries.len());
        for (column, &entry) in entries.iter().enumerate() {
            let error = known.map_or(0.0, |known| known.covariance[column][column].sqrt());
            let at = |sign: f64| {
                let mut moved = parameters.to_vec();
                moved[entry] += sign * STEP * error;
                values(&moved)
            };
            let (above, below) = (at(1.0)?, at(-1.0)?);
            for ((row, above), below) in states.by_parameters.iter_mut().zip(above).zip(below) {
                row[column] = (above - below) / (2.0 * STEP * error);
            }
        }
        Some(states)
    }

    /// Fitted to the readings of a record with constant parameters; `None` if the readings do not determine them.
    ///
    /// `frozen` and `model` are the same model against the same one record: the states alone are free in the first, all of
    /// [`FitUncertainty::entries`] too in the second. `x`: the parameters, then where the states start.
    ///
    /// # Errors
    /// Where the simulation is not finite.
    pub fn of_readings(
        frozen: &impl Residuals,
        model: &impl Residuals,
        x: &[f64],
        parameters: usize,
        known: &FitUncertainty,
        stopping: Stopping,
    ) -> Result<Option<Self>, Error> {
        let scales: Vec<f64> = known.noise.iter().map(ct_signals::ArModel::sigma).collect();
        let states = x.len() - parameters;
        let mut found = Self::known(x[parameters..].to_vec(), known.entries.len());
        let frozen = Weighted::new(frozen, &scales);
        if frozen.free().is_empty() {
            return Ok(Some(found));
        }
        let fit = fit_from(
            &frozen,
            vec![Start::from(x.to_vec())],
            &known.noise,
            stopping,
        )?;
        found.values.copy_from_slice(&fit.x[parameters..]);
        let model = Weighted::new(model, &scales);
        let Some(triangle) = linearise(&model, &fit.x, &known.noise) else {
            return Err(estimation::Error::NoFiniteStart { starts: 1 }.into());
        };
        let column = |entry: usize| model.free().iter().position(|free| *free == entry);
        let interior: Vec<usize> = fit.interior().iter().map(|&c| frozen.free()[c]).collect();
        let free_states = frozen.free().len();
        let own: Option<Vec<usize>> = interior.iter().map(|&entry| column(entry)).collect();
        let (Some(own), true) = (own, states >= free_states) else {
            return Ok(None);
        };
        let Some(inverse) = triangle.covariance(&own) else {
            return Ok(None);
        };
        // A state without influence on any reading is neither at a bound nor known.
        let silent = |c: usize| fit.triangle.column_norm(c) <= 0.0;
        if !fit.is_determined() || (0..free_states).any(silent) {
            return Ok(None);
        }
        let of_parameters: Vec<Option<usize>> =
            known.entries.iter().map(|&entry| column(entry)).collect();
        let order: Vec<usize> = own
            .iter()
            .copied()
            .chain(of_parameters.iter().flatten().copied())
            .collect();
        let r = triangle.select(&order);
        let n = own.len();
        let places: Vec<usize> = interior.iter().map(|entry| entry - parameters).collect();
        let variance = scales.first().map_or(1.0, |scale| scale * scale);
        for (i, row) in inverse.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                found.covariance[places[i]][places[j]] = variance * value;
            }
        }
        let there = of_parameters
            .iter()
            .enumerate()
            .filter(|(_, column)| column.is_some());
        for (at, (parameter, _)) in there.enumerate() {
            let mut moved = vec![0.0; n];
            for i in (0..n).rev() {
                let behind: f64 = (i + 1..n).map(|j| r.at(i, j) * moved[j]).sum();
                moved[i] = (-r.at(i, n + at) - behind) / r.at(i, i);
            }
            for (place, value) in places.iter().zip(moved) {
                found.by_parameters[*place][parameter] = value;
            }
        }
        Ok(Some(found))
    }
}

/// The standard error of the simulated output at every row of one record, a series for each output \[output unit\]; `None` where the
/// simulation is not finite.
///
/// `x`: the parameters, then `initial`'s values; `model` has all of [`FitUncertainty::entries`] and the initial states free.
#[must_use]
pub fn output_errors(
    model: &impl Residuals,
    x: &[f64],
    parameters: usize,
    known: &FitUncertainty,
    initial: &InitialStates,
) -> Option<Vec<Vec<f64>>> {
    let column = |entry: usize| model.free().iter().position(|free| *free == entry);
    let own: Vec<Option<usize>> = known.entries.iter().map(|&entry| column(entry)).collect();
    let states: Vec<Option<usize>> = (parameters..x.len()).map(column).collect();
    let mut errors = vec![Vec::new(); model.samples().len()];
    let quadratic = |matrix: &[Vec<f64>], v: &[f64]| -> f64 {
        let rows = matrix.iter().zip(v);
        let of_row = |row: &[f64]| row.iter().zip(v).map(|(c, b)| c * b).sum::<f64>();
        rows.map(|(row, a)| a * of_row(row)).sum()
    };
    model.each_row(x, |sample, row| {
        let at = |column: &Option<usize>| column.map_or(0.0, |column| row[column]);
        let by_state: Vec<f64> = states.iter().map(at).collect();
        let by_parameter: Vec<f64> = own
            .iter()
            .enumerate()
            .map(|(i, column)| {
                let moved = by_state.iter().zip(&initial.by_parameters);
                at(column) + moved.map(|(s, row)| s * row[i]).sum::<f64>()
            })
            .collect();
        let variance =
            quadratic(&known.covariance, &by_parameter) + quadratic(&initial.covariance, &by_state);
        errors[sample.output].push(variance.max(0.0).sqrt());
        true
    })?;
    Some(errors)
}

/// A model whose outputs are weighted by known noise.
struct Weighted<'m, M> {
    model: &'m M,
    scales: &'m [f64],
}

impl<'m, M: Residuals> Weighted<'m, M> {
    fn new(model: &'m M, scales: &'m [f64]) -> Self {
        Self { model, scales }
    }
}

impl<M: Residuals> Residuals for Weighted<'_, M> {
    fn free(&self) -> &[usize] {
        self.model.free()
    }

    fn bounds(&self) -> &[(f64, f64)] {
        self.model.bounds()
    }

    fn samples(&self) -> &[usize] {
        self.model.samples()
    }

    fn each_row(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.model.each_row(x, each)
    }

    fn each_residual(&self, x: &[f64], each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.model.each_residual(x, each)
    }

    fn floor(&self, output: usize) -> f64 {
        self.model.floor(output)
    }

    fn known_scales(&self) -> Option<&[f64]> {
        Some(self.scales)
    }

    fn priors(&self) -> &[Prior] {
        &[]
    }
}
