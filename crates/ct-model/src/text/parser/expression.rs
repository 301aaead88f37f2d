//! Expressions, with Modelica's precedence.

use super::{DEEPEST, Joins, Parser};
use crate::expression::{Comparison, Operator};
use crate::text::error::TextError;
use crate::text::lexer::Word;
use crate::text::syntax::{Kind, Node};

impl Parser<'_> {
    /// Deeper nesting could overflow the stack.
    fn bounded(&self, node: Node) -> Result<Node, TextError> {
        if node.depth <= DEEPEST {
            return Ok(node);
        }
        let what = format!(
            "an expression of more than {DEEPEST} operators within each other: define a variable for a part of it"
        );
        Err(TextError::at(self.text, node.from, what))
    }

    fn join(&self, kind: Kind, from: usize) -> Result<Node, TextError> {
        self.bounded(Node::new(kind, from))
    }

    pub(super) fn expression(&mut self) -> Result<Node, TextError> {
        self.brackets += 1;
        if self.brackets > DEEPEST {
            return self.error(format!(
                "more than {DEEPEST} brackets within each other: define a variable for a part of it"
            ));
        }
        let node = if self.is_name("if") {
            self.choice()?
        } else {
            self.or()?
        };
        self.brackets -= 1;
        Ok(node)
    }

    /// Parses from `if` or `elseif` on.
    fn choice(&mut self) -> Result<Node, TextError> {
        let from = self.next().from;
        let condition = self.expression()?;
        if !self.take_name("then") {
            return self.unexpected("`then`");
        }
        let first = self.expression()?;
        let second = if self.is_name("elseif") {
            self.brackets += 1;
            if self.brackets > DEEPEST {
                return self.error(format!("more than {DEEPEST} choices within each other"));
            }
            let node = self.choice()?;
            self.brackets -= 1;
            node
        } else if self.take_name("else") {
            self.expression()?
        } else {
            return self.unexpected("`else`");
        };
        self.join(
            Kind::If(Box::new(condition), Box::new(first), Box::new(second)),
            from,
        )
    }

    fn or(&mut self) -> Result<Node, TextError> {
        let or = |word: &Word| (*word == Word::Name("or".into())).then_some(Kind::Or as Joins);
        let left = self.and()?;
        self.chain(left, or, Self::and)
    }

    fn and(&mut self) -> Result<Node, TextError> {
        let and = |word: &Word| (*word == Word::Name("and".into())).then_some(Kind::And as Joins);
        let left = self.not()?;
        self.chain(left, and, Self::not)
    }

    /// Parts joined from left to right, as long as an operator follows.
    fn chain(
        &mut self,
        mut left: Node,
        operator: fn(&Word) -> Option<Joins>,
        part: fn(&mut Self) -> Result<Node, TextError>,
    ) -> Result<Node, TextError> {
        let from = left.from;
        while let Some(joins) = operator(self.word()) {
            self.next();
            let right = part(self)?;
            left = self.join(joins(Box::new(left), Box::new(right)), from)?;
        }
        Ok(left)
    }

    fn not(&mut self) -> Result<Node, TextError> {
        let from = self.from();
        if self.take_name("not") {
            let inner = self.relation()?;
            return self.join(Kind::Not(Box::new(inner)), from);
        }
        self.relation()
    }

    fn relation(&mut self) -> Result<Node, TextError> {
        let left = self.sum()?;
        let comparison = match self.word() {
            Word::Sign("<") => Comparison::Less,
            Word::Sign("<=") => Comparison::LessOrEqual,
            Word::Sign(">") => Comparison::Greater,
            Word::Sign(">=") => Comparison::GreaterOrEqual,
            Word::Sign("==") => Comparison::Equal,
            Word::Sign("<>") => Comparison::NotEqual,
            _ => return Ok(left),
        };
        self.next();
        let right = self.sum()?;
        let from = left.from;
        self.join(
            Kind::Compare(comparison, Box::new(left), Box::new(right)),
            from,
        )
    }

    pub(super) fn sum(&mut self) -> Result<Node, TextError> {
        let from = self.from();
        let negative = self.take_sign("-");
        if !negative {
            self.take_sign("+");
        }
        let mut left = self.term()?;
        if negative {
            left = self.join(Kind::Negative(Box::new(left)), from)?;
        }
        self.chain(
            left,
            |word| match word {
                Word::Sign("+") => Some(|a, b| Kind::Binary(Operator::Add, a, b)),
                Word::Sign("-") => Some(|a, b| Kind::Binary(Operator::Subtract, a, b)),
                _ => None,
            },
            Self::term,
        )
    }

    fn term(&mut self) -> Result<Node, TextError> {
        let left = self.factor()?;
        self.chain(
            left,
            |word| match word {
                Word::Sign("*") => Some(|a, b| Kind::Binary(Operator::Multiply, a, b)),
                Word::Sign("/") => Some(|a, b| Kind::Binary(Operator::Divide, a, b)),
                _ => None,
            },
            Self::factor,
        )
    }

    fn factor(&mut self) -> Result<Node, TextError> {
        let from = self.from();
        let base = self.primary()?;
        if !self.take_sign("^") {
            return Ok(base);
        }
        let exponent = self.primary()?;
        if self.is_sign("^") {
            return self.error("`^` after `^` is ambiguous: put brackets, `(a^b)^c`");
        }
        self.join(
            Kind::Binary(Operator::Power, Box::new(base), Box::new(exponent)),
            from,
        )
    }

    fn primary(&mut self) -> Result<Node, TextError> {
        let token = self.tokens[self.at].clone();
        let from = token.from;
        match token.word {
            Word::Number(value) => {
                self.next();
                Ok(Node::new(Kind::Number(value), from))
            }
            Word::Sign("(") => {
                self.next();
                let inner = self.expression()?;
                if self.is_sign(",") {
                    return self.error("a list in brackets is not supported: write one expression");
                }
                self.expect_sign(")", "`)`")?;
                Ok(inner)
            }
            Word::Sign(sign @ ("-" | "+")) => self.error(format!(
                "`{sign}` behind an operator: put brackets, `({sign}x)`"
            )),
            Word::Name(name) => match name.as_str() {
                "true" | "false" => {
                    self.next();
                    Ok(Node::new(Kind::Truth(name == "true"), from))
                }
                "if" => self.error("`if` within an expression: put brackets around the choice"),
                "der" => {
                    self.next();
                    self.call(name, from)
                }
                _ => {
                    let (name, from) = self.name("a number, a name or a bracket")?;
                    if self.is_sign("(") {
                        return self.call(name, from);
                    }
                    Ok(Node::new(Kind::Name(name), from))
                }
            },
            _ => self.unexpected("a number, a name or a bracket"),
        }
    }

    /// Parses from the opening bracket on.
    fn call(&mut self, name: String, from: usize) -> Result<Node, TextError> {
        self.expect_sign("(", "`(`")?;
        let mut arguments = Vec::new();
        if !self.is_sign(")") {
            loop {
                arguments.push(self.expression()?);
                if !self.take_sign(",") {
                    break;
                }
            }
        }
        self.expect_sign(")", "`)` or `,`")?;
        self.join(Kind::Call(name, arguments), from)
    }
}
