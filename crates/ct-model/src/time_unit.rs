//! The unit of time that the units of a model's text imply.
//!
//! In `C*der(T) = k*(Ta - T)` with C in kJ/K, k in W/K and T in degC, `der(T)` is per 1000 s. An equation says nothing where a quantity of it
//! has no unit. A literal factor is a number, unless it converts units (60, 1000, 3600, ...): `3600*Q` of Q in A.h is in A.s.

use std::cell::Cell;

use ct_signals::{Dimension, Unit};

use crate::expression::{Expression, Function, Operator};
use crate::spec::ModelSpec;

/// Units of time that a text may be written in \[s\].
const UNITS: [f64; 6] = [1e-6, 1e-3, 1.0, 60.0, 3600.0, 86_400.0];
/// Literal factors that convert units; so do their inverses.
const CONVERSIONS: [f64; 6] = [60.0, 1e3, 3600.0, 86_400.0, 1e6, 6e4];
/// Relative difference of two sizes that are equal except for rounding.
const EQUAL: f64 = 1e-6;

/// Unit of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Size {
    /// A literal number fits every unit in a sum.
    Number(f64),
    /// Size in SI units, and dimension.
    Known(f64, Dimension),
    /// A unit is missing, or two terms of a sum have different ones.
    Open,
}

/// Seconds in the unit of time of `der()` by the units of the text; `None` where no equation determines one, or two differ.
///
/// A signal in percent may be multiplied by a gain in W/% or, as a share, by one in W. Nothing follows from an equation that has a share or an
/// angle and a literal factor: the factor may convert one of them.
#[must_use]
pub fn implied_time_unit(model: &ModelSpec) -> Option<f64> {
    [1.0, 0.01]
        .into_iter()
        .find_map(|percent| implied(model, percent))
}

fn implied(model: &ModelSpec, percent: f64) -> Option<f64> {
    let mut implied = None;
    for state in &model.states {
        let sizes = Sizes {
            model,
            percent,
            literal: Cell::new(false),
            share: Cell::new(false),
        };
        let coefficient = state.coefficient.as_ref();
        let coefficient = coefficient.map_or(PURE, |c| sizes.of(c));
        let left = sizes.product(coefficient, sizes.of_unit(&state.about.unit));
        let right = sizes.of(&state.right);
        let Size::Known(unit, Dimension::TIME) = sizes.quotient(left, right) else {
            continue;
        };
        if sizes.literal.get() && sizes.share.get() {
            continue;
        }
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

const PURE: Size = Size::Known(1.0, Dimension::NONE);

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
        (Size::Known(a, of_a), Size::Known(b, of_b))
            if of_a == of_b && (a / b - 1.0).abs() < EQUAL =>
        {
            Size::Known(a, of_a)
        }
        _ => Size::Open,
    }
}

/// Sizes of the expressions of an equation.
struct Sizes<'a> {
    model: &'a ModelSpec,
    /// Size of a signal in percent.
    percent: f64,
    /// There is a literal factor that is no known conversion, ...
    literal: Cell<bool>,
    /// ... and a share, an angle or a speed in turns.
    share: Cell<bool>,
}

impl Sizes<'_> {
    /// Size of a unit as written in the text. Dimensionless units other than `%`, and angles, are plain numbers.
    fn of_unit(&self, unit: &str) -> Size {
        let unit = match unit.trim() {
            "" => return Size::Open,
            "1" | "-" => return PURE,
            "%" => {
                self.share.set(true);
                return Size::Known(self.percent, Dimension::NONE);
            }
            "F" => "A.s/V",
            "C" => "A.s",
            unit => unit,
        };
        let Some(unit) = Unit::parse(unit) else {
            return Size::Open;
        };
        let turns = matches!(unit.kind(), Some("frequency" | "angular velocity"));
        if unit.dimension() == Dimension::NONE || turns {
            self.share.set(true);
        }
        if unit.dimension() == Dimension::NONE {
            return PURE;
        }
        Size::Known(unit.size(), unit.dimension())
    }

    fn product(&self, a: Size, b: Size) -> Size {
        self.times(a, b, 1)
    }

    fn quotient(&self, a: Size, b: Size) -> Size {
        self.times(a, b, -1)
    }

    /// A product with the first or minus first power of a factor.
    fn times(&self, a: Size, b: Size, power: i8) -> Size {
        let raised = |value: f64| value.powi(i32::from(power));
        match (a, b) {
            (Size::Known(a, of_a), Size::Known(b, of_b)) => of_a
                .times(of_b, power)
                .map_or(Size::Open, |of| Size::Known(a * raised(b), of)),
            (Size::Number(a), Size::Number(b)) => Size::Number(a * raised(b)),
            (Size::Known(size, of), Size::Number(factor)) => {
                Size::Known(size / self.converting(raised(factor)), of)
            }
            (Size::Number(factor), Size::Known(size, of)) => {
                Dimension::NONE.times(of, power).map_or(Size::Open, |of| {
                    Size::Known(raised(size) / self.converting(factor), of)
                })
            }
            _ => Size::Open,
        }
    }

    fn converting(&self, factor: f64) -> f64 {
        let converted = conversion(factor);
        if converted == 1.0 && factor.abs() != 1.0 {
            self.literal.set(true);
        }
        converted
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
                Operator::Multiply => self.product(of(a), of(b)),
                Operator::Divide => self.quotient(of(a), of(b)),
                Operator::Power => match (of(a), &**b) {
                    (Size::Known(size, dimension), Expression::Number(power))
                        if power.fract() == 0.0 && power.abs() <= 12.0 =>
                    {
                        Dimension::NONE
                            .times(dimension, *power as i8)
                            .map_or(Size::Open, |of| Size::Known(size.powf(*power), of))
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
                    Size::Known(size, of) => of
                        .root()
                        .map_or(Size::Open, |of| Size::Known(size.sqrt(), of)),
                    _ => Size::Open,
                },
                // The others are pure numbers.
                _ => PURE,
            },
        }
    }
}
