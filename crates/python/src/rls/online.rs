//! Recursive estimators of any number of parameters behind one interface.

use ct_rls::{
    ContinuousRls as Fixed, DynamicRls, Innovation, Outcome, RecursiveEstimator, Sample, Weights,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::{bytes, error};

/// An estimator of any number of parameters; of few the crate's own for a number that is known when it is compiled, which is faster.
pub trait Online: Send + Sync {
    fn update(&mut self, phi: &[f64], y: f64, dt: f64) -> Innovation;
    /// Over whole arrays; the estimates after each sample go to `theta`, where it is not empty, and the innovations to `epsilon`.
    fn run(&mut self, phi: &[f64], y: &[f64], dt: &[f64], theta: &mut [f64], epsilon: &mut [f64]);
    fn theta(&self) -> Vec<f64>;
    /// Row by row.
    fn covariance(&self) -> Vec<Vec<f64>>;
    fn health(&self) -> Result<ct_rls::Health, ct_rls::Error>;
    fn boxed(&self) -> Box<dyn Online>;
    fn bytes(&self, others: Others) -> PyResult<Vec<u8>>;
}

/// Data that are pickled together with an estimator.
#[derive(Serialize, Deserialize)]
pub struct Others {
    pub size: usize,
    pub weights: Weights,
    pub outcome: Outcome,
}

/// An estimator as it is pickled.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    others: Others,
    rls: T,
}

/// Of a pickled estimator, the data other than the estimator itself.
#[derive(Deserialize)]
struct KeptOthers {
    others: Others,
}

/// An estimator from its bytes.
fn kept<T: Online + DeserializeOwned + 'static>(content: &[u8]) -> PyResult<Box<dyn Online>> {
    Ok(Box::new(bytes::read::<Kept<T>>(content)?.rls))
}

impl<const P: usize> Online for Fixed<P> {
    fn update(&mut self, phi: &[f64], y: f64, dt: f64) -> Innovation {
        // Whoever calls this has counted them.
        let phi = phi.first_chunk::<P>().copied().unwrap_or([f64::NAN; P]);
        RecursiveEstimator::update(self, &Sample::new(phi, y), dt)
    }

    fn run(&mut self, phi: &[f64], y: &[f64], dt: &[f64], theta: &mut [f64], epsilon: &mut [f64]) {
        // A copy of its own, which the compiler keeps in registers where it can.
        let mut own = self.clone();
        let step = |k: usize| if dt.len() > 1 { dt[k] } else { dt[0] };
        let samples = phi.as_chunks::<P>().0.iter().zip(y);
        let samples = samples.map(|(phi, y)| Sample::new(*phi, *y)).zip(epsilon);
        let rows = theta.as_chunks_mut::<P>().0;
        if rows.is_empty() {
            for (k, (sample, epsilon)) in samples.enumerate() {
                *epsilon = RecursiveEstimator::update(&mut own, &sample, step(k)).epsilon;
            }
        } else {
            for (k, ((sample, epsilon), row)) in samples.zip(rows).enumerate() {
                *epsilon = RecursiveEstimator::update(&mut own, &sample, step(k)).epsilon;
                *row = RecursiveEstimator::theta(&own).data.0[0];
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

    fn bytes(&self, others: Others) -> PyResult<Vec<u8>> {
        let rls = self.clone();
        bytes::of(&Kept { others, rls })
    }
}

/// Of many parameters.
#[derive(Clone, Serialize, Deserialize)]
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

    fn bytes(&self, others: Others) -> PyResult<Vec<u8>> {
        let rls = self.clone();
        bytes::of(&Kept { others, rls })
    }
}

/// The estimator for `theta.len()` parameters.
pub fn online(theta: &[f64], p: &[Vec<f64>], weights: Weights) -> PyResult<Box<dyn Online>> {
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

/// A pickled estimator, and the data that were pickled with it.
pub fn restored(content: &[u8]) -> PyResult<(Others, Box<dyn Online>)> {
    let KeptOthers { others } = bytes::read(content)?;
    let rls = match others.size {
        1 => kept::<Fixed<1>>(content)?,
        2 => kept::<Fixed<2>>(content)?,
        3 => kept::<Fixed<3>>(content)?,
        4 => kept::<Fixed<4>>(content)?,
        5 => kept::<Fixed<5>>(content)?,
        6 => kept::<Fixed<6>>(content)?,
        _ => kept::<Many>(content)?,
    };
    Ok((others, rls))
}
