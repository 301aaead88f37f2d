//! Check of units: the dimensions of both sides of every equation, sum and comparison have to agree.
//!
//! A literal number has any dimension in a sum and a comparison (`T + 273.15`), and none in a product. A quantity without a unit, or with an
//! unknown one, agrees with every dimension. Scales are not compared: `kW` and `W` are both power.

use ct_signals::{Dimension, Unit};

use crate::expression::{Condition, Expression, Function, Operator};
use crate::spec::ModelSpec;

/// Two sides whose dimensions differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitWarning {
    /// The variable whose equation or start value it is.
    pub of: String,
    /// Whether it is the start value.
    pub in_start: bool,
    /// Both sides with their dimensions, in words.
    pub what: String,
}

/// Knowledge of a dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Known {
    /// A constant: in a sum it has the dimension of the other terms.
    Number,
    /// No unit is given, or the unit is unknown.
    Open,
    Is(Dimension),
}

const NONE: Dimension = Dimension::NONE;
const TIME: Dimension = Dimension::TIME;

/// All places with inconsistent units, in the order of the equations.
#[must_use]
pub fn unit_warnings(model: &ModelSpec) -> Vec<UnitWarning> {
    let mut walk = Walk {
        model,
        of: String::new(),
        in_start: false,
        found: Vec::new(),
    };
    for flow in &model.flows {
        walk.of.clone_from(&flow.about.name);
        let declared = declared(&flow.about.unit);
        let value = walk.dimension(&flow.value);
        walk.compare(
            (&flow.about.name, declared),
            (&model.write(&flow.value), value),
        );
    }
    for state in &model.states {
        walk.of.clone_from(&state.about.name);
        let declared = declared(&state.about.unit);
        let mut left = quotient(declared, Known::Is(TIME));
        let mut words = format!("der({})", state.about.name);
        if let Some(coefficient) = &state.coefficient {
            left = product(walk.dimension(coefficient), left);
            words = format!("{}*{words}", model.write(coefficient));
        }
        let right = walk.dimension(&state.right);
        walk.compare((&words, left), (&model.write(&state.right), right));
        walk.in_start = true;
        let start = walk.dimension(&state.start);
        walk.compare(
            (&state.about.name, declared),
            (&model.write(&state.start), start),
        );
        walk.in_start = false;
    }
    walk.found
}

struct Walk<'a> {
    model: &'a ModelSpec,
    of: String,
    in_start: bool,
    found: Vec<UnitWarning>,
}

fn times(a: Dimension, b: Dimension, power: i8) -> Known {
    a.times(b, power).map_or(Known::Open, Known::Is)
}

fn product(a: Known, b: Known) -> Known {
    match (a, b) {
        (Known::Open, _) | (_, Known::Open) => Known::Open,
        (Known::Number, other) | (other, Known::Number) => other,
        (Known::Is(a), Known::Is(b)) => times(a, b, 1),
    }
}

fn quotient(a: Known, b: Known) -> Known {
    match (a, b) {
        (Known::Open, _) | (_, Known::Open) => Known::Open,
        (other, Known::Number) => other,
        (Known::Number, Known::Is(b)) => times(NONE, b, -1),
        (Known::Is(a), Known::Is(b)) => times(a, b, -1),
    }
}

/// The dimension of a unit in Modelica: in a column's header `F` and `C` are temperatures, here they are farad and coulomb.
fn declared(unit: &str) -> Known {
    let unit = match unit.trim() {
        "F" => "A.s/V",
        "C" => "A.s",
        unit => unit,
    };
    Unit::parse(unit).map_or(Known::Open, |unit| Known::Is(unit.dimension()))
}

impl Walk<'_> {
    /// Records a warning if two sides differ, and returns their common dimension.
    fn compare(&mut self, (a, of_a): (&str, Known), (b, of_b): (&str, Known)) -> Known {
        match (of_a, of_b) {
            (Known::Is(own), Known::Is(other)) if own != other => {
                let words =
                    |part: &str, dimension: Dimension| format!("`{part}` is {}", said(dimension));
                self.found.push(UnitWarning {
                    of: self.of.clone(),
                    in_start: self.in_start,
                    what: format!("{}, but {}", words(a, own), words(b, other)),
                });
                Known::Open
            }
            (Known::Open, _) | (_, Known::Open) => Known::Open,
            (Known::Is(dimension), _) | (_, Known::Is(dimension)) => Known::Is(dimension),
            (Known::Number, Known::Number) => Known::Number,
        }
    }

    fn together(&mut self, a: &Expression, b: &Expression) -> Known {
        let (of_a, of_b) = (self.dimension(a), self.dimension(b));
        let (a, b) = (self.model.write(a), self.model.write(b));
        self.compare((&a, of_a), (&b, of_b))
    }

    /// Dimension of the argument of a function that takes pure numbers or angles.
    fn pure(&mut self, function: Function, argument: &Expression) {
        if let Known::Is(dimension) = self.dimension(argument)
            && dimension != NONE
        {
            self.found.push(UnitWarning {
                of: self.of.clone(),
                in_start: self.in_start,
                what: format!(
                    "`{}` is {}, and {} takes a pure number",
                    self.model.write(argument),
                    said(dimension),
                    function.name()
                ),
            });
        }
    }

    fn dimension(&mut self, expression: &Expression) -> Known {
        match expression {
            Expression::Number(_) => Known::Number,
            Expression::Time => Known::Is(TIME),
            Expression::Variable(variable) => declared(&self.model.about(*variable).unit),
            Expression::Negative(a) => self.dimension(a),
            Expression::Binary(operator, a, b) => match operator {
                Operator::Add | Operator::Subtract => self.together(a, b),
                Operator::Multiply => product(self.dimension(a), self.dimension(b)),
                Operator::Divide => quotient(self.dimension(a), self.dimension(b)),
                Operator::Power => {
                    let base = self.dimension(a);
                    self.dimension(b);
                    match (base, &**b) {
                        (Known::Is(dimension), _) if dimension == NONE => base,
                        (Known::Is(dimension), Expression::Number(power))
                            if power.fract() == 0.0 && *power <= 12.0 =>
                        {
                            times(NONE, dimension, *power as i8)
                        }
                        (Known::Number, _) => Known::Number,
                        _ => Known::Open,
                    }
                }
            },
            Expression::Call(function, arguments) => match (function, arguments.as_slice()) {
                (Function::Abs, [a]) => self.dimension(a),
                (
                    Function::Min
                    | Function::Max
                    | Function::Play
                    | Function::StayBetween
                    | Function::Quantise,
                    [a, b],
                ) => self.together(a, b),
                (Function::StickSlip, [a, b, jump, begin]) => {
                    self.pure(*function, jump);
                    self.pure(*function, begin);
                    self.together(a, b)
                }
                (Function::Atan2, [a, b]) => {
                    self.together(a, b);
                    Known::Is(NONE)
                }
                (Function::Sign, [a]) => {
                    self.dimension(a);
                    Known::Is(NONE)
                }
                // A square root of a dimension without a name is not checked.
                (Function::Sqrt, [a]) => match self.dimension(a) {
                    Known::Is(dimension) => dimension.root().map_or(Known::Open, Known::Is),
                    other => other,
                },
                (_, arguments) => {
                    for argument in arguments {
                        self.pure(*function, argument);
                    }
                    Known::Is(NONE)
                }
            },
            Expression::If(condition, a, b) => {
                self.condition(condition);
                self.together(a, b)
            }
            Expression::Delay(a, by) => {
                let by_dimension = self.dimension(by);
                let words = self.model.write(by);
                self.compare(("time", Known::Is(TIME)), (&words, by_dimension));
                self.dimension(a)
            }
        }
    }

    fn condition(&mut self, condition: &Condition) {
        match condition {
            Condition::Constant(_) => {}
            Condition::Compare(_, a, b) => {
                self.together(a, b);
            }
            Condition::Not(a) => self.condition(a),
            Condition::And(a, b) | Condition::Or(a, b) => {
                self.condition(a);
                self.condition(b);
            }
        }
    }
}

/// A dimension in words: its name where it has one, and its powers.
fn said(dimension: Dimension) -> String {
    let base = [
        ("m", dimension.length),
        ("kg", dimension.mass),
        ("s", dimension.time),
        ("A", dimension.current),
        ("K", dimension.temperature),
        ("mol", dimension.amount),
    ];
    let powers: Vec<String> = base
        .iter()
        .filter(|(_, power)| *power != 0)
        .map(|(unit, power)| match power {
            1 => (*unit).to_string(),
            power => format!("{unit}^{power}"),
        })
        .collect();
    match (dimension.kind(), powers.is_empty()) {
        (_, true) => "a pure number".to_string(),
        (Some(kind), false) => format!("{kind} ({})", powers.join(" ")),
        (None, false) => powers.join(" "),
    }
}
