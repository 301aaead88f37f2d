//! Scores: does the learned model still fit, in each direction in which it may change, over windows of several lengths?
//!
//! For a direction `i` (a parameter of the plant, or an offset of the reading) let `s_i` be the derivative of the reading,
//! whitened by the noise's colour and in units of its innovations, and `e` the whitened residual. With `l = exp(-1/W)`,
//! ```text
//! z_i <- l z_i + s_i e      v_i <- l^2 v_i + s_i^2      c_i <- l c_i + s_i s_p      score_i = z_i/sqrt(v_i + c_i' P c_i)
//! ```
//! is the score statistic of a change of direction `i` within the window (M. Basseville, I. V. Nikiforov, Detection of Abrupt
//! Changes, 1993, ch. 8: the local approach), `s_p` the parameters' derivatives and `P` the covariance with which they were learned: an error
//! of learning leaves `c_i' dp` in `z_i`. The sum is a martingale in a loop too, where `s` hangs on the past noise. So the
//! score is standard normal where nothing has changed. `e` is cut at 4, so that a few wild readings do not raise an alarm.
//!
//! Cost: windows x directions x (parameters + 4) multiplications a row; the product with `P` only where `z_i^2/v_i` passes.

use serde::{Deserialize, Serialize};

/// Windows, in units of the slowest time constant or of [`FEWEST`] rows, whichever is longer.
const WINDOWS: [f64; 4] = [0.25, 0.75, 2.0, 6.0];
/// The unit of the windows is at least so many rows.
const FEWEST: f64 = 16.0;
/// Innovations count up to this many standard deviations.
const CUT: f64 = 4.0;

/// The lengths of the windows \[rows\], for a time constant in rows.
pub(crate) fn windows(time_constant: f64) -> [f64; WINDOWS.len()] {
    WINDOWS.map(|share| share * time_constant.max(FEWEST))
}

/// The scores' state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bank {
    lengths: Vec<f64>,
    keep: Vec<f64>,
    /// Parameters, which come first among the directions, and directions.
    parameters: usize,
    directions: usize,
    /// For each window and direction.
    z: Vec<f64>,
    v: Vec<f64>,
    /// For each window and direction, an entry for each parameter.
    c: Vec<f64>,
}

impl Bank {
    pub(crate) fn new(time_constant: f64, parameters: usize) -> Self {
        let lengths = windows(time_constant).to_vec();
        let directions = parameters + 1;
        let cells = lengths.len() * directions;
        Self {
            keep: lengths.iter().map(|w| (-1.0 / w).exp()).collect(),
            lengths,
            parameters,
            directions,
            z: vec![0.0; cells],
            v: vec![0.0; cells],
            c: vec![0.0; cells * parameters],
        }
    }

    pub(crate) fn directions(&self) -> usize {
        self.directions
    }

    pub(crate) fn sound(&self, parameters: usize) -> bool {
        let cells = self.lengths.len() * self.directions;
        self.parameters == parameters
            && self.directions == parameters + 1
            && self.keep.len() == self.lengths.len()
            && self.z.len() == cells
            && self.v.len() == cells
            && self.c.len() == cells * parameters
    }

    /// Takes in a whitened row: a derivative for each direction, then the residual. Whether a score passes the threshold;
    /// `covariance` is that of the parameters, row by row.
    pub(crate) fn update(&mut self, row: &[f64], covariance: &[f64], threshold: f64) -> bool {
        let (p, q) = (self.parameters, self.directions);
        let e = row[q].clamp(-CUT, CUT);
        let limit = threshold * threshold;
        let mut passed = false;
        for (w, &keep) in self.keep.iter().enumerate() {
            for i in 0..q {
                let cell = w * q + i;
                let s = row[i];
                let z = keep * self.z[cell] + s * e;
                let v = keep * keep * self.v[cell] + s * s;
                (self.z[cell], self.v[cell]) = (z, v);
                let c = &mut self.c[cell * p..][..p];
                for (c, sp) in c.iter_mut().zip(row) {
                    *c = keep * *c + s * sp;
                }
                if z * z > limit * v {
                    passed |= z * z > limit * (v + quadratic(c, covariance));
                }
            }
        }
        passed
    }

    /// The largest magnitude of a score.
    pub(crate) fn largest(&self, covariance: &[f64]) -> f64 {
        let p = self.parameters;
        let cells = self.z.iter().zip(&self.v).enumerate();
        cells
            .map(|(cell, (z, v))| {
                let variance = v + quadratic(&self.c[cell * p..][..p], covariance);
                z.abs() / variance.sqrt()
            })
            // Where nothing has been seen yet there is no score.
            .fold(0.0, f64::max)
    }
}

/// `c' P c`.
fn quadratic(c: &[f64], p: &[f64]) -> f64 {
    p.chunks_exact(c.len().max(1))
        .zip(c)
        .map(|(row, ci)| ci * row.iter().zip(c).map(|(p, c)| p * c).sum::<f64>())
        .sum()
}
