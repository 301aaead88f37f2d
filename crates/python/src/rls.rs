//! Recursive least squares in continuous time.

mod online;

use ct_rls::{Outcome, Weights};
use numpy::{
    Ix1, Ix2, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};

use self::online::{Online, Others, online, restored};
use crate::{arrays, error};

/// Recursive least squares in continuous time with forgetting, whose matrix stays positive definite.
///
/// `theta0`: first guess, one number for each parameter. `P0`: how little is known, symmetric and positive definite. `forgetting`: rate in 1/s, the
/// memory is its inverse; `c` and `gamma`: weights of the step and of the information, 1 of least squares.
///
/// Raises `ctid.ModelError` where these are inconsistent.
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
        theta0: &Bound<'_, PyAny>,
        P0: &Bound<'_, PyAny>,
        forgetting: f64,
        c: f64,
        gamma: f64,
    ) -> PyResult<Self> {
        let weights = Weights::new(c, gamma, forgetting).map_err(error::of_model)?;
        let theta = arrays::list("theta0", theta0)?;
        Self::made(
            &theta,
            &rows_of(&arrays::numbers::<Ix2>("P0", P0)?),
            weights,
        )
    }

    /// Takes in a sample: the regressor, the output, and the time in s over which they are held. Returns the innovation `y - theta' phi` before
    /// it. A sample that cannot be used, a NaN say, changes nothing; `outcome` says why.
    fn update(&mut self, phi: &Bound<'_, PyAny>, y: f64, dt: f64) -> PyResult<f64> {
        // A few numbers are copied faster than it is noted that they are read.
        let copied = phi.cast::<PyArray1<f64>>().ok();
        let copied = copied.and_then(|phi| phi.to_vec().ok());
        let phi = match copied {
            Some(phi) => phi,
            None => arrays::list("phi", phi)?,
        };
        if phi.len() != self.size {
            return Err(self.wrong_size(phi.len()));
        }
        let innovation = self.rls.update(&phi, y, dt);
        self.outcome = innovation.outcome;
        Ok(innovation.epsilon)
    }

    /// Takes in many samples: `phi` a row for each, `y` and `dt` a number for each, or one `dt` for all. Returns the estimates after each, a row
    /// for each sample, and the innovations; without `trajectory` the innovations alone.
    #[pyo3(signature = (phi, y, dt, *, trajectory=true))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        phi: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        dt: &Bound<'py, PyAny>,
        trajectory: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let phi = arrays::numbers::<Ix2>("phi", phi)?;
        let y = arrays::numbers::<Ix1>("y", y)?;
        let rows = phi.as_array().nrows();
        if phi.as_array().ncols() != self.size {
            return Err(self.wrong_size(phi.as_array().ncols()));
        }
        let steps: Vec<f64> = match dt.extract::<f64>() {
            Ok(dt) => vec![dt],
            Err(_) => arrays::list("dt", dt)?,
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

    /// The matrix that stands for their covariance.
    #[getter]
    #[pyo3(name = "P")]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        PyArray2::from_vec2(py, &self.rls.covariance()).map_err(error::of_data)
    }

    /// What was done with the last sample of `update`.
    #[getter]
    fn outcome(&self) -> String {
        format!("{:?}", self.outcome)
    }

    /// Whether the last sample of `update` was used.
    #[getter]
    fn used(&self) -> bool {
        self.outcome.used()
    }

    /// Smallest eigenvalue of the information matrix: how well the combination of parameters is known that is known worst.
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

    /// The state, for pickling; a restored estimator gives bit-identical results.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let others = Others {
            size: self.size,
            weights: self.weights,
            outcome: self.outcome,
        };
        Ok(PyBytes::new(py, &self.rls.bytes(others)?))
    }

    #[staticmethod]
    fn from_bytes(content: &[u8]) -> PyResult<Self> {
        let (others, rls) = restored(content)?;
        let Others {
            size,
            weights,
            outcome,
        } = others;
        Ok(Self {
            rls,
            size,
            weights,
            outcome,
        })
    }

    #[allow(clippy::type_complexity)]
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let restore = py.get_type::<Self>().getattr("from_bytes")?;
        Ok((restore, (self.to_bytes(py)?,)))
    }

    fn __repr__(&self) -> String {
        format!("<ctid.ContinuousRls theta = {:?}>", self.rls.theta())
    }
}
