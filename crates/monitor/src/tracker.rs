//! Tracks the parameters: recursive least squares with forgetting on the whitened residuals of all outputs and their exact derivatives.
//!
//! Around the learned model the residual is `r = s' (theta - theta_0)` plus noise, so the deviation of the parameters is
//! estimated by [`DynamicRls`] with the learned covariance as `P(0)`: the recursive prediction error method, linearised
//! at the learned model (L. Ljung, T. Soderstrom, Theory and Practice of Recursive Identification, 1983, ch. 3).
//! Parameters are counted in their learned standard errors, so that a cap on the trace of `P` means the same for all.

use ct_rls::{DynamicRls, Guards, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Forgetting never raises the variances above the learned ones times this factor on average.
const MOST: f64 = 1e4;
/// After a step change, standard errors are multiplied by this factor.
const JUMP: f64 = 30.0;

/// Serialisable form of a tracker: the deviations and their covariance, both in learned standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TrackerState {
    pub deviation: Vec<f64>,
    pub covariance: Vec<f64>,
}

/// Tracked directions and their scales.
pub(crate) struct Tracker {
    rls: DynamicRls,
    weights: Weights,
    /// The weights without forgetting.
    together: Weights,
    /// Seed index and learned standard error of each tracked parameter.
    tracked: Vec<(usize, f64)>,
    phi: Vec<f64>,
}

impl TrackerState {
    /// Initial tracker; `covariance` of the tracked parameters, row by row.
    pub(crate) fn learned(covariance: &[f64]) -> Self {
        let n = covariance.len().isqrt();
        let error = |i: usize| covariance[i * n + i].sqrt();
        Self {
            deviation: vec![0.0; n],
            covariance: (0..n * n)
                .map(|k| covariance[k] / (error(k / n) * error(k % n)))
                .collect(),
        }
    }

    /// The parameters have changed abruptly: earlier information gets a small weight.
    pub(crate) fn open(&mut self) {
        for entry in &mut self.covariance {
            *entry *= JUMP * JUMP;
        }
    }
}

impl Tracker {
    /// `memory` \[s\]; `None` if there is nothing to track, or if the covariance is not positive definite.
    pub(crate) fn new(state: &TrackerState, tracked: &[(usize, f64)], memory: f64) -> Option<Self> {
        let n = tracked.len();
        if n == 0 || state.deviation.len() != n || state.covariance.len() != n * n {
            return None;
        }
        let weights = Weights::least_squares(1.0 / memory).ok()?;
        let p = DMatrix::from_row_slice(n, n, &state.covariance);
        let rls = DynamicRls::new(
            DVector::from_column_slice(&state.deviation),
            &(0.5 * (&p + p.transpose())),
            weights,
        )
        .ok()?;
        let guards = Guards {
            trace_limit: (MOST * n as f64).max(2.0 * p.trace()),
            silent_below: 0.0,
        };
        Some(Self {
            rls: rls.with_guards(guards).ok()?,
            weights,
            together: Weights::least_squares(0.0).ok()?,
            tracked: tracked.to_vec(),
            phi: vec![0.0; n],
        })
    }

    /// Takes in a whitened row for each output that has a reading, in units of the innovations: derivatives, then (last) the residual; `h`
    /// seconds after the sample before.
    pub(crate) fn update<'a>(&mut self, rows: impl Iterator<Item = &'a [f64]>, h: f64) {
        for (i, row) in rows.enumerate() {
            // Rows of one instant: forgetting is applied once.
            let weights = if i == 0 { self.weights } else { self.together };
            self.take(row, h, &weights);
        }
    }

    fn take(&mut self, row: &[f64], h: f64, weights: &Weights) {
        // The information of a row does not depend on its length: the estimator's information is an integral over time.
        let density = 1.0 / h.sqrt();
        for (phi, (lane, error)) in self.phi.iter_mut().zip(&self.tracked) {
            *phi = row[*lane] * error * density;
        }
        let residual = row.last().copied().unwrap_or(f64::NAN);
        // A rejected sample does not change the estimator.
        let _ = self
            .rls
            .update_with(&self.phi, residual * density, h, weights);
    }

    pub(crate) fn state(&self) -> TrackerState {
        let covariance = self.rls.covariance();
        TrackerState {
            deviation: self.rls.theta().as_slice().to_vec(),
            covariance: covariance.transpose().as_slice().to_vec(),
        }
    }

    /// Deviation and standard error of each tracked parameter, in its own unit.
    pub(crate) fn estimates(&self) -> impl Iterator<Item = (f64, f64)> {
        let covariance = self.rls.covariance();
        self.tracked.iter().enumerate().map(move |(i, (_, error))| {
            (
                self.rls.theta()[i] * error,
                covariance[(i, i)].max(0.0).sqrt() * error,
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    /// Rows of unit noise and two directions, of standard errors 1 and 1 in the learned covariance.
    fn run(
        truth: impl Fn(usize) -> [f64; 2],
        rows: usize,
        jump: Option<usize>,
    ) -> (Vec<(f64, f64)>, usize) {
        let rng = &mut ChaCha8Rng::seed_from_u64(5);
        let noise = ct_signals::noise::white(3 * rows, 1.0, rng);
        let mut state = TrackerState::learned(&[1.0, 0.5, 0.5, 1.0]);
        let tracked = [(0, 1.0), (1, 1.0)];
        let mut tracker = Tracker::new(&state, &tracked, 400.0).unwrap();
        let mut held = 0;
        for k in 0..rows {
            if jump == Some(k) {
                state = tracker.state();
                state.open();
                tracker = Tracker::new(&state, &tracked, 400.0).unwrap();
            }
            let [a, b] = truth(k);
            let s = [noise[3 * k], noise[3 * k + 1]];
            let row = [s[0], s[1], 1.0, s[0] * a + s[1] * b + noise[3 * k + 2]];
            tracker.update(std::iter::once(&row[..]), 2.0);
            let inside = tracker
                .estimates()
                .zip([a, b])
                .filter(|((x, e), t)| (x - t).abs() < 1.96 * e);
            held += inside.count();
        }
        (tracker.estimates().collect(), held)
    }

    #[test]
    fn the_band_holds_what_stays() {
        let (_, held) = run(|_| [0.3, -0.2], 20_000, None);
        assert!(held > 38_000, "{held} of 40000");
    }

    #[test]
    fn what_drifts_slowly_is_followed_and_what_jumps_at_once() {
        let (now, _) = run(|k| [1e-4 * k as f64, 0.0], 20_000, None);
        assert!(
            (now[0].0 - 2.0).abs() < 0.3 && now[1].0.abs() < 0.3,
            "{now:?}"
        );
        let jumped = |k: usize| if k < 5000 { [0.0, 0.0] } else { [3.0, -1.0] };
        let (now, _) = run(jumped, 5060, Some(5005));
        assert!(
            (now[0].0 - 3.0).abs() < 0.6 && (now[1].0 + 1.0).abs() < 0.6,
            "{now:?}"
        );
        // Without notice of the step, adaptation takes the memory, 200 rows.
        let (now, _) = run(jumped, 5060, None);
        assert!((now[0].0 - 3.0).abs() > 1.5, "{now:?}");
    }

    #[test]
    fn a_state_builds_the_same_tracker() {
        let state = TrackerState::learned(&[4.0, 1.0, 1.0, 9.0]);
        let tracker = Tracker::new(&state, &[(0, 2.0), (1, 3.0)], 100.0).unwrap();
        let again = tracker.state();
        assert!(
            again
                .covariance
                .iter()
                .zip(&state.covariance)
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
        assert!(Tracker::new(&state, &[(0, 2.0)], 100.0).is_none());
    }
}
