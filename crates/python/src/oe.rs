//! Output error methods: the stabilised one sample by sample, that of a closed loop over whole records.

use ct_lti::Hold;
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use fcloe::{Controller, LoopRecord, Offsets, Orders, Problem, Settings, start};
use nalgebra::{SMatrix, SVector};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde::{Deserialize, Serialize};
use stabilized_oe::{BlockDiagonal, IoSample, StabilizedOe as Estimator, StateVariableFilters};

use crate::{arrays, bytes, error};

/// An estimator of the crate with orders that are known at compile time.
trait Oe: Send + Sync {
    fn update(&mut self, u: f64, y: f64, dt: f64) -> f64;
    fn theta(&self) -> Vec<f64>;
    fn filter(&self) -> Vec<f64>;
    fn model_output(&self) -> f64;
    fn boxed(&self) -> Box<dyn Oe>;
    fn bytes(&self, kind: Kind) -> PyResult<Vec<u8>>;
}

/// Orders n and m, and whether there is an offset: which of the types it is.
type Kind = (usize, usize, bool);

type Own<const N: usize, const P: usize> =
    Estimator<N, P, BlockDiagonal<N, P>, StateVariableFilters<N>>;

impl<const N: usize, const P: usize> Oe for Own<N, P> {
    fn update(&mut self, u: f64, y: f64, dt: f64) -> f64 {
        RecursiveEstimator::update(self, &IoSample { u, y }, dt).epsilon
    }

    fn theta(&self) -> Vec<f64> {
        RecursiveEstimator::theta(self).as_slice().to_vec()
    }

    fn filter(&self) -> Vec<f64> {
        Estimator::filter(self).as_slice().to_vec()
    }

    fn model_output(&self) -> f64 {
        Estimator::model_output(self)
    }

    fn boxed(&self) -> Box<dyn Oe> {
        Box::new(self.clone())
    }

    fn bytes(&self, kind: Kind) -> PyResult<Vec<u8>> {
        bytes::of(&Kept {
            kind,
            estimator: self.clone(),
        })
    }
}

/// An estimator as it is pickled.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    kind: Kind,
    estimator: T,
}

/// The type of an estimator alone.
#[derive(Deserialize)]
struct KeptKind {
    kind: Kind,
}

/// An estimator from its bytes.
fn kept<const N: usize, const P: usize>(content: &[u8]) -> PyResult<Box<dyn Oe>> {
    let kept: Kept<Own<N, P>> = bytes::read(content)?;
    Ok(Box::new(kept.estimator))
}

/// Arguments of an estimator.
struct Start<'a> {
    theta: &'a [f64],
    filter: &'a [f64],
    p_theta: f64,
    p_filter: f64,
    forgetting: f64,
    bandwidth: f64,
    hold: Hold,
}

fn own<const N: usize, const P: usize>(start: &Start) -> Result<Own<N, P>, stabilized_oe::Error> {
    let weights = Weights::least_squares(start.forgetting)?;
    let still = Weights::least_squares(0.0)?;
    let theta = SVector::<f64, P>::from_column_slice(start.theta);
    let filter = SVector::<f64, N>::from_column_slice(start.filter);
    let theta = ContinuousRls::new(theta, SMatrix::identity() * start.p_theta, weights)?;
    let filter = ContinuousRls::new(filter, SMatrix::identity() * start.p_filter, still)?;
    let filters = StateVariableFilters::<N>::with_input(start.bandwidth, start.hold)?;
    Own::<N, P>::new(BlockDiagonal::new(theta, filter), filters)
}

fn made<const N: usize, const P: usize>(
    start: &Start,
) -> Result<Box<dyn Oe>, stabilized_oe::Error> {
    Ok(Box::new(own::<N, P>(start)?))
}

/// The last parameter is the offset.
fn with_offset<const N: usize, const P: usize>(
    start: &Start,
) -> Result<Box<dyn Oe>, stabilized_oe::Error> {
    Ok(Box::new(own::<N, P>(start)?.with_offset()))
}

/// Calls the first function without an offset, the second with one, for the orders of an estimator and its number of parameters.
macro_rules! of_kind {
    ($kind:expr, $plain:ident($argument:expr), $offset:ident($other:expr)) => {
        match $kind {
            (1, _, false) => $plain::<1, 2>($argument),
            (1, _, true) => $offset::<1, 3>($other),
            (2, 0, false) => $plain::<2, 3>($argument),
            (2, 0, true) => $offset::<2, 4>($other),
            (2, _, false) => $plain::<2, 4>($argument),
            (2, _, true) => $offset::<2, 5>($other),
            (_, 0, false) => $plain::<3, 4>($argument),
            (_, 0, true) => $offset::<3, 5>($other),
            (_, 1, false) => $plain::<3, 5>($argument),
            (_, 1, true) => $offset::<3, 6>($other),
            (_, _, false) => $plain::<3, 6>($argument),
            (_, _, true) => $offset::<3, 7>($other),
        }
    };
}

/// Recursive output error in continuous time, `A(s) y = B(s) u`, with a filter of its error that is adapted beside it.
///
/// `order`: `(n, m)`, n from 1 to 3 and m below n. `theta0`: `a1..an, b0..bm`, and an offset where there is one; A has to be stable.
/// `forgetting`: rate in 1/s. `bandwidth`: of the filters that make the derivatives, in 1/s, 2 to 10 times that of the plant. `P0`,
/// `P0_filter`: how little is known, on the diagonals. `filter0`: start of the filter's coefficients, without it those of A.
///
/// Raises `ctid.ModelError`.
#[pyclass(module = "ctid._ctid")]
pub struct StabilizedOe {
    oe: Box<dyn Oe>,
    kind: Kind,
}

#[pymethods]
impl StabilizedOe {
    #[new]
    #[pyo3(signature = (
        order, theta0, forgetting, bandwidth, *, P0=1e3, P0_filter=1.0, filter0=None, hold="zero", offset=false
    ))]
    #[allow(clippy::too_many_arguments, reason = "Python passes them by name")]
    #[allow(non_snake_case, reason = "it is the name of the matrix")]
    fn new(
        order: &Bound<'_, PyAny>,
        theta0: &Bound<'_, PyAny>,
        forgetting: f64,
        bandwidth: f64,
        P0: f64,
        P0_filter: f64,
        filter0: Option<&Bound<'_, PyAny>>,
        hold: &str,
        offset: bool,
    ) -> PyResult<Self> {
        let of = |order: &Bound<'_, PyAny>| order.extract::<(usize, usize)>().ok();
        let fits = |(n, m): &(usize, usize)| (1..=3).contains(n) && m < n;
        let (n, m) = of(order).filter(fits).ok_or_else(|| {
            error::of_model(format!(
                "an order is (n, m) with n from 1 to 3 and m below n; it is {order}"
            ))
        })?;
        let theta0 = arrays::list("theta0", theta0)?;
        let count = n + m + 1 + usize::from(offset);
        if theta0.len() != count {
            return Err(error::of_model(format!(
                "theta0 has {} numbers, and the order ({n}, {m}) has {count} parameters: a1..an, b0..bm{}",
                theta0.len(),
                if offset { ", offset" } else { "" }
            )));
        }
        let filter = match filter0 {
            Some(filter) => arrays::list("filter0", filter)?,
            None => theta0[..n].to_vec(),
        };
        if filter.len() != n {
            return Err(error::of_model(format!(
                "filter0 has {} numbers: it needs {n}",
                filter.len()
            )));
        }
        let hold = match crate::frame::hold_of(hold)? {
            ct_signals::Hold::Zero => Hold::Zero,
            ct_signals::Hold::First => Hold::First,
        };
        let start = Start {
            theta: &theta0,
            filter: &filter,
            p_theta: P0,
            p_filter: P0_filter,
            forgetting,
            bandwidth,
            hold,
        };
        let kind = (n, m, offset);
        let made = of_kind!(kind, made(&start), with_offset(&start));
        Ok(Self {
            oe: made.map_err(error::of_model)?,
            kind,
        })
    }

    /// Processes a sample that is held over `dt` seconds. Returns the innovation before the update.
    fn update(&mut self, u: f64, y: f64, dt: f64) -> f64 {
        self.oe.update(u, y, dt)
    }

    /// Processes many samples, one `dt` in s for all. Returns the estimates after each, a row for each sample.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        dt: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (u, y) = (arrays::list("u", u)?, arrays::list("y", y)?);
        if u.len() != y.len() {
            return Err(error::of_data(format!(
                "u has {} values and y {}: give one of each for every sample",
                u.len(),
                y.len()
            )));
        }
        let rows = u.len();
        let own = &mut self.oe;
        let columns = own.theta().len();
        let all = py.detach(|| {
            let mut all = Vec::with_capacity(rows * columns);
            for (u, y) in u.iter().zip(&y) {
                own.update(*u, *y, dt);
                all.extend(own.theta());
            }
            all
        });
        PyArray1::from_vec(py, all).reshape([rows, columns])
    }

    /// `a1..an, b0..bm`, and the offset.
    #[getter]
    fn theta<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.oe.theta())
    }

    /// Coefficients of the filter of the error.
    #[getter]
    fn filter<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.oe.filter())
    }

    /// Present output of the model.
    #[getter]
    fn model_output(&self) -> f64 {
        self.oe.model_output()
    }

    fn __copy__(&self) -> Self {
        Self {
            oe: self.oe.boxed(),
            ..*self
        }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    /// The state, for pickling; a restored estimator gives bit-identical results.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.oe.bytes(self.kind)?))
    }

    #[staticmethod]
    fn from_bytes(content: &[u8]) -> PyResult<Self> {
        let KeptKind { kind } = bytes::read(content)?;
        let oe = of_kind!(kind, kept(content), kept(content))?;
        Ok(Self { oe, kind })
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
        format!("<ctid.StabilizedOe theta = {:?}>", self.oe.theta())
    }
}

/// Operating point of the signals.
fn offsets(levels: &str) -> PyResult<Offsets> {
    match levels {
        "estimated" => Ok(Offsets::Estimated),
        "deviations" => Ok(Offsets::Deviations),
        "mean" => Ok(Offsets::Means),
        other => Err(error::of_model(format!(
            "levels is \"estimated\", \"deviations\" or \"mean\", and not \"{other}\""
        ))),
    }
}

/// Closed-loop output error over a whole record, sampled evenly: the plant in the loop of a known controller, or without one in open loop.
#[pyfunction]
#[pyo3(signature = (dt, r, u, y, *, order, controller, levels, theta0, level))]
#[allow(clippy::too_many_arguments, reason = "Python passes them by name")]
pub fn fcloe_fit<'py>(
    py: Python<'py>,
    dt: f64,
    r: Option<Vec<f64>>,
    u: Option<Vec<f64>>,
    y: Vec<f64>,
    order: (usize, usize),
    controller: Option<(Vec<f64>, Vec<f64>)>,
    levels: &str,
    theta0: Option<Vec<f64>>,
    level: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let orders = Orders {
        n: order.0,
        m: order.1,
    };
    let controller = crate::identify::controller(controller)?;
    let controller = controller.unwrap_or_else(Controller::none);
    let offsets = offsets(levels)?;
    let record = match (r, u) {
        (Some(r), u) if !controller.is_open_loop() => LoopRecord::closed_loop(dt, r, u, y, offsets),
        (_, Some(u)) => LoopRecord::open_loop(dt, u, y, offsets),
        _ => {
            return Err(error::of_data(
                "a loop needs its reference r, and a plant without a controller its input u",
            ));
        }
    };
    let records = [record];
    let found = py.detach(|| -> Result<_, fcloe::Error> {
        let problem = Problem::new(&records, &controller, orders)?;
        let start = match &theta0 {
            Some(theta) => fcloe::PlantModel::from_theta(orders, theta)?,
            None => {
                let settings = start::PipelineSettings::default();
                let all = start::pipeline(&records, &controller, orders, &settings)?;
                all.into_iter().next().ok_or(fcloe::Error::NoRecord)?.plant
            }
        };
        let fit = problem.fit(&start, &Settings::default())?;
        let known = problem.uncertainty(&fit, None)?;
        let halves = known.half_widths(level)?;
        Ok((fit, known, halves))
    });
    let (fit, known, halves) = found.map_err(error::of_data)?;
    let all = PyDict::new(py);
    let theta = fit.plant.theta().to_vec();
    let count = theta.len();
    all.set_item("theta", PyArray1::from_vec(py, theta))?;
    all.set_item("std_errors", PyArray1::from_slice(py, &known.std_errors))?;
    all.set_item("half_widths", PyArray1::from_vec(py, halves))?;
    let covariance = known.covariance.iter().take(count);
    let covariance: Vec<Vec<f64>> = covariance.map(|row| row[..count].to_vec()).collect();
    let covariance = PyArray2::from_vec2(py, &covariance).map_err(error::of_data)?;
    all.set_item("cov", covariance)?;
    all.set_item("residual_rms", fit.residual_rms())?;
    all.set_item("stop", format!("{:?}", fit.stop))?;
    all.set_item("successful", fit.stop.was_successful())?;
    all.set_item("iterations", fit.iterations)?;
    Ok(all)
}
