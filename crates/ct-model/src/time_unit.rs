//! The unit of time that the units of a model's text imply.
//!
//! In `C*der(T) = k*(Ta - T)` with C in kJ/K, k in W/K and T in degC, `der(T)` is per 1000 s. An equation says nothing where a quantity of it
//! has no unit. A literal factor is a number, unless it converts units (60, 1000, 3600, ...): `3600*Q` of Q in A.h is in A.s.

use ct_signals::{Dimension, Unit};

use crate::expression::{Expression, Function, Operator};
use crate::spec::ModelSpec;

/// Units of time that a text may be written in \[s\].
const UNITS: [f64; 6] = [1e-6, 1e-3, 1.0, 60.0, 3600.0, 86_400.0];
/// Literal factors that convert units; so do their inverses.
const CONVERSIONS: [f64; 6] = [60.0, 1e3, 3600.0, 86_400.0, 1e6, 6e4];
/// Relative difference of two sizes that are equal but for rounding.
const EQUAL: f64 = 1e-6;

/// Size of an expression's unit, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Size {
    /// A literal number fits every unit in a sum.
    Number(f64),
    Known(f64),
    /// A unit is missing, or two terms of a sum have different ones.
    Open,
}

/// Seconds in the unit of time of `der()` by the units of the text; `None` where no equation determines one, or two differ.
///
/// A signal in percent may be multiplied by a gain in W/% or, as a share, by one in W.
#[must_use]
pub fn implied_time_unit(model: &ModelSpec) -> Option<f64> {
    [1.0, 0.01]
        .into_iter()
        .find_map(|percent| implied(&Sizes { model, percent }))
}

fn implied(sizes: &Sizes<'_>) -> Option<f64> {
    let mut implied = None;
    for state in &sizes.model.states {
        let coefficient = state.coefficient.as_ref();
        let coefficient = coefficient.map_or(Size::Known(1.0), |c| sizes.of(c));
        let left = product(coefficient, sizes.of_unit(&state.about.unit));
        let Size::Known(unit) = quotient(left, sizes.of(&state.right)) else {
            continue;
        };
        let is_unit = |of: &&f64| (unit / **of - 1.0).abs() < EQUAL;
        let Some(&unit) = UNITS.iter().find(is_unit) else {
            continue;
        };
        if implied.is_some_and(|known| known != unit) {
            return None;
        }
        implied = Some(unit);
    }
    implied
}

fn product(a: Size, b: Size) -> Size {
    match (a, b) {
        (Size::Known(a), Size::Known(b)) => Size::Known(a * b),
        (Size::Number(a), Size::Number(b)) => Size::Number(a * b),
        (Size::Number(factor), Size::Known(of)) | (Size::Known(of), Size::Number(factor)) => {
            Size::Known(of / conversion(factor))
        }
        _ => Size::Open,
    }
}

fn quotient(a: Size, b: Size) -> Size {
    match b {
        Size::Known(b) => product(a, Size::Known(1.0 / b)),
        Size::Number(b) => product(a, Size::Number(1.0 / b)),
        Size::Open => Size::Open,
    }
}

/// A factor that converts units; 1 for another.
fn conversion(factor: f64) -> f64 {
    let factor = factor.abs();
    let converts =
        |by: &f64| (factor / by - 1.0).abs() < EQUAL || (factor * by - 1.0).abs() < EQUAL;
    if CONVERSIONS.iter().any(converts) {
        factor
    } else {
        1.0
    }
}

/// The common size of the terms of a sum.
fn common(a: Size, b: Size) -> Size {
    match (a, b) {
        (Size::Number(_), other) | (other, Size::Number(_)) => other,
        (Size::Known(a), Size::Known(b)) if (a / b - 1.0).abs() < EQUAL => Size::Known(a),
        _ => Size::Open,
    }
}

/// Sizes of the expressions of a model.
struct Sizes<'a> {
    model: &'a ModelSpec,
    /// Size of a signal in percent.
    percent: f64,
}

impl Sizes<'_> {
    /// Size of a unit as the text has it. Other shares and angles are numbers.
    fn of_unit(&self, unit: &str) -> Size {
        let unit = match unit.trim() {
            "" => return Size::Open,
            "%" => return Size::Known(self.percent),
            "F" => "A.s/V",
            "C" => "A.s",
            unit => unit,
        };
        let Some(unit) = Unit::parse(unit) else {
            return Size::Open;
        };
        if unit.dimension() == Dimension::NONE {
            return Size::Known(1.0);
        }
        Size::Known(unit.size())
    }

    fn of(&self, expression: &Expression) -> Size {
        let of = |part: &Expression| self.of(part);
        match expression {
            Expression::Number(value) => Size::Number(*value),
            Expression::Time => Size::Open,
            Expression::Variable(variable) => self.of_unit(&self.model.about(*variable).unit),
            Expression::Negative(a) | Expression::Delay(a, _) => of(a),
            Expression::If(_, a, b) => common(of(a), of(b)),
            Expression::Binary(operator, a, b) => match operator {
                Operator::Add | Operator::Subtract => common(of(a), of(b)),
                Operator::Multiply => product(of(a), of(b)),
                Operator::Divide => quotient(of(a), of(b)),
                Operator::Power => match (of(a), &**b) {
                    (Size::Known(base), Expression::Number(power)) => {
                        Size::Known(base.powf(*power))
                    }
                    _ => Size::Open,
                },
            },
            Expression::Call(function, arguments) => match (function, arguments.as_slice()) {
                (Function::Abs, [a]) => of(a),
                (
                    Function::Min
                    | Function::Max
                    | Function::Play
                    | Function::StayBetween
                    | Function::Quantise,
                    [a, b],
                ) => common(of(a), of(b)),
                (Function::StickSlip, [a, b, ..]) => common(of(a), of(b)),
                (Function::Sqrt, [a]) => match of(a) {
                    Size::Known(size) => Size::Known(size.sqrt()),
                    _ => Size::Open,
                },
                // The others are pure numbers.
                _ => Size::Known(1.0),
            },
        }
    }
}
