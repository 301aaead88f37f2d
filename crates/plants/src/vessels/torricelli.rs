//! Torricelli's square root with a finite slope at zero.

use crate::Scalar;

/// Below this level a parabola replaces Torricelli's square root, whose slope is infinite at zero \[level unit\].
pub(super) const NEARLY_EMPTY: f64 = 1e-4;
/// Level that replaces an empty vessel's level when a slope is estimated by outflow/content \[level unit\].
pub(super) const A_LITTLE: f64 = 1e-3 * NEARLY_EMPTY;

/// `sqrt(level)`, zero for an empty vessel, with a finite slope at zero.
#[inline(always)]
pub(crate) fn square_root<T: Scalar>(level: T) -> T {
    let h = level.value();
    if h >= NEARLY_EMPTY {
        level.sqrt()
    } else if h > 0.0 {
        // Value and slope are continuous where the parabola meets the root.
        let x = level * (1.0 / NEARLY_EMPTY);
        (x * 1.5 - x * x * 0.5) * NEARLY_EMPTY.sqrt()
    } else {
        T::constant(0.0)
    }
}

/// The slope of [`square_root`].
pub(super) fn slope_of_root<T: Scalar>(level: T) -> T {
    let one = T::constant(1.0);
    let h = level.value();
    if h >= NEARLY_EMPTY {
        one * 0.5 / level.sqrt()
    } else {
        let x = level.max(T::constant(0.0)) * (1.0 / NEARLY_EMPTY);
        (one * 1.5 - x) * (1.0 / NEARLY_EMPTY.sqrt())
    }
}
