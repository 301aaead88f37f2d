//! The default scheme: state variable filters, the same for input and output.
//!
//! Model: with `x_f = lambda^n/(s + lambda)^n x` the model holds for the filtered signals as it does for the signals,
//! `A y_f = B u_f`, and the filters have the derivatives as their states. The parallel model is driven by `u_f`, so that
//! `e^(i) = y_f^(i) - y_m^(i)` for `i = 0..n`.
//!
//! A missing reading is replaced by that of the model, `sum_i e_i y_m^(i)/e_0` with E the filter's polynomial, and the estimates are not
//! updated: `e` and its derivatives are those of a record whose missing readings have a residual of 0. With the right model the replacement
//! causes no bias; with a wrong one, it makes the error smaller and convergence slower.
//!
//! Assumption: the input is held or interpolated linearly between samples, the output is interpolated linearly. Filtered noise is not white,
//! and `c^` then converges to other values; bounds on it are needed all the same.
//!
//! Accuracy: of second order in the step for `m < n`. For `m = n` the highest derivative of `u_f` jumps with `u`, and its linear
//! interpolation in the model is of first order: 1 % for n = 1 and a step of a fortieth of the time constant.

use ct_lti::{Hold, Start, StateVariableFilter};

use crate::derivatives::plausible;
use crate::{Derivatives, Error, IoSample};

/// State variable filters for a model of order `N`.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StateVariableFilters<const N: usize> {
    u: StateVariableFilter,
    y: StateVariableFilter,
    /// Time since the last update of the output's filter.
    since: f64,
}

impl<const N: usize> StateVariableFilters<N> {
    /// `lambda^n/(s + lambda)^n`; `lambda` in 1/s, 2 to 10 times the bandwidth of what is identified: a lower value suppresses the fast
    /// dynamics, a higher one passes noise. Both filters start at rest on their first sample.
    ///
    /// # Errors
    /// [`Error::Lti`] for a `lambda` that is not above 0 and finite.
    pub fn new(lambda: f64) -> Result<Self, Error> {
        Self::with_input(lambda, Hold::Zero)
    }

    /// Filters for an input that is held between samples, or that is linear between samples like the output.
    ///
    /// # Errors
    /// As of [`new`](Self::new).
    pub fn with_input(lambda: f64, input: Hold) -> Result<Self, Error> {
        let filter = |hold| StateVariableFilter::with_bandwidth(N, lambda, hold);
        Ok(Self {
            u: filter(input)?.starting(Start::Rest),
            y: filter(Hold::First)?.starting(Start::Rest),
            since: 0.0,
        })
    }
}

impl<const N: usize> Derivatives<N> for StateVariableFilters<N> {
    type Sample = IoSample;

    fn take(&mut self, sample: &IoSample, since: f64, inputs: &mut [f64]) -> Option<f64> {
        if !plausible(sample.u) {
            return None;
        }
        self.u.update(sample.u, since).ok()?;
        for (i, input) in inputs.iter_mut().enumerate() {
            *input = self.u.derivatives().get(i).copied().unwrap_or(0.0);
        }
        self.since += since;
        if !(plausible(sample.y) && self.y.update(sample.y, self.since).is_ok()) {
            return Some(f64::NAN);
        }
        self.since = 0.0;
        Some(self.y.derivatives()[0])
    }

    fn missed(&mut self, y_m: f64, model: &[f64; N]) {
        let e = self.y.denominator().coefficients();
        let others = e[1..].iter().zip(model).map(|(e, y)| e * y).sum::<f64>();
        if self.y.update(y_m + others / e[0], self.since).is_ok() {
            self.since = 0.0;
        }
    }

    fn error(&mut self, _: f64, model: &[f64; N]) -> [f64; N] {
        let y = self.y.derivatives();
        core::array::from_fn(|i| y[i + 1] - model[i])
    }

    fn smooth_inputs(&self) -> bool {
        true
    }
}
