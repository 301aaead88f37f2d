//! Controllers with output limits, to close the loop around a [`crate::Simulator`], for any [`Scalar`].
//!
//! - **PI**: `u = b + gain e`, `b+ = b + gain h/integral_time e`, `e = r - y`; anti-windup: the integral is held while the command is at a
//!   limit and the error would drive it further beyond. Some controllers update the integral first: `b+ = b + gain h/integral_time e`,
//!   `u = b+ + gain e` ([`Controller::with_integral_first`]).
//! - **R/S**: `S(q^-1) u = R(q^-1) e`, `s_0 = 1`, in the transposed direct form `u = x_1 + r_0 e`, `x_i+ = x_(i+1) + r_i e - s_i u`. `u` is
//!   the limited command (K. J. Astrom, B. Wittenmark, Computer Controlled Systems, 3rd ed. 1997, section 9.4), so that integral action in
//!   `R/S` does not wind up. If `S(1)` is not zero, one more state holds the command of the operating point.
//!
//! The states of a controller have the unit of the command. The states that enter the command directly add up to the command at `e = 0`. A
//! PI controller has one state, `b`: the sum of operating point and integral.

mod regulator;

use ct_lti::{Hold, StateSpace, TransferFunction};

pub use self::regulator::{Pi, Regulator};
use crate::{Error, Scalar};

/// Largest number of states of a controller.
pub const MAX_CONTROLLER_STATES: usize = 8;

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Pi {
        gain: f64,
        integral_time: f64,
        /// The integral is updated before the command is computed.
        integral_first: bool,
    },
    /// `r` and `s` have equal length, and `s[0] = 1`.
    Sampled {
        r: Vec<f64>,
        s: Vec<f64>,
        /// The last state is the command of the operating point.
        operating_point: bool,
    },
}

/// The settings of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    kind: Kind,
    limits: (f64, f64),
    output: usize,
}

/// A controller without limits in state-space form: `x+ = A x + b e`, `u = c x + d e`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearController {
    /// Matrix A, row by row.
    pub a: Vec<Vec<f64>>,
    /// Vector b.
    pub b: Vec<f64>,
    /// Vector c.
    pub c: Vec<f64>,
    /// Direct feedthrough d.
    pub d: f64,
}

fn refused<T>(what: String) -> Result<T, Error> {
    Err(Error::Controller { what })
}

fn checked(kind: Kind, limits: (f64, f64)) -> Result<Controller, Error> {
    if limits.0.is_nan() || limits.1.is_nan() || limits.0 >= limits.1 {
        return refused(format!(
            "u_min = {} is not below u_max = {}: swap them",
            short(limits.0),
            short(limits.1)
        ));
    }
    Ok(Controller {
        kind,
        limits,
        output: 0,
    })
}

impl Controller {
    /// The same controller, reading the output with this index instead of the first output.
    #[must_use]
    pub fn at_output(mut self, output: usize) -> Self {
        self.output = output;
        self
    }

    /// Index of the output that the controller reads, counted from zero.
    #[must_use]
    pub fn output(&self) -> usize {
        self.output
    }

    /// A PI controller: `gain` \[input/output\], `integral_time` \[s\], `limits` \[input\].
    ///
    /// # Errors
    /// If a setting is not finite, the gain is zero, the integral time is not positive, or the lower limit is not below the upper one.
    pub fn pi(gain: f64, integral_time: f64, limits: (f64, f64)) -> Result<Self, Error> {
        if !gain.is_finite() || gain == 0.0 {
            return refused(format!(
                "gain = {}: give a finite gain other than zero",
                short(gain)
            ));
        }
        if !(integral_time.is_finite() && integral_time > 0.0) {
            return refused(format!(
                "integral_time = {} s: give a positive time",
                short(integral_time)
            ));
        }
        checked(
            Kind::Pi {
                gain,
                integral_time,
                integral_first: false,
            },
            limits,
        )
    }

    /// The PI controller that updates its integral before it computes the command; `None` if that is no other controller.
    #[must_use]
    pub fn with_integral_first(&self) -> Option<Self> {
        let mut other = self.clone();
        match &mut other.kind {
            Kind::Pi { integral_first, .. } if !*integral_first => {
                *integral_first = true;
                Some(other)
            }
            _ => None,
        }
    }

    /// `S(q^-1) u = R(q^-1) e`: coefficients of the powers 0, 1, 2, ... of `q^-1`, the delay by one sample; `limits` \[input\].
    ///
    /// # Errors
    /// If a coefficient is not finite, `s[0]` or all of `r` is zero, there are too many states, or the lower limit is not below the upper
    /// one.
    pub fn sampled(r: &[f64], s: &[f64], limits: (f64, f64)) -> Result<Self, Error> {
        if let Some(value) = r.iter().chain(s).find(|value| !value.is_finite()) {
            return refused(format!(
                "{value} among the coefficients: give finite numbers"
            ));
        }
        let Some(&first) = s.first().filter(|first| **first != 0.0) else {
            return refused(
                "s = [] or begins with 0: the command has to follow at once, give s[0]".into(),
            );
        };
        if r.iter().all(|value| *value == 0.0) {
            return refused("r is zero throughout: there is no controller; delete it".into());
        }
        let length = r.len().max(s.len());
        let padded = |of: &[f64]| -> Vec<f64> {
            (0..length)
                .map(|i| of.get(i).map_or(0.0, |value| value / first))
                .collect()
        };
        let (r, s) = (padded(r), padded(s));
        let size: f64 = s.iter().map(|value| value.abs()).sum();
        let operating_point = s.iter().sum::<f64>().abs() > 1e-9 * size;
        let states = length - 1 + usize::from(operating_point);
        if states > MAX_CONTROLLER_STATES {
            return refused(format!(
                "{states} states where at most {MAX_CONTROLLER_STATES} are known: reduce the orders of r and s"
            ));
        }
        checked(
            Kind::Sampled {
                r,
                s,
                operating_point,
            },
            limits,
        )
    }

    /// `S(p) u = R(p) e`, coefficients from the highest power down, discretised with a zero-order hold of the reading and a sampling
    /// interval of `step` seconds.
    ///
    /// # Errors
    /// If `R/S` is not proper, cannot be sampled, or [`Controller::sampled`] rejects the result.
    pub fn continuous(r: &[f64], s: &[f64], step: f64, limits: (f64, f64)) -> Result<Self, Error> {
        let bad = |error: ct_lti::Error| Error::Controller {
            what: format!("r/s as a transfer function in p: {error}"),
        };
        let rising = |of: &[f64]| -> Vec<f64> { of.iter().rev().copied().collect() };
        let system = TransferFunction::from_coefficients(&rising(r), &rising(s)).map_err(bad)?;
        let space = StateSpace::controllable(&system).map_err(bad)?;
        let n = space.order();
        let sampled = space.sampled(Hold::Zero, step).map_err(bad)?;
        // Characteristic polynomial by the Faddeev-LeVerrier algorithm, then R = S times the pulse response.
        let mut s = vec![1.0];
        let mut m = vec![0.0; n * n];
        for k in 1..=n {
            // M <- Phi M + s_(k-1) I, s_k = -trace(Phi M)/k.
            let last = s[k - 1];
            m = times(&sampled.phi, &m, n);
            for i in 0..n {
                m[i * n + i] += last;
            }
            let product = times(&sampled.phi, &m, n);
            let trace: f64 = (0..n).map(|i| product[i * n + i]).sum();
            s.push(-trace / k as f64);
        }
        // A pole at z = 1 is set exactly: rounding would turn the integrator into a slow lag.
        let (sum, size) = s.iter().fold((0.0, 0.0), |(sum, size), value: &f64| {
            (sum + value, size + value.abs())
        });
        if sum.abs() < 1e-9 * size
            && let Some(last) = s.last_mut()
        {
            *last -= sum;
        }
        let mut pulse = vec![space.d()];
        let mut x = sampled.g0.clone();
        for _ in 0..n {
            pulse.push(space.c().iter().zip(&x).map(|(c, x)| c * x).sum());
            x = (0..n)
                .map(|i| (0..n).map(|j| sampled.phi[i * n + j] * x[j]).sum())
                .collect();
        }
        let r: Vec<f64> = (0..=n)
            .map(|k| (0..=k).map(|i| s[i] * pulse[k - i]).sum())
            .collect();
        Self::sampled(&r, &s, limits)
    }

    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        match &self.kind {
            Kind::Pi { .. } => 1,
            Kind::Sampled {
                r, operating_point, ..
            } => r.len() - 1 + usize::from(*operating_point),
        }
    }

    /// Smallest and largest command \[input\].
    #[must_use]
    pub fn limits(&self) -> (f64, f64) {
        self.limits
    }

    /// Direct feedthrough: the immediate change of the command per unit of error \[input/output\], apart from that of the integral.
    #[must_use]
    pub fn direct(&self) -> f64 {
        match &self.kind {
            Kind::Pi { gain, .. } => *gain,
            Kind::Sampled { r, .. } => r[0],
        }
    }

    /// The settings in the syntax of a model file.
    #[must_use]
    pub fn describe(&self) -> String {
        match &self.kind {
            Kind::Pi {
                gain,
                integral_time,
                ..
            } => format!(
                "gain = {}, integral_time = {} s",
                short(*gain),
                short(*integral_time)
            ),
            Kind::Sampled { r, s, .. } => format!("r = {}, s = {}", list(r), list(s)),
        }
    }

    /// Creates a running controller with these initial states; states that are not given are zero.
    #[must_use]
    pub fn start<T: Scalar>(&self, states: &[T]) -> Regulator<T> {
        let zero = T::constant(0.0);
        let given = |i: usize| states.get(i).copied().unwrap_or(zero);
        Regulator {
            controller: self.clone(),
            states: (0..self.states()).map(given).collect(),
            limited: false,
        }
    }

    /// The linear controller for a sampling interval of `h` seconds, valid while the command is not limited.
    #[must_use]
    pub fn linear(&self, h: f64) -> LinearController {
        let n = self.states();
        let mut a = vec![vec![0.0; n]; n];
        let mut b = vec![0.0; n];
        let mut c = vec![0.0; n];
        let mut d = self.direct();
        match &self.kind {
            Kind::Pi {
                gain,
                integral_time,
                integral_first,
            } => {
                a[0][0] = 1.0;
                c[0] = 1.0;
                b[0] = gain * h / integral_time;
                if *integral_first {
                    d += b[0];
                }
            }
            Kind::Sampled {
                r,
                s,
                operating_point,
            } => {
                let order = r.len() - 1;
                for i in 0..order {
                    b[i] = r[i + 1];
                    if i + 1 < order {
                        a[i][i + 1] = 1.0;
                    }
                    a[i][0] -= s[i + 1];
                    b[i] -= s[i + 1] * r[0];
                }
                if order > 0 {
                    c[0] = 1.0;
                }
                if *operating_point {
                    a[order][order] = 1.0;
                    c[order] = 1.0;
                }
            }
        }
        LinearController { a, b, c, d }
    }
}

/// A number as the user wrote it, or with a power of ten if it has too many digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-6..1e15).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Longer polynomials are shown by their first coefficients only.
const MOST_SHOWN: usize = 3;

/// Coefficients to four digits.
fn list(coefficients: &[f64]) -> String {
    let digits = |value: &f64| {
        let rounded = format!("{value:.3e}").parse().unwrap_or(*value);
        short(rounded)
    };
    let mut shown: Vec<String> = coefficients.iter().take(MOST_SHOWN).map(digits).collect();
    if coefficients.len() > MOST_SHOWN {
        shown.push("...".to_string());
    }
    format!("[{}]", shown.join(", "))
}

fn times(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let mut product = vec![0.0; n * n];
    for i in 0..n {
        for k in 0..n {
            for j in 0..n {
                product[i * n + j] += a[i * n + k] * b[k * n + j];
            }
        }
    }
    product
}

#[cfg(test)]
mod tests;
