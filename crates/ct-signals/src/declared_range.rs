//! Values of a signal outside the range that a model declares for it.

use serde::Serialize;

use crate::Channel;

/// Values outside the declared range by less than this share of the signal's own range do not count: a measured input has noise.
const TOLERANCE: f64 = 0.01;

/// Values of a signal outside its declared range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutOfRange {
    /// The signal's name.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Number of rows outside.
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
    /// ```
    #[must_use]
    pub fn find(channel: &Channel, min: f64, max: f64) -> Option<Self> {
        let values = || channel.values.iter().copied().filter(|v| v.is_finite());
        let (least, most) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| {
            (l.min(v), m.max(v))
        });
        let tolerance = TOLERANCE * (most - least);
        let rows = values().filter(|v| *v < min - tolerance || *v > max + tolerance);
        let rows = rows.count();
        let (value, bound) = if min - least > most - max {
            (least, min)
        } else {
            (most, max)
        };
        (rows > 0).then(|| Self {
            signal: channel.name.clone(),
            unit: channel.unit.clone(),
            rows,
            value,
            bound,
        })
    }
}
