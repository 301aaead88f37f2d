//! Values of a signal outside the range that a model declares for it.

use serde::Serialize;

use crate::Channel;

/// Values outside the declared range by less than this share of it, or of the range of most values where it has one bound, do not count: a
/// measured input has noise.
const TOLERANCE: f64 = 0.01;
/// The range of most values lies between this quantile and its complement.
const QUANTILE: f64 = 0.05;
/// Rounding errors of a conversion, as a share of a bound.
const ROUNDING: f64 = 1e-9;

/// Values of a signal outside its declared range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutOfRange {
    /// The signal's name.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Number of rows in which it is on this side of the range.
    pub rows: usize,
    /// The value that is farthest outside \[unit of the signal\].
    pub value: f64,
    /// The bound that it exceeds \[unit of the signal\].
    pub bound: f64,
}

impl OutOfRange {
    /// Finds the values of a channel below `min` or above `max` \[unit of the channel\]; `None` if there are none.
    ///
    /// ```
    /// use ct_signals::{Channel, OutOfRange};
    ///
    /// let valve = Channel::new("u", "%", vec![0.0, 0.4, 1.2, 0.8]);
    /// let found = OutOfRange::find(&valve, 0.0, 1.0).unwrap();
    /// assert_eq!((found.rows, found.value, found.bound), (1, 1.2, 1.0));
    /// assert_eq!(OutOfRange::find(&valve, 0.0, 100.0), None);
    ///
    /// let power = Channel::new("P", "kW", vec![-3.0, f64::NAN, 6.0, 7.0, 0.0]);
    /// let found = OutOfRange::find(&power, 0.0, f64::INFINITY).unwrap();
    /// assert_eq!((found.rows, found.value, found.bound), (1, -3.0, 0.0));
    ///
    /// let constant = Channel::new("T", "K", vec![293.1500000001; 9]);
    /// assert_eq!(OutOfRange::find(&constant, 0.0, 293.15), None);
    /// assert_eq!(OutOfRange::find(&constant.with_values(vec![f64::NAN; 9]), 0.0, 1.0), None);
    /// ```
    #[must_use]
    pub fn find(channel: &Channel, min: f64, max: f64) -> Option<Self> {
        let mut values = channel.values.clone();
        values.retain(|value| value.is_finite());
        values.sort_by(f64::total_cmp);
        let (least, most) = (*values.first()?, *values.last()?);
        let declared = max - min;
        let range = if declared.is_finite() {
            declared
        } else {
            let at = (QUANTILE * values.len() as f64) as usize;
            values[values.len() - 1 - at] - values[at]
        };
        let (value, bound) = if min - least > most - max {
            (least, min)
        } else {
            (most, max)
        };
        let tolerance = (TOLERANCE * range).max(ROUNDING * bound.abs());
        let distance = |value: f64| {
            if bound == min {
                min - value
            } else {
                value - max
            }
        };
        let rows = values.iter().filter(|value| distance(**value) > tolerance);
        let rows = rows.count();
        (rows > 0).then(|| Self {
            signal: channel.name.clone(),
            unit: channel.unit.clone(),
            rows,
            value,
            bound,
        })
    }
}
