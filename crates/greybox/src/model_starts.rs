//! Start values of fits of a user's own model.
//!
//! The properties of such a model are not known in advance, so there are four kinds of starts: the values of the text; the best of many
//! points around them, by a simulation of each without derivatives; the results of fits with an observer ([`crate::model_observer`]); and
//! the results of fits to growing first parts of the records, because a criterion over a long record has many local minima that one over a
//! short record does not have (L. Ljung, System Identification, 2nd ed., 1999, section 10.5).
//!
//! The points are a scrambled Sobol sequence (A. B. Owen, Journal of Complexity 14 (1998) 466-489), in the logarithm of what has a sign.

use estimation::{Noise, Residuals, Start, Stopping, fit_from, squares, within};
use rayon::prelude::*;
use sobol_burley::sample;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::ModelSetup;

/// Spread of the starts of parameters, in logarithms: half of the guesses are wrong by more than a factor of two ...
const SPREAD: f64 = 0.8;
/// ... and of the initial states that no output measures.
const STATE_SPREAD: f64 = 0.5;
/// Number of simulated points per fitted start.
const POINTS: usize = 16;
/// The first parts of the records, which are fitted one after the other, as shares of each.
const HORIZONS: [f64; 3] = [0.03, 0.1, 0.3];
/// The least samples of a first part for every fitted number.
const LEAST: usize = 4;
/// Number of starts for the fits of growing first parts.
const GROWING: usize = 4;
/// Number of starts for the observer fits.
const OBSERVED: usize = 2;
/// Dimensions of the sequence; later parameters keep their start values.
const DIMENSIONS: usize = 256;

impl ModelSetup<'_> {
    /// `n` starts or a few more, the text's own first.
    pub(crate) fn starts(&self, n: usize, seed: u64, stopping: Stopping) -> Vec<Start> {
        let mut points = self.points(n * POINTS, seed);
        let white = Noise::white(self.outputs());
        let cost = |x: &Vec<f64>| {
            if self.out_of_time() {
                return f64::INFINITY;
            }
            let cost = squares(self, x, &white).map(|squares| squares.cost());
            cost.filter(|cost| cost.is_finite())
                .unwrap_or(f64::INFINITY)
        };
        let mut scored: Vec<(f64, Vec<f64>)> = points
            .par_drain(..)
            .map(|point| (cost(&point), point))
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts: Vec<Vec<f64>> = vec![self.start().to_vec()];
        starts.extend(
            scored
                .into_iter()
                .map(|(_, point)| point)
                .take(n.max(1) - 1),
        );
        let observed: Vec<Vec<f64>> = starts[..starts.len().min(OBSERVED)]
            .par_iter()
            .filter_map(|start| self.observed_from(start))
            .collect();
        let grown: Vec<Vec<f64>> = starts[..starts.len().min(GROWING)]
            .par_iter()
            .filter_map(|start| self.grown(start, &white, stopping))
            .collect();
        starts.extend(grown);
        starts.extend(observed);
        starts.into_iter().map(Start::from).collect()
    }

    /// Result of fits of growing first parts of the records from a start; `None` if these are too short.
    fn grown(&self, start: &[f64], noise: &Noise, stopping: Stopping) -> Option<Vec<f64>> {
        let mut x = None;
        for share in HORIZONS {
            let records = self.first_rows(share);
            let short = self.against(&records);
            let samples: usize = short.samples_per_output().iter().sum();
            if samples < LEAST * self.free().len() {
                continue;
            }
            let from = x.unwrap_or_else(|| start.to_vec());
            x = match fit_from(&short, vec![from.clone().into()], noise, stopping) {
                Ok(fit) => Some(fit.x),
                Err(_) => Some(from),
            };
        }
        x
    }

    /// Points around the start.
    fn points(&self, n: usize, seed: u64) -> Vec<Vec<f64>> {
        let Ok(normal) = Normal::new(0.0, 1.0) else {
            return Vec::new();
        };
        // Groups of four dimensions are scrambled equally; the seed of the fit scrambles all.
        let seed = (seed ^ (seed >> 32)) as u32;
        let spread: Vec<usize> = self
            .free()
            .iter()
            .copied()
            .filter(|&i| !self.is_read(i))
            .collect();
        let point = |k: usize| {
            let mut point = self.start().to_vec();
            for (dimension, &i) in spread.iter().enumerate().take(DIMENSIONS) {
                let uniform = f64::from(sample(k as u32, dimension as u32, seed));
                let draw = normal.inverse_cdf(uniform.clamp(1e-6, 1.0 - 1e-6));
                point[i] = within(self.moved(i, draw), self.bound(i));
            }
            point
        };
        (0..n).map(point).collect()
    }

    /// An entry at this number of deviations from its start.
    fn moved(&self, i: usize, draw: f64) -> f64 {
        let (value, (low, high)) = (self.start()[i], self.bound(i));
        if i >= self.parameter_count() {
            // A state may be near zero by chance: its bounds give the scale of its uncertainty.
            let reach = if value == 0.0 { 1.0 } else { value.abs() };
            return value + STATE_SPREAD * draw * reach;
        }
        if value == 0.0 {
            let reach = if high.is_finite() && low.is_finite() {
                0.2 * (high - low)
            } else {
                1.0
            };
            return draw * reach;
        }
        value * (SPREAD * draw).exp()
    }
}
