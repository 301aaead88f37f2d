//! Scores: tests whether the learned model still fits, in each direction of a possible change, over windows of several lengths.
//!
//! For a direction `i` (a parameter of the plant, or an offset of one output) let `s_io` be the derivative of the reading of output `o`,
//! whitened by the noise's spectrum and in units of its innovations, and `e_o` the whitened residual. With `l = exp(-1/W)`, a sample adds
//! over the outputs that have a reading
//! ```text
//! z_i <- l z_i + sum_o s_io e_o      v_i <- l^2 v_i + sum_o s_io^2      c_i <- l c_i + sum_o s_io s_po      score_i = z_i/sqrt(v_i + c_i' P c_i)
//! ```
//! is the score statistic of a change of direction `i` within the window (M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes,
//! 1993, ch. 8: the local approach), `s_p` the parameters' derivatives and `P` the covariance with which they were learned: an error of
//! learning leaves `c_i' dp` in `z_i`. The noises of the outputs are independent. The sum is a martingale in a loop too, where `s` depends
//! on the past noise. So the score is standard normal where nothing has changed. `e_o` is cut at 4, so that a few wild readings do not
//! raise an alarm.
//!
//! Cost: windows x directions x (parameters + 4) x outputs multiplications a sample; the product with `P` only where `z_i^2/v_i` passes.

use serde::{Deserialize, Serialize};

/// Windows, in units of the slowest time constant or of [`FEWEST`] rows, whichever is longer.
const WINDOWS: [f64; 4] = [0.25, 0.75, 2.0, 6.0];
/// The unit of the windows is at least this number of rows.
const FEWEST: f64 = 16.0;
/// Innovations are clipped at this many standard deviations.
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
    /// Number of parameters, which come first among the directions, and of directions: after the parameters there is an offset of each
    /// output.
    parameters: usize,
    directions: usize,
    /// One sum for each window and direction.
    z: Vec<f64>,
    v: Vec<f64>,
    /// For each window and direction, one entry for each parameter.
    c: Vec<f64>,
}

impl Bank {
    pub(crate) fn new(time_constant: f64, parameters: usize, outputs: usize) -> Self {
        let lengths = windows(time_constant).to_vec();
        let directions = parameters + outputs;
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

    pub(crate) fn parameters(&self) -> usize {
        self.parameters
    }

    /// Forgets what has been summed up.
    pub(crate) fn begin(&mut self) {
        for sums in [&mut self.z, &mut self.v, &mut self.c] {
            sums.fill(0.0);
        }
    }

    pub(crate) fn sound(&self, parameters: usize, outputs: usize) -> bool {
        let cells = self.lengths.len() * self.directions;
        self.parameters == parameters
            && self.directions == parameters + outputs
            && self.keep.len() == self.lengths.len()
            && self.z.len() == cells
            && self.v.len() == cells
            && self.c.len() == cells * parameters
    }

    /// Processes the whitened rows of a sample, one for each output with a reading: a derivative for each direction, then the residual.
    /// Returns whether a score exceeds the threshold; `covariance` is that of the parameters, row by row.
    pub(crate) fn update(&mut self, rows: &[f64], covariance: &[f64], threshold: f64) -> bool {
        let (p, q) = (self.parameters, self.directions);
        let limit = threshold * threshold;
        let mut passed = false;
        for (w, &keep) in self.keep.iter().enumerate() {
            for i in 0..q {
                let cell = w * q + i;
                let (mut z, mut v) = (keep * self.z[cell], keep * keep * self.v[cell]);
                let c = &mut self.c[cell * p..][..p];
                for c in c.iter_mut() {
                    *c *= keep;
                }
                for row in rows.chunks_exact(q + 1) {
                    let (s, e) = (row[i], row[q].clamp(-CUT, CUT));
                    z += s * e;
                    v += s * s;
                    for (c, sp) in c.iter_mut().zip(row) {
                        *c += s * sp;
                    }
                }
                (self.z[cell], self.v[cell]) = (z, v);
                if z * z > limit * v {
                    passed |= z * z > limit * (v + quadratic(c, covariance));
                }
            }
        }
        passed
    }

    /// The largest magnitude of a score.
    pub(crate) fn largest(&self, covariance: &[f64]) -> f64 {
        let cells = 0..self.z.len();
        // Before the first row there is no score.
        cells
            .map(|cell| self.score(cell, covariance))
            .fold(0.0, f64::max)
    }

    /// The output whose offset has the largest score.
    pub(crate) fn most_at(&self, covariance: &[f64]) -> usize {
        let of_output = |output: usize| {
            let cells = (self.parameters + output..self.z.len()).step_by(self.directions);
            cells
                .map(|cell| self.score(cell, covariance))
                .fold(0.0, f64::max)
        };
        let outputs = 0..self.directions - self.parameters;
        let scores = outputs.map(|output| (output, of_output(output)));
        scores
            .max_by(|(_, a), (_, b)| a.total_cmp(b))
            .map_or(0, |(output, _)| output)
    }

    /// The magnitude of a score.
    fn score(&self, cell: usize, covariance: &[f64]) -> f64 {
        let c = &self.c[cell * self.parameters..][..self.parameters];
        let variance = self.v[cell] + quadratic(c, covariance);
        self.z[cell].abs() / variance.sqrt()
    }
}

/// `c' P c`.
fn quadratic(c: &[f64], p: &[f64]) -> f64 {
    p.chunks_exact(c.len().max(1))
        .zip(c)
        .map(|(row, ci)| ci * row.iter().zip(c).map(|(p, c)| p * c).sum::<f64>())
        .sum()
}
