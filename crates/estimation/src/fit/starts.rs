//! Starts of fits, and the ends of the iterations from each.

use rayon::prelude::*;

use crate::{
    Fit, Noise, Residuals, Stop, Stopping, Triangle, costs_more, levenberg_marquardt::Minimum,
    levenberg_marquardt::minimise, levenberg_marquardt::within, linearise_below,
    prior::begin_near_priors, squares,
};

/// Start of a fit.
#[derive(Debug, Clone)]
pub struct Start {
    /// The vector.
    pub x: Vec<f64>,
    /// R factor from [`crate::linearise`] at the start, weighted as in the fit, if known: it is not computed again.
    pub triangle: Option<Triangle>,
}

impl From<Vec<f64>> for Start {
    fn from(x: Vec<f64>) -> Self {
        Self { x, triangle: None }
    }
}

impl Start {
    /// Start at the result of a fit of the same model, for a fit with a given noise model.
    #[must_use]
    pub fn at_end(fit: &Fit, noise: &Noise) -> Self {
        Self {
            x: fit.x.clone(),
            triangle: fit.noise.same_colour(noise).then(|| fit.triangle.clone()),
        }
    }
}

/// Start of a fit: within the bounds, and near the priors unless the given start has a lower cost, as the result of another fit can have.
fn begun(model: &impl Residuals, given: &[f64], noise: &Noise) -> Vec<f64> {
    let inside = |mut x: Vec<f64>| {
        for &i in model.free() {
            x[i] = within(x[i], model.bounds()[i]);
        }
        x
    };
    let mut near = given.to_vec();
    begin_near_priors(model, &mut near);
    let (there, near) = (inside(given.to_vec()), inside(near));
    if there == near {
        return there;
    }
    let cost = |x: &[f64]| squares(model, x, noise).map_or(f64::INFINITY, |squares| squares.cost());
    if cost(&there) <= cost(&near) {
        there
    } else {
        near
    }
}

/// Bounds of the entries that are fitted.
pub(super) fn free_bounds(model: &impl Residuals) -> Vec<(f64, f64)> {
    let free = model.free().iter();
    free.map(|&i| model.bounds()[i]).collect()
}

/// Ends of the iterations from all starts, in parallel: the whole vector, and the minimum. Those that are not finite at the start are left out.
pub(super) fn minima(
    model: &impl Residuals,
    starts: Vec<Start>,
    noise: &Noise,
    stopping: Stopping,
) -> Vec<(Vec<f64>, Minimum)> {
    let free = model.free();
    let bounds = free_bounds(model);
    starts
        .into_par_iter()
        .enumerate()
        .filter_map(|(k, Start { x: given, triangle })| {
            // After the time limit a fit still uses one start.
            if k > 0 && model.out_of_time() {
                return None;
            }
            let start = begun(model, &given, noise);
            let known = triangle.filter(|_| start == given);
            let full = |x: &[f64]| {
                let mut full = start.clone();
                for (&i, value) in free.iter().zip(x) {
                    full[i] = *value;
                }
                full
            };
            let x: Vec<f64> = free.iter().map(|&i| start[i]).collect();
            let minimum = minimise(
                x,
                known,
                &bounds,
                stopping,
                |x, limit| linearise_below(model, &full(x), noise, limit),
                |x, limit| costs_more(model, &full(x), noise, limit),
                || model.out_of_time(),
            );
            Some((full(&minimum.x), minimum))
        })
        .filter(|(_, minimum)| minimum.stop != Stop::NotFinite)
        .collect()
}

pub(super) fn least_cost(minima: &[(Vec<f64>, Minimum)]) -> f64 {
    let costs = minima.iter().map(|(_, minimum)| minimum.triangle.cost());
    costs.fold(f64::INFINITY, f64::min)
}
