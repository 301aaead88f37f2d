//! Default bounds, and the check whether a start is inside its bounds.

use ct_constrained::Bounds;
use nalgebra::SVector;

use crate::Error;

/// Default lower bound of `a_i`, `i < n`: this factor times `dt^i`.
const FLOOR: f64 = 1e-3;

pub(crate) fn inside<const K: usize>(
    what: &'static str,
    bounds: &Bounds<K>,
    value: &SVector<f64, K>,
) -> Result<(), Error> {
    for (index, &value) in value.iter().enumerate() {
        let (lower, upper) = (bounds.lower()[index], bounds.upper()[index]);
        if !(lower..=upper).contains(&value) {
            return Err(Error::StartOutside {
                what,
                index,
                value,
                lower,
                upper,
            });
        }
    }
    Ok(())
}

/// `a_i` above [`FLOOR`] times `dt^i`, and `a_n` above `dt^n`, or `highest` where that is less.
pub(crate) fn default_bounds<const N: usize, const P: usize>(
    dt: f64,
    highest: f64,
) -> Result<Bounds<P>, Error> {
    let mut lower = [f64::NEG_INFINITY; P];
    let mut power = 1.0;
    for (i, lower) in lower.iter_mut().take(N).enumerate() {
        power *= dt;
        *lower = if i + 1 == N {
            power.min(highest)
        } else {
            FLOOR * power
        };
    }
    Ok(Bounds::new(lower, [f64::INFINITY; P])?)
}
