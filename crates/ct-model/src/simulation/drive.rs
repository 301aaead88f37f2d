//! What drives a model during a step: inputs, and delayed expressions.

use super::delays::Delays;
use crate::scalar::Scalar;

/// A sampling interval and the inputs in it, each linear in time.
#[derive(Clone, Copy)]
pub(super) struct Interval<'a> {
    pub begin: f64,
    pub length: f64,
    pub from: &'a [f64],
    /// Slope of each input.
    pub rise: &'a [f64],
}

impl Interval<'_> {
    /// Whether all inputs are constant over the interval.
    pub fn is_held(&self) -> bool {
        self.rise.iter().all(|rise| *rise == 0.0)
    }
}

/// The inputs and delayed expressions over an interval.
#[derive(Clone, Copy)]
pub(super) struct Drive<'a, T> {
    pub interval: Interval<'a>,
    pub delays: &'a Delays<T>,
}

impl<'a, T: Scalar> Drive<'a, T> {
    pub fn new(interval: Interval<'a>, delays: &'a Delays<T>) -> Self {
        Self { interval, delays }
    }

    /// Inputs that are held; `still`: a zero slope for each.
    pub fn held(inputs: &'a [f64], still: &'a [f64], delays: &'a Delays<T>) -> Self {
        let interval = Interval {
            begin: 0.0,
            length: 0.0,
            from: inputs,
            rise: still,
        };
        Self { interval, delays }
    }
}
