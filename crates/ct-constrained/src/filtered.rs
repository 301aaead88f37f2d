//! Rows made of filtered data, `(G phi)' theta = G y`: [U] section 3, remark 3.
//!
//! Model: `y = theta' phi` with constant `theta`; a linear filter `G`, the same on each entry of `phi` and on `y`, and started at 0,
//! leaves the equation as it is. Low pass, `G = 1/(1 + T s)`, or integral, `G = 1/s`, of signals that are held over the step `h`:
//! ```text
//! low pass   x+ = x + (1 - e^{-h/T}) (signal - x)
//! integral   x+ = x + h signal
//! ```
//! What it is for: the row weighs errors by their frequency. Disturbances of `y` that `G` takes away do not reach the row; where they also
//! are in `phi`, as when it is made of measured signals, data alone give biased estimates, and a row with a weight well above `c` draws
//! them to what the slow part of the record says. Where the noise is white and `phi` is free of it, data alone are best: such a row
//! counts old noise again.
//!
//! Cost per sample: `p + 1` multiplications, and the row's in the estimator.

use ct_rls::Sample;
use nalgebra::SVector;

use crate::{Error, Row};

/// `G` of a [`FilteredRow`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Filter {
    /// Low-pass filter `1/(1 + T s)`: signals slower than `T` pass.
    LowPass {
        /// `T`, s; above 0.
        time: f64,
    },
    /// `1/s`: the integral since the start. For signals with a mean the integral grows without bound, and so does the weight of the row.
    Integral,
}

/// An equality row of the filtered regressor and output, `(G phi)' theta = G y`; remark 3 of the paper's section 3.
///
/// For disturbances of `phi` and `y` that `G` takes away. Under white noise on `y` alone the data's own weight is the best one, and such
/// a row makes the estimates worse.
///
/// ```
/// use ct_constrained::{ConstrainedRls, Filter, FilteredRow, Row};
/// use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
/// use nalgebra::{SMatrix, SVector};
///
/// let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 100.0, Weights::least_squares(0.01)?)?;
/// let mut slow = FilteredRow::new(Filter::LowPass { time: 5.0 }, 20.0)?;
/// let mut constrained = ConstrainedRls::new(rls, [Row::equal([0.0, 0.0], 0.0, 0.0)?])?;
/// for k in 0..1000 {
///     let u = if k % 200 < 100 { 1.0 } else { -1.0 };
///     let sample = Sample::new([u, 1.0], 2.0 * u + 0.5);
///     constrained.set_row(0, slow.update(&sample, 0.1)?)?;
///     constrained.update(&sample, 0.1);
/// }
/// assert!((constrained.theta()[0] - 2.0).abs() < 1e-3);
/// # Ok::<(), ct_constrained::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilteredRow<const P: usize> {
    filter: Filter,
    weight: f64,
    phi: SVector<f64, P>,
    y: f64,
}

impl<const P: usize> FilteredRow<P> {
    /// A filter at 0.
    ///
    /// - `weight`: of the row, see [`Row::new`]; for a low pass in the unit of the data's weight `c`.
    ///
    /// # Errors
    /// [`Error::FilterTime`], [`Error::Weight`].
    pub fn new(filter: Filter, weight: f64) -> Result<Self, Error> {
        if let Filter::LowPass { time } = filter {
            check_time("the time constant", time)?;
        }
        // the weight's range is the row's
        Row::equal([0.0; P], 0.0, weight)?;
        Ok(Self {
            filter,
            weight,
            phi: SVector::zeros(),
            y: 0.0,
        })
    }

    /// Holds a sample for `dt` seconds, above 0; returns the row at their end, to hand to
    /// [`set_row`](crate::ConstrainedRls::set_row) before the estimator takes the same sample.
    ///
    /// # Errors
    /// [`Error::FilterTime`] of the step, and those of [`Row::new`] for a sample, or an integral, out of range; the filter is then as
    /// before.
    pub fn update(&mut self, sample: &Sample<P>, dt: f64) -> Result<Row<P>, Error> {
        check_time("the step", dt)?;
        let (phi, y) = match self.filter {
            Filter::LowPass { time } => {
                let share = -libm::expm1(-dt / time);
                let phi = self.phi + (sample.phi - self.phi) * share;
                (phi, self.y + (sample.y - self.y) * share)
            }
            Filter::Integral => (self.phi + sample.phi * dt, self.y + sample.y * dt),
        };
        let [f] = phi.data.0;
        let row = Row::equal(f, y, self.weight)?;
        (self.phi, self.y) = (phi, y);
        Ok(row)
    }
}

fn check_time(what: &'static str, value: f64) -> Result<(), Error> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(Error::FilterTime { what, value })
    }
}
