//! The operations of a tape: what each computes and reads.

use super::Register;
use crate::expression::quantised;
use crate::scalar::Scalar;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    Negative(Register),
    Add(Register, Register),
    Subtract(Register, Register),
    Multiply(Register, Register),
    Divide(Register, Register),
    /// Times a number without derivatives.
    Scale(Register, Register),
    /// Reciprocal of a register.
    Reciprocal(Register),
    Power(Register, Register),
    /// Power with a whole exponent.
    WholePower(Register, i32),
    Sqrt(Register),
    Exp(Register),
    Log(Register),
    Log10(Register),
    Sin(Register),
    Cos(Register),
    Tan(Register),
    Tanh(Register),
    Atan2(Register, Register),
    Quantise(Register, Register),
    /// One of two registers, selected by a condition.
    Select(usize, Register, Register),
    /// The register selected by a condition.
    Copy(Register),
}

/// `f(a)` from this value and slope. An infinite slope, such as that of a root at zero, is set to zero: a limit keeps the argument there.
fn slope<T: Scalar>(a: T, value: f64, slope: f64) -> T {
    T::with_slopes(value, [(a, if slope.is_infinite() { 0.0 } else { slope })])
}

fn power<T: Scalar>(a: T, b: T) -> T {
    let (x, n) = (a.value(), b.value());
    let value = x.powf(n);
    let finite = |slope: f64| if slope.is_finite() { slope } else { 0.0 };
    // Below zero only whole powers are defined, and these do not depend on the branch.
    let by_power = if x > 0.0 { value * x.ln() } else { 0.0 };
    T::with_slopes(value, [(a, finite(n * x.powf(n - 1.0))), (b, by_power)])
}

/// Computes operations in order.
#[inline]
pub(super) fn run<T: Scalar>(
    operations: &[(Operation, Register)],
    values: &mut [T],
    extended: bool,
) {
    for &(operation, to) in operations {
        debug_assert!(
            to < values.len(),
            "an operation reads only what is before its result"
        );
        let (before, after) = values.split_at_mut(to);
        if let Some(to) = after.first_mut() {
            operation.write(before, to, extended);
        }
    }
}

fn whole_power<T: Scalar>(a: T, n: i32) -> T {
    let x = a.value();
    if (2..=4).contains(&n) {
        let before = match n {
            2 => x,
            3 => x * x,
            _ => x * x * x,
        };
        return slope(a, before * x, f64::from(n) * before);
    }
    slope(a, x.powi(n), f64::from(n) * x.powi(n - 1))
}

impl Operation {
    /// Writes the result of the operation. `extended`: roots, powers and logarithms of negative numbers are zero.
    ///
    /// Every operation writes to its register itself: results that meet in one variable would be written twice.
    #[inline(always)]
    pub(super) fn write<T: Scalar>(self, values: &[T], to: &mut T, extended: bool) {
        let no_value = |x: f64| extended && x < 0.0;
        match self {
            Self::Negative(a) => *to = -values[a],
            Self::Add(a, b) => *to = values[a] + values[b],
            Self::Subtract(a, b) => *to = values[a] - values[b],
            Self::Multiply(a, b) => *to = values[a] * values[b],
            Self::Divide(a, b) => *to = values[a] / values[b],
            Self::Scale(a, b) => *to = values[a] * values[b].value(),
            Self::Reciprocal(a) => *to = T::constant(1.0) / values[a],
            Self::Power(a, _) | Self::Sqrt(a) | Self::Log(a) if no_value(values[a].value()) => {
                *to = T::constant(0.0);
            }
            Self::Power(a, b) => *to = power(values[a], values[b]),
            Self::WholePower(a, n) => *to = whole_power(values[a], n),
            Self::Sqrt(a) => {
                let root = values[a].value().sqrt();
                *to = slope(values[a], root, 0.5 / root);
            }
            Self::Exp(a) => *to = values[a].exp(),
            Self::Log(a) => {
                let x = values[a].value();
                *to = slope(values[a], x.ln(), 1.0 / x);
            }
            Self::Log10(a) => {
                let x = values[a].value();
                *to = slope(values[a], x.log10(), std::f64::consts::LOG10_E / x);
            }
            Self::Sin(a) => *to = values[a].sin_cos().0,
            Self::Cos(a) => *to = values[a].sin_cos().1,
            Self::Tan(a) => {
                let tan = values[a].value().tan();
                *to = slope(values[a], tan, 1.0 + tan * tan);
            }
            Self::Tanh(a) => {
                let tanh = values[a].value().tanh();
                *to = slope(values[a], tanh, 1.0 - tanh * tanh);
            }
            Self::Atan2(a, b) => {
                let (y, x) = (values[a].value(), values[b].value());
                let square = x * x + y * y;
                let of = [(values[a], x / square), (values[b], -y / square)];
                *to = T::with_slopes(y.atan2(x), of);
            }
            Self::Quantise(a, b) => {
                // A rounded value rises with its argument on average; its steps have no derivative.
                let value = quantised(values[a].value(), values[b].value());
                *to = slope(values[a], value, 1.0);
            }
            Self::Copy(a) => *to = values[a],
            // The condition selects the branch before the branch is computed.
            Self::Select(_, a, _) => *to = values[a],
        }
    }

    /// The registers that it reads, guards aside.
    pub(super) fn reads(self) -> [Option<Register>; 2] {
        match self {
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Scale(a, b)
            | Self::Power(a, b)
            | Self::Atan2(a, b)
            | Self::Quantise(a, b)
            | Self::Select(_, a, b) => [Some(a), Some(b)],
            Self::Negative(a)
            | Self::Reciprocal(a)
            | Self::WholePower(a, _)
            | Self::Sqrt(a)
            | Self::Exp(a)
            | Self::Log(a)
            | Self::Log10(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Tan(a)
            | Self::Tanh(a)
            | Self::Copy(a) => [Some(a), None],
        }
    }

    /// The operation with its registers renumbered.
    pub(super) fn with(self, moved: impl Fn(Register) -> Register) -> Self {
        match self {
            Self::Negative(a) => Self::Negative(moved(a)),
            Self::Add(a, b) => Self::Add(moved(a), moved(b)),
            Self::Subtract(a, b) => Self::Subtract(moved(a), moved(b)),
            Self::Multiply(a, b) => Self::Multiply(moved(a), moved(b)),
            Self::Divide(a, b) => Self::Divide(moved(a), moved(b)),
            Self::Scale(a, b) => Self::Scale(moved(a), moved(b)),
            Self::Reciprocal(a) => Self::Reciprocal(moved(a)),
            Self::Power(a, b) => Self::Power(moved(a), moved(b)),
            Self::WholePower(a, n) => Self::WholePower(moved(a), n),
            Self::Sqrt(a) => Self::Sqrt(moved(a)),
            Self::Exp(a) => Self::Exp(moved(a)),
            Self::Log(a) => Self::Log(moved(a)),
            Self::Log10(a) => Self::Log10(moved(a)),
            Self::Sin(a) => Self::Sin(moved(a)),
            Self::Cos(a) => Self::Cos(moved(a)),
            Self::Tan(a) => Self::Tan(moved(a)),
            Self::Tanh(a) => Self::Tanh(moved(a)),
            Self::Atan2(a, b) => Self::Atan2(moved(a), moved(b)),
            Self::Quantise(a, b) => Self::Quantise(moved(a), moved(b)),
            Self::Select(branch, a, b) => Self::Select(branch, moved(a), moved(b)),
            Self::Copy(a) => Self::Copy(moved(a)),
        }
    }
}
