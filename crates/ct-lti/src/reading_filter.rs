//! The state variable filter of an output with missing readings, for regressions without a model that could replace them.
//!
//! Method: the output is interpolated linearly between its readings, as by [`Hold::First`](crate::Hold::First). Rows without a reading are
//! skipped: there the interpolation interval, and with it the exact step of the filter, is longer.
//!
//! Linear interpolation over a time that is long compared with the filter's time constant does not describe the plant. After a gap of more
//! than `1/lambda`, `lambda = (e_0/e_n)^(1/n)`, rows are therefore left out until the influence of the gap has decayed to 1 % by the
//! response of `1/(p + lambda)^n`: for n = 1 to 4 after 4.6, 6.6, 8.4 and 10 times `1/lambda`.
//!
//! Cost: that of [`StateVariableFilter`]; where no reading is missing its values are the same, bit for bit.
//!
//! Reference: H. Garnier, L. Wang (eds.), Identification of Continuous-time Models from Sampled Data, Springer 2008, ch. 1 and 4, for
//! filters over steps that differ.

use crate::{Error, StateVariableFilter};

/// Rows are used again when the influence of a gap on the filter's states has decayed to this share.
const FORGOTTEN: f64 = 0.01;

/// Filters readings, some of which may be NaN (missing).
#[derive(Debug, Clone)]
pub struct ReadingFilter {
    filter: StateVariableFilter,
    /// The longest interpolation interval after which no rows are left out, and the filter's memory \[time\].
    longest: f64,
    memory: f64,
    /// Time since the last reading, and whether a reading was missing.
    since: f64,
    missed: bool,
    /// Remaining time for which rows are left out.
    left: f64,
}

impl ReadingFilter {
    /// For a filter of the output.
    #[must_use]
    pub fn new(filter: StateVariableFilter) -> Self {
        let n = filter.order();
        let e = filter.denominator();
        let lambda = libm::pow(e.coefficient(0) / e.leading(), 1.0 / n as f64);
        Self {
            filter,
            longest: 1.0 / lambda,
            memory: memory(n) / lambda,
            since: 0.0,
            missed: false,
            left: 0.0,
        }
    }

    /// Takes a reading, NaN where it is missing, `step` after the last row \[time\], and returns the filtered output and its derivatives
    /// there; `None` if the reading is missing, or the influence of a long gap has not decayed.
    ///
    /// # Errors
    /// As of [`StateVariableFilter::update`].
    pub fn update(&mut self, reading: f64, step: f64) -> Result<Option<&[f64]>, Error> {
        self.since += step;
        if reading.is_nan() {
            self.missed = true;
            return Ok(None);
        }
        let gap = core::mem::take(&mut self.since);
        if core::mem::take(&mut self.missed) && gap > self.longest {
            self.left = self.memory;
        } else {
            self.left -= gap;
        }
        let derivatives = self.filter.update(reading, gap)?;
        Ok((self.left <= 0.0).then_some(derivatives))
    }
}

/// The time after which `1/(p + 1)^n` has forgotten all but 1 % of what its input was: `e^-t sum_{i<n} t^i/i!` is 0.01.
fn memory(n: usize) -> f64 {
    let left = |t: f64| {
        let (mut term, mut sum) = (1.0, 1.0);
        for i in 1..n {
            term *= t / i as f64;
            sum += term;
        }
        sum * libm::exp(-t)
    };
    let (mut low, mut high) = (0.0, 10.0 * n as f64 + 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left(middle) > FORGOTTEN {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use alloc::vec::Vec;

    use crate::{Hold, Start};

    fn filter(n: usize, lambda: f64) -> StateVariableFilter {
        let filter = StateVariableFilter::with_bandwidth(n, lambda, Hold::First).unwrap();
        filter.starting(Start::Rest)
    }

    #[test]
    fn without_missing_readings_it_is_the_filter_itself() {
        let (mut own, mut readings) = (filter(2, 0.3), ReadingFilter::new(filter(2, 0.3)));
        for k in 0..50 {
            let y = libm::sin(0.7 * f64::from(k));
            let expected = own.update(y, 0.9).unwrap();
            assert_eq!(readings.update(y, 0.9).unwrap().unwrap(), expected);
        }
    }

    /// A ramp is a line over any gap: nothing is lost but the rows.
    #[test]
    fn lines_run_through_gaps() {
        let (mut own, mut readings) = (filter(2, 0.3), ReadingFilter::new(filter(2, 0.3)));
        for k in 0..50 {
            let y = 2.0 * f64::from(k);
            let expected = own.update(y, 1.0).unwrap();
            if k % 3 == 1 {
                assert_eq!(readings.update(f64::NAN, 1.0).unwrap(), None);
                continue;
            }
            let found = readings.update(y, 1.0).unwrap().unwrap();
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-10, "{k}: {found} {expected}");
            }
        }
    }

    /// After a gap of 6 at a bandwidth of 0.3, rows are used again after 6.64/0.3 = 22.1.
    #[test]
    fn rows_behind_a_long_gap_are_left_out() {
        let mut readings = ReadingFilter::new(filter(2, 0.3));
        let mut given = Vec::new();
        for k in 0..60 {
            let y = if (10..15).contains(&k) { f64::NAN } else { 1.0 };
            if readings.update(y, 1.0).unwrap().is_some() {
                given.push(k);
            }
        }
        let expected: Vec<i32> = (0..10).chain(38..60).collect();
        assert_eq!(given, expected);
        assert!((memory(1) - 4.605).abs() < 1e-3 && (memory(2) - 6.638).abs() < 1e-3);
    }
}
