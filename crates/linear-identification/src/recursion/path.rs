//! Trajectory of a recursion over a record.

use nalgebra::{DMatrix, DVector};

use super::scaled::Scaled;
use crate::{Error, Order, Warning};

/// Number of stored points of the trajectory.
const POINTS: usize = 500;

/// A point of the recursion's trajectory.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// Index of the sample.
    pub sample: usize,
    /// Time with readings, scaled.
    pub time: f64,
    pub theta: DVector<f64>,
    /// `P^-1`
    pub information: DMatrix<f64>,
}

/// Trajectory of the recursion over the record.
#[derive(Debug, Clone)]
pub(super) struct Path {
    pub order: Order,
    pub points: Vec<Point>,
    /// Bounds on the parameters were active in the second half: then the variance of the estimates contains no information about their
    /// errors.
    pub held: bool,
    pub warnings: Vec<Warning>,
}

impl Path {
    pub fn new(order: Order) -> Self {
        Self {
            order,
            points: Vec::new(),
            held: false,
            warnings: Vec::new(),
        }
    }

    pub fn last(&self) -> Result<&Point, Error> {
        self.points.last().ok_or(Error::NoSample)
    }

    pub fn keep(
        &mut self,
        (sample, time): (usize, f64),
        theta: &[f64],
        covariance: DMatrix<f64>,
    ) -> Result<(), Error> {
        let information = covariance
            .try_inverse()
            .filter(|information| information.iter().all(|x| x.is_finite()))
            .ok_or(Error::Untold { order: self.order })?;
        self.points.push(Point {
            sample,
            time,
            theta: DVector::from_column_slice(theta),
            information,
        });
        Ok(())
    }
}

/// Whether the k-th of `count` samples is stored.
pub(super) fn is_kept(k: usize, count: usize) -> bool {
    k + 1 == count || k.is_multiple_of(count.div_ceil(POINTS))
}

/// Total time and number of the rows that were used for updates.
pub(super) struct Learnt {
    time: f64,
    pub rows: usize,
    /// Whether all readings are present: then the time equals the record's own exactly.
    whole: bool,
}

impl Learnt {
    pub fn of(scaled: &Scaled) -> Self {
        Self {
            time: 0.0,
            rows: 0,
            whole: scaled.y.iter().all(|y| !y.is_nan()),
        }
    }

    /// At a sample.
    pub fn time(&self, k: usize, scaled: &Scaled) -> f64 {
        if self.whole {
            scaled.time[k]
        } else {
            self.time
        }
    }

    /// Adds a row that was held for a time, and whether it was used for an update.
    pub fn after(&mut self, learnt: bool, held: f64) {
        if learnt {
            self.time += held;
            self.rows += 1;
        }
    }
}
