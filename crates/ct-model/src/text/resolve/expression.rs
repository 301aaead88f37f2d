//! Expressions of a text: resolution of names, and checks of allowed variables.

use super::{Builder, Holds};
use crate::expression::{Condition, Expression, Function, Variable};
use crate::text::error::{TextError, shown};
use crate::text::names::is_near;
use crate::text::syntax::{Kind, Node};

impl Builder<'_> {
    pub(super) fn unknown(&self, name: &str) -> String {
        let near = self
            .names
            .all
            .keys()
            .filter(|own| is_near(own, name))
            .min_by_key(|own| own.len().abs_diff(name.len()));
        match near {
            Some(near) => format!(
                "{} is not declared: declare it, or did you mean {}?",
                shown(name),
                shown(near)
            ),
            None => format!(
                "{} is not declared: declare it, `parameter Real {name} = ...;` or `input Real {name};`",
                shown(name)
            ),
        }
    }

    pub(super) fn expression(
        &mut self,
        node: &Node,
        holds: Holds,
    ) -> Result<Expression, TextError> {
        let mut part = |node: &Node| self.expression(node, holds).map(Box::new);
        Ok(match &node.kind {
            Kind::Number(value) => Expression::Number(*value),
            Kind::Negative(a) => Expression::Negative(part(a)?),
            Kind::Binary(operator, a, b) => Expression::Binary(*operator, part(a)?, part(b)?),
            Kind::If(condition, a, b) => {
                let (a, b) = (part(a)?, part(b)?);
                Expression::If(Box::new(self.condition(condition, holds)?), a, b)
            }
            Kind::Name(name) => return self.variable(name, node.from, holds),
            Kind::Call(name, arguments) => return self.call(name, arguments, node.from, holds),
            Kind::Truth(_) | Kind::Compare(..) | Kind::Not(_) | Kind::And(..) | Kind::Or(..) => {
                return self.error(
                    node.from,
                    "a condition where a number is needed: write `if ... then 1 else 0`",
                );
            }
        })
    }

    fn condition(&mut self, node: &Node, holds: Holds) -> Result<Condition, TextError> {
        Ok(match &node.kind {
            Kind::Truth(value) => Condition::Constant(*value),
            Kind::Compare(comparison, a, b) => Condition::Compare(
                *comparison,
                Box::new(self.expression(a, holds)?),
                Box::new(self.expression(b, holds)?),
            ),
            Kind::Not(a) => Condition::Not(Box::new(self.condition(a, holds)?)),
            Kind::And(a, b) => Condition::And(
                Box::new(self.condition(a, holds)?),
                Box::new(self.condition(b, holds)?),
            ),
            Kind::Or(a, b) => Condition::Or(
                Box::new(self.condition(a, holds)?),
                Box::new(self.condition(b, holds)?),
            ),
            Kind::Call(name, arguments) if name == "noEvent" && arguments.len() == 1 => {
                self.condition(&arguments[0], holds)?
            }
            _ => {
                return self.error(
                    node.from,
                    "a number where a condition is needed: compare it, `x > 0`",
                );
            }
        })
    }

    fn variable(&mut self, name: &str, from: usize, holds: Holds) -> Result<Expression, TextError> {
        if name == "time" {
            if holds != Holds::Everything {
                return self.error(from, "`time` where only numbers and parameters are allowed");
            }
            return Ok(Expression::Time);
        }
        let Some(&variable) = self.names.all.get(name) else {
            return self.error(from, self.unknown(name));
        };
        if holds != Holds::Everything {
            let declared = match variable {
                Variable::Parameter(i) => i < self.spec.parameters.len(),
                Variable::Flow(i) if i < self.names.tied => true,
                _ => {
                    let what = format!(
                        "{} is not a parameter: only numbers and parameters are allowed here",
                        shown(name)
                    );
                    return self.error(from, what);
                }
            };
            if !declared {
                let what = format!(
                    "{} is declared below: declare it before it is used in another value",
                    shown(name)
                );
                return self.error(from, what);
            }
        }
        if holds != Holds::Numbers {
            self.used.insert(variable);
        }
        Ok(Expression::Variable(variable))
    }

    fn call(
        &mut self,
        name: &str,
        arguments: &[Node],
        from: usize,
        holds: Holds,
    ) -> Result<Expression, TextError> {
        let count = |wanted: usize, of: &str| {
            if arguments.len() == wanted {
                return Ok(());
            }
            let what = format!("{name} takes {of}, and {} are given here", arguments.len());
            Err(TextError::at(self.text, from, what))
        };
        match name {
            "der" => self.error(
                from,
                "a derivative stands alone on the left, `der(x) = ...` or `c*der(x) = ...`: name what it is equal to, and use that",
            ),
            "noEvent" => {
                count(1, "one argument")?;
                self.expression(&arguments[0], holds)
            }
            "smooth" => {
                count(2, "an order and an expression")?;
                self.known_value(&arguments[0])?;
                self.expression(&arguments[1], holds)
            }
            "delay" => {
                if holds != Holds::Everything {
                    return self.error(from, "a delay where only numbers and parameters are allowed");
                }
                count(2, "an expression and a time")?;
                let delayed = self.expression(&arguments[0], holds)?;
                let by = self.delay_time(&arguments[1])?;
                Ok(Expression::Delay(Box::new(delayed), Box::new(by)))
            }
            _ => {
                let Some(function) = Function::ALL.into_iter().find(|f| f.name() == name) else {
                    let all: Vec<&str> = Function::ALL.iter().map(|f| f.name()).collect();
                    let what = format!(
                        "{} is not a supported function; supported are {}, delay, noEvent and smooth",
                        shown(name),
                        all.join(", ")
                    );
                    return self.error(from, what);
                };
                count(
                    function.arguments(),
                    match function.arguments() {
                        1 => "one argument",
                        2 => "two arguments",
                        _ => "four arguments",
                    },
                )?;
                let arguments = arguments
                    .iter()
                    .map(|argument| self.expression(argument, holds))
                    .collect::<Result<_, _>>()?;
                Ok(Expression::Call(function, arguments))
            }
        }
    }

    /// A dead time: it does not change while the model runs.
    fn delay_time(&mut self, node: &Node) -> Result<Expression, TextError> {
        let by = self.expression(node, Holds::Everything)?;
        let mut constant =
            !by.any(&|part| matches!(part, Expression::Time | Expression::Delay(..)));
        by.each_variable(&mut |variable| constant &= matches!(variable, Variable::Parameter(_)));
        if constant {
            return Ok(by);
        }
        self.error(
            node.from,
            "a dead time may depend on numbers and parameters only: a dead time that changes with time is not supported",
        )
    }
}
