//! Output error of a model in parallel, with bounds on its error filter.

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, SMatrix, SVector};
use stabilized_oe::{
    BlockDiagonal, FilterBounds, IoSample, StabilizedOe, StateVariableFilters, check_filter_bounds,
};

use super::{
    lags,
    path::{Learnt, Path, is_kept},
    scaled::Scaled,
    start,
};
use crate::{Error, Order, Warning};

const P_OUTPUT_ERROR: f64 = 10.0;
/// Ranges of the plausible plants around the start, with bounds on c: factors; the widest range with guaranteed convergence is used.
const PLAUSIBLE: [f64; 4] = [2.0, 1.5, 1.25, 1.1];
const BOUNDS: [f64; 4] = [2.0, 1.5, 1.2, 1.05];
/// The output-error recursion keeps every lag above this share of the sampling interval, with the other lags as at the start. Shorter lags
/// cannot be identified, and `y_m^(n)`, which is divided by `a_n`, would be so large that the recursion would underestimate its
/// uncertainty.
const SHORTEST_LAG: f64 = 0.05;

/// Output error of a model in parallel.
pub(super) fn output_error(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    // The crate's sizes are fixed at compile time: one instance for each order.
    macro_rules! sizes {
        ($($n:literal, $m:literal => $p:literal;)*) => {
            match (order.n, order.m) {
                $(($n, $m) => parallel::<$n, $p>(scaled, order),)*
                _ => Err(Error::Untold { order }),
            }
        };
    }
    sizes! {
        1, 0 => 3; 1, 1 => 4;
        2, 0 => 4; 2, 1 => 5; 2, 2 => 6;
        3, 0 => 5; 3, 1 => 6; 3, 2 => 7; 3, 3 => 8;
        4, 0 => 6; 4, 1 => 7; 4, 2 => 8; 4, 3 => 9; 4, 4 => 10;
    }
}

fn parallel<const N: usize, const P: usize>(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    let start = SVector::<f64, P>::from_column_slice(&start(scaled, order));
    let a: [f64; N] = core::array::from_fn(|i| start[i]);
    let theta = ContinuousRls::with_integrator(
        start,
        SMatrix::identity() * P_OUTPUT_ERROR,
        Weights::least_squares(scaled.eta)?,
    )?;
    // No forgetting: the regressor of c vanishes if the model is right.
    let filter = ContinuousRls::with_integrator(
        SVector::from(a),
        SMatrix::identity(),
        Weights::least_squares(0.0)?,
    )?;
    let gain: BlockDiagonal<N, P> = BlockDiagonal::new(theta, filter);
    let mut path = Path::new(order);
    let (bounds, plausible) = filter_bounds(&a)?;
    if plausible.is_none() {
        path.warnings.push(Warning::NoFilterBounds { n: N });
    }
    let filters = StateVariableFilters::<N>::with_input(scaled.bandwidth, scaled.hold)?;
    let mut estimator = StabilizedOe::new(gain, filters)?
        .with_offset()
        .with_theta_bounds(theta_bounds(scaled, N)?)?
        .with_filter_bounds(bounds)?
        .with_model_state(at_rest(scaled))?;
    let count = scaled.time.len();
    let mut held_early = 0;
    let mut learnt = Learnt::of(scaled);
    let following = scaled.steps().skip(1).chain([0.0]);
    for (k, next) in following.enumerate() {
        if 2 * k <= count {
            held_early = estimator.bounded().theta;
        }
        // the last sample is not held
        if next > 0.0 {
            let sample = IoSample {
                u: scaled.u[k],
                y: scaled.y[k],
            };
            estimator.update(&sample, next);
        }
        if is_kept(k, count) {
            let covariance = estimator.covariance();
            path.keep(
                (k, learnt.time(k, scaled)),
                estimator.theta().as_slice(),
                DMatrix::from_column_slice(P, P, covariance.as_slice()),
            )?;
        }
        learnt.after(!scaled.y[k].is_nan(), next);
    }
    estimator.health()?;
    let held = estimator.bounded().theta - held_early;
    if held > 0 {
        path.held = true;
        path.warnings.push(Warning::HeldByBound {
            steps: held,
            lower: order.lower(),
        });
    }
    let unstable = estimator.bounded().unstable;
    if unstable > 0 {
        path.warnings.push(Warning::StepsShortened {
            steps: unstable,
            count,
        });
    }
    path.warnings.extend(left_plausible(&path, plausible, &a)?);
    Ok(path)
}

fn theta_bounds<const P: usize>(scaled: &Scaled, n: usize) -> Result<Bounds<P>, Error> {
    let mut lower = [f64::NEG_INFINITY; P];
    let slower = std::iter::once(1.0).chain(lags(n));
    for (lower, slower) in lower.iter_mut().zip(slower).take(n) {
        *lower = SHORTEST_LAG * scaled.interval * slower;
    }
    let bounds = Bounds::new(lower, [f64::INFINITY; P]);
    Ok(bounds.map_err(stabilized_oe::Error::from)?)
}

/// `y` and its derivatives at rest on the first sample.
fn at_rest<const N: usize>(scaled: &Scaled) -> [f64; N] {
    let mut state = [0.0; N];
    let first = scaled.y.iter().find(|y| !y.is_nan());
    if let (Some(state), Some(y)) = (state.first_mut(), first) {
        *state = *y;
    }
    state
}

/// The widest bounds on c around the start for which C/A0 - 1/2 is strictly positive real for the plants around it, and the range of these
/// plants.
fn filter_bounds<const N: usize>(a: &[f64; N]) -> Result<(Bounds<N>, Option<f64>), Error> {
    for reach in PLAUSIBLE {
        let plausible = about(a, reach)?;
        for spread in BOUNDS {
            let bounds = about(a, spread)?;
            if check_filter_bounds(&bounds, &plausible, 0.5)?.hold() {
                return Ok((bounds, Some(reach)));
            }
        }
    }
    let [.., narrowest] = BOUNDS;
    Ok((about(a, narrowest)?, None))
}

fn about<const N: usize>(a: &[f64; N], factor: f64) -> Result<Bounds<N>, Error> {
    let bounds = Bounds::new(a.map(|a| a / factor), a.map(|a| a * factor));
    Ok(bounds.map_err(stabilized_oe::Error::from)?)
}

/// Convergence is not guaranteed for the identified plant.
fn left_plausible<const N: usize>(
    path: &Path,
    reach: Option<f64>,
    a: &[f64; N],
) -> Result<Option<Warning>, Error> {
    let Some(reach) = reach else { return Ok(None) };
    let found = &path.last()?.theta;
    let found: [f64; N] = core::array::from_fn(|i| found[i]);
    if about(a, reach)?.contains(&SVector::from(found)) {
        return Ok(None);
    }
    // Outside the box the bounds may still be sufficient.
    let [.., here] = PLAUSIBLE;
    let (bounds, _) = filter_bounds(a)?;
    Ok(
        match check_filter_bounds(&bounds, &about(&found, here)?, 0.5)? {
            FilterBounds::PositiveReal => None,
            _ => Some(Warning::ConvergenceNotGuaranteed),
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_make_convergence_sure_are_found_up_to_the_third_order() {
        assert!(filter_bounds(&[1.0]).unwrap().1.unwrap() >= 1.5);
        assert!(filter_bounds(&[1.0, 0.25]).unwrap().1.is_some());
        assert!(
            filter_bounds(&[1.0, 1.0 / 3.0, 1.0 / 27.0])
                .unwrap()
                .1
                .is_some()
        );
    }
}
