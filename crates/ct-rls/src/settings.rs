//! The three constants of the estimator, checked once, and the guards against wind-up.

use crate::Error;

/// `c`, `gamma` and `eta` of `dtheta/dt = c P phi eps`, `dP/dt = eta P - gamma P phi phi' P`.
///
/// A value of this type is valid: `0 < c <= 1e40`, `0 <= gamma < 2 c`, `eta >= 0`, all finite. They may
/// vary in time: hand other weights to an update, made once and kept.
///
/// Which `eta`? The memory is `1/eta` seconds; take at least 5 to 10 of the process's dominant time
/// constants. `c` sets how much one second of data weighs against `P(0)`. `gamma = c` is least
/// squares; `gamma` below `c` lets `P` shrink slower, which helps to follow parameters that vary.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Unchecked"))]
pub struct Weights {
    c: f64,
    gamma: f64,
    eta: f64,
}

#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Unchecked {
    c: f64,
    gamma: f64,
    eta: f64,
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for Weights {
    type Error = Error;

    fn try_from(w: Unchecked) -> Result<Self, Error> {
        Self::new(w.c, w.gamma, w.eta)
    }
}

impl Weights {
    /// Weights from the paper's symbols.
    ///
    /// - `c`: weight of the output error, 1/(s unit(y)^2) where `P` has the unit of `theta theta'`; above 0, at most 1e40.
    /// - `gamma`: gain of the Riccati equation, as `c`; `0 <= gamma < 2 c`.
    /// - `eta`: forgetting rate, 1/s; at least 0.
    ///
    /// # Errors
    /// [`Error::Weight`], [`Error::Gamma`], [`Error::Forgetting`].
    pub fn new(c: f64, gamma: f64, eta: f64) -> Result<Self, Error> {
        if !(c > 0.0 && c <= MAX_C) {
            return Err(Error::Weight { c });
        }
        if !(0.0..2.0 * c).contains(&gamma) {
            return Err(Error::Gamma { gamma, c });
        }
        if !(eta >= 0.0 && eta.is_finite()) {
            return Err(Error::Forgetting { eta });
        }
        Ok(Self { c, gamma, eta })
    }

    /// Least squares, `c = gamma = 1`, with the forgetting rate `eta` in 1/s, at least 0.
    ///
    /// # Errors
    /// [`Error::Forgetting`].
    pub fn least_squares(eta: f64) -> Result<Self, Error> {
        Self::new(1.0, 1.0, eta)
    }

    /// Least squares that forgets as a discrete estimator with the factor `lambda` (0 < lambda <= 1)
    /// at every step of `dt` seconds: `eta = -ln(lambda)/dt`.
    ///
    /// # Errors
    /// [`Error::Lambda`].
    pub fn from_forgetting_factor(lambda: f64, dt: f64) -> Result<Self, Error> {
        if !(lambda > 0.0 && lambda <= 1.0 && dt > 0.0 && dt.is_finite()) {
            return Err(Error::Lambda { lambda, dt });
        }
        Self::least_squares(-libm::log(lambda) / dt)
    }

    /// Weight of the output error.
    pub fn c(&self) -> f64 {
        self.c
    }

    /// Gain of the Riccati equation.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// Forgetting rate, 1/s.
    pub fn eta(&self) -> f64 {
        self.eta
    }
}

/// Limits the growth of `P` while the regressor contains no information (wind-up).
///
/// Both only ever forget less than `eta` asks for, so the Lyapunov function still decreases. They act on all parameters at once;
/// [`Directional`](crate::Directional) forgets by directions, and [`RandomWalk`](crate::RandomWalk) without `eta` by parameters;
/// a walk at the cap is the exception, where the function may grow by the share that `P` is scaled down by.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Guards {
    /// Forgetting stops raising `P` where its trace reaches this: unit of `theta^2`, at least the trace of `P(0)`;
    /// `f64::INFINITY` for none below 1e100. An estimator starts with 1e6 times the trace of its `P(0)`.
    ///
    /// A regressor that stays in a subspace for long makes the other directions reach the cap; while they are
    /// there, forgetting is nearly off in all directions. With [`Directional`](crate::Directional) it is not: no eigenvalue of `P`
    /// is raised above the cap, by not forgetting with a regressor too weak for it, `gamma |phi|^2 trace_limit < eta`.
    ///
    /// `f64::INFINITY` is serialised as `None`, because JSON has no number for it.
    #[cfg_attr(feature = "serde", serde(with = "infinite_as_none"))]
    pub trace_limit: f64,
    /// No forgetting in a step whose regressor has a Euclidean norm of at most this: unit of `phi`. At 0, the default, this applies only to
    /// a regressor that is exactly zero; below 0 it never applies, and `P` winds up as in the paper. Above 1e30 the value is 1e30, the
    /// limit of a regressor. The intensity of a [`RandomWalk`](crate::RandomWalk) is still added.
    pub silent_below: f64,
}

#[cfg(feature = "serde")]
mod infinite_as_none {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    // serde hands over a reference
    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub fn serialize<S: Serializer>(limit: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        (*limit != f64::INFINITY)
            .then_some(limit)
            .serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
    }
}

impl Guards {
    pub(crate) fn check(&self, trace: f64) -> Result<(), Error> {
        let limit = self.trace_limit;
        if limit.is_nan() || limit <= 0.0 {
            return Err(Error::Guard {
                guard: "trace_limit",
                value: limit,
                range: "above 0, or f64::INFINITY for none",
            });
        }
        if !self.silent_below.is_finite() {
            return Err(Error::Guard {
                guard: "silent_below",
                value: self.silent_below,
                range: "finite, in the unit of phi",
            });
        }
        let limit = self.cap();
        if trace > limit {
            return Err(Error::TraceAboveLimit { trace, limit });
        }
        Ok(())
    }

    /// The cap in force.
    pub(crate) fn cap(&self) -> f64 {
        self.trace_limit.min(MAX_TRACE)
    }
}

/// `e^{eta h}` and `(e^{eta h} - 1)/eta` of one step; valid while `eta` and `h` do not change.
#[derive(Clone, Copy, Debug)]
pub struct StepFactors {
    eta: f64,
    /// The step h, s.
    pub dt: f64,
    /// `e^{eta h}`
    pub growth: f64,
    /// `(e^{eta h} - 1)/eta`, s; h for `eta = 0`.
    pub length: f64,
}

/// A longer regressor counts as a fault: within this and the other limits no number of updates overflows.
pub const MAX_REGRESSOR: f64 = 1e30;
pub(crate) const MAX_PHI_SQUARED: f64 = MAX_REGRESSOR * MAX_REGRESSOR;
/// Largest output error.
pub(crate) const MAX_EPSILON: f64 = 1e100;
/// Longest step, s.
const MAX_DT: f64 = 1e30;
/// Largest `c`.
const MAX_C: f64 = 1e40;
/// Largest trace of P; its pivots start above the inverse of it.
pub(crate) const MAX_TRACE: f64 = 1e100;

/// Beyond this value, one step forgets everything, and `e^{eta h}` overflows.
const MAX_ETA_DT: f64 = 300.0;

impl StepFactors {
    /// No step yet: equal to no step.
    pub fn none() -> Self {
        Self {
            eta: f64::NAN,
            dt: f64::NAN,
            growth: 1.0,
            length: 0.0,
        }
    }

    #[inline]
    pub fn matches(&self, eta: f64, dt: f64) -> bool {
        self.eta == eta && self.dt == dt
    }

    /// `None` for a step that is not above 0 or over which everything is forgotten.
    #[cold]
    pub fn new(eta: f64, dt: f64) -> Option<Self> {
        let x = eta * dt;
        if !(dt > 0.0 && dt <= MAX_DT && x <= MAX_ETA_DT) {
            return None;
        }
        let growth_less_one = libm::expm1(x);
        // below that, eta may be subnormal and the quotient lose digits
        let length = if x < f64::EPSILON {
            dt
        } else {
            growth_less_one / eta
        };
        Some(Self {
            eta,
            dt,
            growth: 1.0 + growth_less_one,
            length,
        })
    }

    /// The same step without forgetting.
    pub fn remembering(&self) -> Self {
        Self::remembering_for(self.dt)
    }

    /// A step of `dt` seconds without forgetting.
    pub fn remembering_for(dt: f64) -> Self {
        Self {
            eta: 0.0,
            dt,
            growth: 1.0,
            length: dt,
        }
    }

    pub fn eta(&self) -> f64 {
        self.eta
    }
}

/// Whether a step that first raises `P` stays in the floating-point range, decided before anything is changed: with a trace of at
/// most [`MAX_TRACE`] before, `gamma b phi' P phi` is below 1e300.
#[inline(always)]
pub(crate) fn in_range(w: &Weights, step: &StepFactors, phi: &[f64]) -> bool {
    let squared: f64 = phi.iter().map(|x| x * x).sum();
    w.gamma * step.length * squared <= 1e300 / MAX_TRACE
}

/// `(1 - D^{-c/gamma})/s` with `D = 1 + gamma b s`: what multiplies `P phi eps` in the exact step.
#[inline]
pub(crate) fn gain(w: &Weights, length: f64, s: f64, denominator: f64) -> f64 {
    if w.gamma == w.c {
        return w.c * length / denominator;
    }
    general_gain(w, length, s)
}

fn general_gain(w: &Weights, length: f64, s: f64) -> f64 {
    let b_s = length * s;
    if w.c * b_s < f64::EPSILON {
        return w.c * length;
    }
    // q = ln(1 + gamma b s)/gamma, b s for gamma -> 0
    let x = w.gamma * b_s;
    let q = if x < f64::EPSILON {
        b_s
    } else {
        libm::log1p(x) / w.gamma
    };
    -libm::expm1(-w.c * q) / s
}
