//! Sources of derivatives: a small interface, and methods for it.

/// Turns samples into what the estimator needs: the output, the inputs with their derivatives, and the derivatives of the
/// output error.
///
/// `N` is the model's order. A scheme is asked twice per sample: [`take`](Self::take), then, when the model's output is known,
/// [`error`](Self::error).
pub trait Derivatives<const N: usize> {
    /// One sample of the measured signals.
    type Sample;

    /// Takes a sample, `since` seconds after the one before (0 for the first). Writes `u, u', .., u^(m)` to `inputs`, as many as it
    /// has places, and returns the output `y`, in the same filtered form. A `y` that is NaN is a gap: the model runs on.
    ///
    /// `None`, and nothing is changed, where the sample cannot be used at all.
    fn take(&mut self, sample: &Self::Sample, since: f64, inputs: &mut [f64]) -> Option<f64>;

    /// The output at the sample taken last is missing, and the model has `y_m` and `(y_m', .., y_m^(n))` there. A scheme with filters of
    /// the output runs them on what the model says instead.
    fn missed(&mut self, _y_m: f64, _model: &[f64; N]) {}

    /// `(e', .., e^(n))` at the sample taken last, from `e = y - y_m` and `model = (y_m', .., y_m^(n))` there.
    fn error(&mut self, e: f64, model: &[f64; N]) -> [f64; N];

    /// Whether the inputs run smoothly from sample to sample, as filtered ones do, instead of being held.
    fn smooth_inputs(&self) -> bool;
}

/// Inputs beyond this are faults, as regressors are: a sample with one cannot be used.
const LARGEST: f64 = 1e30;

pub(crate) fn plausible(input: f64) -> bool {
    input.abs() <= LARGEST
}

/// One sample of an input and an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IoSample {
    /// Input, held until the next sample.
    pub u: f64,
    /// Output. NaN where it was not measured.
    pub y: f64,
}

/// The paper's differences, for order one: `e'[k] = (e[k-1] - e[k-1-SPAN])/(SPAN dt)`, 0 while `k <= SPAN`; read a sample late, so
/// that the noise in it is not that in `e[k]`.
///
/// Inputs are held and have no derivatives: the numerator's order is 0. Samples have one distance. To compare with; in use, state
/// variable filters do better.
#[derive(Clone, Copy, Debug)]
pub struct LateDifference<const SPAN: usize> {
    /// `e[k-1]`
    last: f64,
    /// `e[k-2]` to `e[k-1-SPAN]`, a ring.
    before: [f64; SPAN],
    /// Index of the oldest entry.
    oldest: usize,
    seen: usize,
    step: f64,
}

impl<const SPAN: usize> LateDifference<SPAN> {
    /// Starts without a past.
    pub fn new() -> Self {
        const { assert!(SPAN > 0, "a difference needs a span of 1 or more") }
        Self {
            last: 0.0,
            before: [0.0; SPAN],
            oldest: 0,
            seen: 0,
            step: f64::NAN,
        }
    }
}

impl<const SPAN: usize> Default for LateDifference<SPAN> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const SPAN: usize> Derivatives<1> for LateDifference<SPAN> {
    type Sample = IoSample;

    #[inline]
    fn take(&mut self, sample: &IoSample, since: f64, inputs: &mut [f64]) -> Option<f64> {
        if !plausible(sample.u) {
            return None;
        }
        if let Some((u, derivatives)) = inputs.split_first_mut() {
            *u = sample.u;
            derivatives.fill(0.0);
        }
        self.step = since;
        Some(sample.y)
    }

    #[inline]
    fn error(&mut self, e: f64, _model: &[f64; 1]) -> [f64; 1] {
        let slope = if self.seen > SPAN {
            (self.last - self.before[self.oldest]) / (SPAN as f64 * self.step)
        } else {
            0.0
        };
        // during a gap the error keeps its last value
        let e = if e.is_finite() { e } else { self.last };
        self.before[self.oldest] = self.last;
        self.oldest = if self.oldest + 1 == SPAN {
            0
        } else {
            self.oldest + 1
        };
        self.last = e;
        self.seen += 1;
        [slope]
    }

    fn smooth_inputs(&self) -> bool {
        false
    }
}

/// One sample with known derivatives: `U = m + 1` inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownSample<const N: usize, const U: usize> {
    /// `u, u', .., u^(m)`
    pub u: [f64; U],
    /// Output.
    pub y: f64,
    /// `y', .., y^(n)`
    pub derivatives: [f64; N],
}

/// Derivatives that the caller knows: from other sensors, from other filters, or in a simulation.
#[derive(Clone, Copy, Debug)]
pub struct Known<const N: usize, const U: usize> {
    derivatives: [f64; N],
    smooth: bool,
}

impl<const N: usize, const U: usize> Known<N, U> {
    /// For inputs that are held between samples, or that are `smooth`.
    pub fn new(smooth: bool) -> Self {
        Self {
            derivatives: [0.0; N],
            smooth,
        }
    }
}

impl<const N: usize, const U: usize> Derivatives<N> for Known<N, U> {
    type Sample = KnownSample<N, U>;

    #[inline]
    fn take(&mut self, sample: &Self::Sample, _: f64, inputs: &mut [f64]) -> Option<f64> {
        if !sample.u.iter().all(|&u| plausible(u)) {
            return None;
        }
        for (i, input) in inputs.iter_mut().enumerate() {
            *input = sample.u.get(i).copied().unwrap_or(0.0);
        }
        self.derivatives = sample.derivatives;
        Some(sample.y)
    }

    #[inline]
    fn error(&mut self, _: f64, model: &[f64; N]) -> [f64; N] {
        core::array::from_fn(|i| self.derivatives[i] - model[i])
    }

    fn smooth_inputs(&self) -> bool {
        self.smooth
    }
}
