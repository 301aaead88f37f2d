//! Recursive least squares in continuous time.

use ct_rls::{
    ContinuousRls as Fixed, DynamicRls, Innovation, Outcome, RecursiveEstimator, Sample, Weights,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::error;

/// An estimator of any number of parameters; of few the crate's own for a number that is known when it is compiled, which is faster.
trait Online: Send + Sync {
    fn update(&mut self, phi: &[f64], y: f64, dt: f64) -> Innovation;
    /// Over whole arrays; the estimates after each sample go to `theta`, where it is not empty, and the innovations to `epsilon`.
    fn run(&mut self, phi: &[f64], y: &[f64], dt: &[f64], theta: &mut [f64], epsilon: &mut [f64]);
    fn theta(&self) -> Vec<f64>;
    /// Row by row.
    fn covariance(&self) -> Vec<Vec<f64>>;
    fn health(&self) -> Result<ct_rls::Health, ct_rls::Error>;
    fn boxed(&self) -> Box<dyn Online>;
}

impl<const P: usize> Online for Fixed<P> {
    fn update(&mut self, phi: &[f64], y: f64, dt: f64) -> Innovation {
        // The caller has checked the length.
        let phi = phi.first_chunk::<P>().copied().unwrap_or([f64::NAN; P]);
        RecursiveEstimator::update(self, &Sample::new(phi, y), dt)
    }

    fn run(&mut self, phi: &[f64], y: &[f64], dt: &[f64], theta: &mut [f64], epsilon: &mut [f64]) {
        // A local copy, which the compiler can keep in registers.
        let mut own = self.clone();
        let mut rows = theta.as_chunks_mut::<P>().0.iter_mut();
        let samples = phi.as_chunks::<P>().0.iter().zip(y).zip(epsilon);
        for (k, ((phi, y), epsilon)) in samples.enumerate() {
            let step = if dt.len() > 1 { dt[k] } else { dt[0] };
            let sample = Sample::new(*phi, *y);
            *epsilon = RecursiveEstimator::update(&mut own, &sample, step).epsilon;
            if let Some(row) = rows.next() {
                row.copy_from_slice(RecursiveEstimator::theta(&own).as_slice());
            }
        }
        *self = own;
    }

    fn theta(&self) -> Vec<f64> {
        RecursiveEstimator::theta(self).as_slice().to_vec()
    }

    fn covariance(&self) -> Vec<Vec<f64>> {
        let p = RecursiveEstimator::covariance(self);
        let rows = p.row_iter().map(|row| row.iter().copied().collect());
        rows.collect()
    }

    fn health(&self) -> Result<ct_rls::Health, ct_rls::Error> {
        RecursiveEstimator::health(self)
    }

    fn boxed(&self) -> Box<dyn Online> {
        Box::new(self.clone())
    }
}

/// Estimator for many parameters.
#[derive(Clone)]
struct Many(DynamicRls, Weights);

impl Online for Many {
    fn update(&mut self, phi: &[f64], y: f64, dt: f64) -> Innovation {
        self.0.update_with(phi, y, dt, &self.1)
    }

    fn run(&mut self, phi: &[f64], y: &[f64], dt: &[f64], theta: &mut [f64], epsilon: &mut [f64]) {
        let p = self.theta().len();
        let mut rows = theta.chunks_exact_mut(p);
        let samples = phi.chunks_exact(p).zip(y).zip(epsilon).enumerate();
        for (k, ((phi, y), epsilon)) in samples {
            let step = if dt.len() > 1 { dt[k] } else { dt[0] };
            *epsilon = self.0.update_with(phi, *y, step, &self.1).epsilon;
            if let Some(row) = rows.next() {
                row.copy_from_slice(self.0.theta().as_slice());
            }
        }
    }

    fn theta(&self) -> Vec<f64> {
        self.0.theta().as_slice().to_vec()
    }

    fn covariance(&self) -> Vec<Vec<f64>> {
        let p = self.0.covariance();
        let rows = p.row_iter().map(|row| row.iter().copied().collect());
        rows.collect()
    }

    fn health(&self) -> Result<ct_rls::Health, ct_rls::Error> {
        self.0.health()
    }

    fn boxed(&self) -> Box<dyn Online> {
        Box::new(self.clone())
    }
}

/// The estimator of so many parameters.
fn online(theta: &[f64], p: &[Vec<f64>], weights: Weights) -> PyResult<Box<dyn Online>> {
    fn fixed<const P: usize>(
        theta: &[f64],
        p: &[Vec<f64>],
        weights: Weights,
    ) -> Result<Box<dyn Online>, ct_rls::Error> {
        let matrix = SMatrix::<f64, P, P>::from_fn(|i, j| p[i][j]);
        let theta = SVector::from_column_slice(theta);
        Ok(Box::new(Fixed::<P>::new(theta, matrix, weights)?))
    }
    let made = match theta.len() {
        1 => fixed::<1>(theta, p, weights),
        2 => fixed::<2>(theta, p, weights),
        3 => fixed::<3>(theta, p, weights),
        4 => fixed::<4>(theta, p, weights),
        5 => fixed::<5>(theta, p, weights),
        6 => fixed::<6>(theta, p, weights),
        n => {
            let matrix = DMatrix::from_fn(n, n, |i, j| p[i][j]);
            let many = DynamicRls::new(DVector::from_column_slice(theta), &matrix, weights);
            many.map(|rls| Box::new(Many(rls, weights)) as Box<dyn Online>)
        }
    };
    made.map_err(error::of_model)
}

/// Recursive least squares in continuous time with forgetting, whose matrix stays positive definite.
///
/// `theta0`: first guess, one number for each parameter. `P0`: how little is known, symmetric and positive definite. `forgetting`: rate in
/// 1/s, the memory is its inverse; `c` and `gamma`: weights of the step and of the information, 1 of least squares.
///
/// Raises `ctid.ModelError` where these do not go together.
#[pyclass(module = "ctid._ctid")]
pub struct ContinuousRls {
    rls: Box<dyn Online>,
    size: usize,
    weights: Weights,
    outcome: Outcome,
}

fn rows_of(matrix: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    let matrix = matrix.as_array();
    matrix.rows().into_iter().map(|row| row.to_vec()).collect()
}

impl ContinuousRls {
    fn made(theta: &[f64], p: &[Vec<f64>], weights: Weights) -> PyResult<Self> {
        let n = theta.len();
        if n == 0 || p.len() != n || p.iter().any(|row| row.len() != n) {
            let columns = p.first().map_or(0, Vec::len);
            return Err(error::of_model(format!(
                "theta0 has {n} parameters and P0 is {} by {columns}: P0 has to be {n} by {n}, and there has to be a parameter",
                p.len()
            )));
        }
        Ok(Self {
            rls: online(theta, p, weights)?,
            size: n,
            weights,
            outcome: Outcome::Updated,
        })
    }

    fn wrong_size(&self, found: usize) -> PyErr {
        error::of_data(format!(
            "phi has {found} entries, and there are {0} parameters: give {0}",
            self.size
        ))
    }
}

#[pymethods]
impl ContinuousRls {
    #[new]
    #[pyo3(signature = (theta0, P0, forgetting, *, c=1.0, gamma=1.0))]
    #[allow(non_snake_case, reason = "it is the name of the matrix")]
    fn new(
        theta0: PyReadonlyArray1<'_, f64>,
        P0: PyReadonlyArray2<'_, f64>,
        forgetting: f64,
        c: f64,
        gamma: f64,
    ) -> PyResult<Self> {
        let weights = Weights::new(c, gamma, forgetting).map_err(error::of_model)?;
        Self::made(&theta0.as_array().to_vec(), &rows_of(&P0), weights)
    }

    /// Processes a sample: the regressor, the output, and the time in s over which they are held. Returns the innovation `y - theta' phi`
    /// before the update. A sample that cannot be used, such as a NaN, changes nothing; `outcome` gives the reason.
    fn update(&mut self, phi: &Bound<'_, PyAny>, y: f64, dt: f64) -> PyResult<f64> {
        let innovation = if let Ok(phi) = phi.cast::<PyArray1<f64>>() {
            // A few numbers are copied faster than it is noted that they are read.
            let Ok(phi) = phi.to_vec() else {
                return Err(error::of_data(
                    "phi is a part of an array with steps: give phi.copy()",
                ));
            };
            if phi.len() != self.size {
                return Err(self.wrong_size(phi.len()));
            }
            self.rls.update(&phi, y, dt)
        } else {
            let other =
                || error::of_data("phi is a list of numbers, or an array of floats with one axis");
            // Numpy converts an array with one entry to a number.
            if phi
                .cast::<PyUntypedArray>()
                .is_ok_and(|phi| phi.ndim() != 1)
            {
                return Err(other());
            }
            let phi: Vec<f64> = phi.extract().map_err(|_| other())?;
            if phi.len() != self.size {
                return Err(self.wrong_size(phi.len()));
            }
            self.rls.update(&phi, y, dt)
        };
        self.outcome = innovation.outcome;
        Ok(innovation.epsilon)
    }

    /// Takes in many samples: `phi` a row for each, `y` and `dt` a number for each, or one `dt` for all. Returns the estimates after each,
    /// a row for each sample, and the innovations; without `trajectory` the innovations alone.
    #[pyo3(signature = (phi, y, dt, *, trajectory=true))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        phi: PyReadonlyArray2<'py, f64>,
        y: PyReadonlyArray1<'py, f64>,
        dt: &Bound<'py, PyAny>,
        trajectory: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rows = phi.as_array().nrows();
        if phi.as_array().ncols() != self.size {
            return Err(self.wrong_size(phi.as_array().ncols()));
        }
        let steps: Vec<f64> = match dt.extract::<f64>() {
            Ok(dt) => vec![dt],
            Err(_) => {
                let steps: PyReadonlyArray1<'_, f64> = dt.extract().map_err(|_| {
                    error::of_data("dt is a number of seconds, or an array of them with one axis")
                })?;
                steps.as_array().to_vec()
            }
        };
        if y.as_array().len() != rows || (steps.len() != 1 && steps.len() != rows) {
            return Err(error::of_data(format!(
                "phi has {rows} rows, y {} and dt {}: give one of each for every sample, or one dt for all",
                y.as_array().len(),
                steps.len()
            )));
        }
        let copied: Vec<f64>;
        // A slice of an array in the order of Fortran would be its columns.
        let phi = match phi.as_slice() {
            Ok(slice) if phi.is_c_contiguous() => slice,
            _ => {
                copied = phi.as_array().iter().copied().collect();
                &copied
            }
        };
        let y_copied: Vec<f64>;
        let y = match y.as_slice() {
            Ok(slice) => slice,
            Err(_) => {
                y_copied = y.as_array().to_vec();
                &y_copied
            }
        };
        let mut theta = vec![0.0; if trajectory { rows * self.size } else { 0 }];
        let mut epsilon = vec![0.0; rows];
        let rls = &mut self.rls;
        py.detach(|| rls.run(phi, y, &steps, &mut theta, &mut epsilon));
        let epsilon = PyArray1::from_vec(py, epsilon);
        if !trajectory {
            return Ok(epsilon.into_any());
        }
        let theta = PyArray1::from_vec(py, theta).reshape([rows, self.size])?;
        Ok(PyTuple::new(py, [theta.into_any(), epsilon.into_any()])?.into_any())
    }

    /// The estimates.
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.rls.theta())
    }

    /// The covariance matrix of the estimator.
    #[getter]
    #[pyo3(name = "P")]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        PyArray2::from_vec2(py, &self.rls.covariance()).map_err(error::of_data)
    }

    /// Outcome of the last sample of `update`.
    #[getter]
    fn outcome(&self) -> String {
        format!("{:?}", self.outcome)
    }

    /// Whether the last sample of `update` was used.
    #[getter]
    fn used(&self) -> bool {
        self.outcome.used()
    }

    /// Smallest eigenvalue of the information matrix: the information on the least well determined combination of parameters.
    #[getter]
    fn excitation(&self) -> PyResult<f64> {
        let health = self.rls.health().map_err(error::of_model)?;
        Ok(health.excitation)
    }

    fn __copy__(&self) -> Self {
        Self {
            rls: self.rls.boxed(),
            ..*self
        }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    /// Arguments for restoring the estimator; its matrix is exact up to rounding.
    #[allow(clippy::type_complexity)]
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, f64),
        Bound<'py, pyo3::types::PyDict>,
    )> {
        let weights = pyo3::types::PyDict::new(py);
        weights.set_item("c", self.weights.c())?;
        weights.set_item("gamma", self.weights.gamma())?;
        let own = (self.theta(py), self.covariance(py)?, self.weights.eta());
        Ok((own, weights))
    }

    fn __getstate__(&self) {}

    fn __repr__(&self) -> String {
        format!("<ctid.ContinuousRls theta = {:?}>", self.rls.theta())
    }
}
