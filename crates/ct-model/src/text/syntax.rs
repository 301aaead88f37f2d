//! Syntax of a model text, before names are resolved.

use crate::expression::{Comparison, Operator};

/// A part of an expression and where it begins \[bytes\].
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) kind: Kind,
    pub(crate) from: usize,
    /// Depth of the tree including this node.
    pub(crate) depth: usize,
}

#[derive(Debug, Clone)]
pub(crate) enum Kind {
    Number(f64),
    Truth(bool),
    Name(String),
    Negative(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Compare(Comparison, Box<Node>, Box<Node>),
    Not(Box<Node>),
    And(Box<Node>, Box<Node>),
    Or(Box<Node>, Box<Node>),
    Call(String, Vec<Node>),
    If(Box<Node>, Box<Node>, Box<Node>),
}

impl Node {
    pub(crate) fn new(kind: Kind, from: usize) -> Self {
        let below = match &kind {
            Kind::Number(_) | Kind::Truth(_) | Kind::Name(_) => 0,
            Kind::Negative(a) | Kind::Not(a) => a.depth,
            Kind::Binary(_, a, b) | Kind::Compare(_, a, b) | Kind::And(a, b) | Kind::Or(a, b) => {
                a.depth.max(b.depth)
            }
            Kind::Call(_, all) => all.iter().map(|a| a.depth).max().unwrap_or(0),
            Kind::If(c, a, b) => c.depth.max(a.depth).max(b.depth),
        };
        Self {
            kind,
            from,
            depth: below + 1,
        }
    }
}

/// Kind of a declared variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kept {
    Constant,
    Parameter,
    FinalParameter,
    Input,
    Output,
    Plain,
}

/// A value in the brackets of a declaration.
#[derive(Debug, Clone)]
pub(crate) enum Attribute {
    Text(String),
    Value(Node),
}

/// A variable as it is declared.
#[derive(Debug, Clone)]
pub(crate) struct Declaration {
    pub(crate) kept: Kept,
    pub(crate) name: String,
    /// Position of the name \[bytes\].
    pub(crate) from: usize,
    /// Name, place and value.
    pub(crate) attributes: Vec<(String, usize, Attribute)>,
    pub(crate) binding: Option<Node>,
    pub(crate) description: String,
}

/// An equation with its two sides.
#[derive(Debug, Clone)]
pub(crate) struct Equation {
    pub(crate) left: Node,
    pub(crate) right: Node,
}

/// Syntax of a model.
#[derive(Debug, Clone)]
pub(crate) struct Syntax {
    pub(crate) name: String,
    pub(crate) description: String,
    pub(crate) declarations: Vec<Declaration>,
    pub(crate) equations: Vec<Equation>,
    /// Under `initial equation`.
    pub(crate) initial: Vec<Equation>,
}
