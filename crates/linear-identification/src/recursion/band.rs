//! Standard errors over time, from the variance of the estimating equations.
//!
//! With `R = P^-1` and the estimates `theta^` of now, what the stretch from one kept point to the next has said against them is
//! ```text
//! z_b = R_b (theta_b - theta^) - e^{-eta L} R_{b-1} (theta_{b-1} - theta^) = integral of phi (y - phi' theta^) e^{..} dt
//! ```
//! exactly for least squares. Stretches of a time constant or more are nearly independent whatever the spectrum of the noise, so that
//! ```text
//! cov theta^ = P S P,   S = sum_b e^{-2 eta (t - t_b)} z_b z_b'
//! ```
//! Where readings are missing nothing is learnt and nothing forgotten: t is the time in which there were readings.
//!
//! For the output error it holds as far as the filter C^ resembles A: the regressor then is the gradient.

use nalgebra::{DMatrix, DVector};

use super::path::{Path, Point};
use super::scaled::Scaled;
use crate::Trajectory;

/// Least number of segments per parameter.
const SPARE: f64 = 2.0;

/// The parameters in their units over the record, with standard errors.
pub(super) fn bands(path: &Path, scaled: &Scaled) -> Trajectory {
    let p = path.points.first().map_or(0, |point| point.theta.len());
    let order = path.order;
    let (unscale, shift) = scaled.unscaling(order);
    let mut trajectory = Trajectory {
        time: Vec::new(),
        samples: Vec::new(),
        values: vec![Vec::new(); p],
        std_errors: vec![Vec::new(); p],
    };
    let mut ends: Vec<&Point> = path.points.first().into_iter().collect();
    for point in &path.points {
        if ends.last().is_some_and(|end| point.time - end.time >= 1.0) {
            ends.push(point);
        }
        trajectory.samples.push(point.sample);
        trajectory.time.push(scaled.seconds[point.sample]);
        let theta = &unscale * &point.theta + &shift;
        let covariance = if path.held {
            None
        } else {
            covariance(&ends, point, scaled.eta)
        };
        for i in 0..p {
            trajectory.values[i].push(theta[i]);
            let variance = covariance.as_ref().map_or(f64::NAN, |covariance| {
                let row = unscale.row(i);
                (row * covariance * row.transpose())[(0, 0)]
            });
            trajectory.std_errors[i].push(variance.sqrt());
        }
    }
    trajectory
}

fn covariance(ends: &[&Point], now: &Point, eta: f64) -> Option<DMatrix<f64>> {
    let p = now.theta.len();
    let mut scatter = DMatrix::zeros(p, p);
    let (mut weights, mut squares) = (0.0, 0.0);
    for pair in ends.windows(2) {
        let [before, after] = pair else { continue };
        let faded = (-eta * (after.time - before.time)).exp();
        let said: DVector<f64> = &after.information * (&after.theta - &now.theta)
            - &before.information * (&before.theta - &now.theta) * faded;
        let weight = (-2.0 * eta * (now.time - after.time)).exp();
        scatter += weight * &said * said.transpose();
        weights += weight;
        squares += weight * weight;
    }
    // Number of segments of equal weight with the same information.
    let count = weights * weights / squares;
    if count.is_nan() || count <= p as f64 + SPARE {
        return None;
    }
    let covariance = now.information.clone().try_inverse()?;
    Some(&covariance * scatter * &covariance * (count / (count - p as f64)))
}
