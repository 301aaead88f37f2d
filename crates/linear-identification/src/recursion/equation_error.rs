//! Recursive least squares on the filtered equation.

use ct_rls::{DynamicRls, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector};

use super::{
    path::{Learnt, Path, is_kept},
    scaled::Scaled,
    start,
};
use crate::{Error, Order};

/// P(0): all parameters are about 1.
const P_EQUATION_ERROR: f64 = 100.0;
/// The share of the readings that must be usable for the equation error with missing readings.
const LEAST_LEFT: f64 = 0.3;

/// Least squares on `y_f = -a_1 y_f' - .. + b_0 u_f + .. + d`. Rows are used if the reading is present and the filter of y has forgotten
/// long gaps; other rows cause neither an update nor forgetting.
pub(super) fn equation_error(scaled: &Scaled, order: Order) -> Result<Path, Error> {
    let p = order.parameters();
    let start = DVector::from_vec(start(scaled, order));
    let weights = Weights::least_squares(scaled.eta)?;
    let mut rls = DynamicRls::new(
        start,
        &(DMatrix::identity(p, p) * P_EQUATION_ERROR),
        weights,
    )?;
    let (mut of_u, mut of_y) = scaled.filters(order.n)?;
    let mut phi = vec![1.0; p];
    let mut path = Path::new(order);
    let count = scaled.time.len();
    let following = scaled.steps().skip(1).chain([0.0]);
    let mut learnt = Learnt::of(scaled);
    for (k, (step, next)) in scaled.steps().zip(following).enumerate() {
        let y = of_y.update(scaled.y[k], step)?;
        let u = of_u.update(scaled.u[k], step)?;
        // the last sample is not held
        if let Some(y) = y {
            for (phi, slope) in phi.iter_mut().zip(&y[1..]) {
                *phi = -slope;
            }
            phi[order.n..=order.n + order.m].copy_from_slice(&u[..=order.m]);
            if next > 0.0 {
                rls.update_with(&phi, y[0], next, &weights);
            }
        }
        if is_kept(k, count) {
            path.keep(
                (k, learnt.time(k, scaled)),
                rls.theta().as_slice(),
                rls.covariance(),
            )?;
        }
        learnt.after(y.is_some(), next);
    }
    let readings = scaled.y.iter().filter(|y| !y.is_nan()).count();
    if (learnt.rows as f64) < LEAST_LEFT * readings as f64 {
        return Err(Error::RowsLeft {
            missing: 1.0 - readings as f64 / count as f64,
            left: learnt.rows,
            rows: count,
        });
    }
    rls.health()?;
    let end = path.last()?;
    let mut a = vec![1.0];
    a.extend(end.theta.iter().take(order.n));
    if !ct_lti::Polynomial::new(a)?.is_hurwitz() {
        return Err(Error::Unstable { order });
    }
    Ok(path)
}
