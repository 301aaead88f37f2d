//! Meaning of each name of a text: parameter, input, state or flow.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    error::{TextError, shown},
    syntax::{Kept, Kind, Node, Syntax},
};
use crate::expression::{Function, Operator, Variable};
use crate::spec::ModelSpec;

/// Names that a variable cannot have.
const RESERVED: [&str; 6] = ["time", "delay", "noEvent", "smooth", "Real", "der"];

/// Whether a name is reserved.
pub(crate) fn is_reserved(name: &str) -> bool {
    RESERVED.contains(&name) || Function::ALL.iter().any(|f| f.name() == name)
}

/// Meanings of names. Flows have the order of the text until they are sorted.
pub(super) struct Names {
    pub(super) all: BTreeMap<String, Variable>,
    /// Declarations that are flows, and those that are states, by position.
    pub(super) flows: Vec<usize>,
    pub(super) states: Vec<usize>,
    /// Number of flows, at the beginning, that depend on parameters alone.
    pub(super) tied: usize,
}

/// Dependence of the value of a parameter.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tied {
    /// On numbers, constants and measured parameters: it has a value.
    No,
    /// On parameters that are fitted.
    Yes,
}

fn each_name<'a>(node: &'a Node, each: &mut impl FnMut(&'a str)) {
    match &node.kind {
        Kind::Number(_) | Kind::Truth(_) => {}
        Kind::Name(name) => each(name),
        Kind::Negative(a) | Kind::Not(a) => each_name(a, each),
        Kind::Binary(_, a, b) | Kind::Compare(_, a, b) | Kind::And(a, b) | Kind::Or(a, b) => {
            each_name(a, each);
            each_name(b, each);
        }
        Kind::Call(_, all) => all.iter().for_each(|a| each_name(a, each)),
        Kind::If(c, a, b) => {
            each_name(c, each);
            each_name(a, each);
            each_name(b, each);
        }
    }
}

/// The variable x if a node is `der(x)`.
fn derivative(node: &Node) -> Option<&str> {
    match &node.kind {
        Kind::Call(function, arguments) if function == "der" => match arguments.as_slice() {
            [
                Node {
                    kind: Kind::Name(name),
                    ..
                },
            ] => Some(name),
            _ => None,
        },
        _ => None,
    }
}

/// The state of an equation `der(x) = e`, `c*der(x) = e`, and the coefficient.
pub(super) fn differentiated(left: &Node) -> Option<(&str, Option<&Node>)> {
    if let Some(name) = derivative(left) {
        return Some((name, None));
    }
    let Kind::Binary(Operator::Multiply, a, b) = &left.kind else {
        return None;
    };
    match (derivative(a), derivative(b)) {
        (None, Some(name)) => Some((name, Some(a))),
        (Some(name), None) => Some((name, Some(b))),
        _ => None,
    }
}

impl Names {
    /// The names of a model.
    pub(super) fn of_model(spec: &ModelSpec) -> Self {
        let name = |variable| (spec.about(variable).name.clone(), variable);
        Self {
            all: spec.variables().map(name).collect(),
            flows: Vec::new(),
            states: Vec::new(),
            tied: spec.flows.iter().filter(|flow| flow.of_parameters).count(),
        }
    }

    pub(super) fn of(text: &str, syntax: &Syntax) -> Result<Self, TextError> {
        let is_differentiated: BTreeSet<&str> = syntax
            .equations
            .iter()
            .filter_map(|equation| Some(differentiated(&equation.left)?.0))
            .collect();
        let mut names = Self {
            all: BTreeMap::new(),
            flows: Vec::new(),
            states: Vec::new(),
            tied: 0,
        };
        // Parameters that depend on fitted ones are computed like flows.
        let mut tied: BTreeMap<&str, Tied> = BTreeMap::new();
        let mut of_parameters = Vec::new();
        let (mut parameters, mut inputs) = (0, 0);
        let next = |count: &mut usize| {
            *count += 1;
            *count - 1
        };
        for (index, declaration) in syntax.declarations.iter().enumerate() {
            let name = declaration.name.as_str();
            let at = |what: String| TextError::at(text, declaration.from, what);
            if is_reserved(name) {
                let what = format!("{} is a reserved word: choose another name", shown(name));
                return Err(at(what));
            }
            let of_fitted = || {
                let mut any = false;
                if let Some(binding) = &declaration.binding {
                    each_name(binding, &mut |name| {
                        any |= tied.get(name) == Some(&Tied::Yes)
                    });
                }
                any
            };
            let variable = match declaration.kept {
                Kept::FinalParameter if of_fitted() => {
                    tied.insert(name, Tied::Yes);
                    names.tied += 1;
                    of_parameters.push(index);
                    Variable::Flow(0)
                }
                Kept::Parameter => {
                    tied.insert(name, Tied::Yes);
                    Variable::Parameter(next(&mut parameters))
                }
                Kept::Constant | Kept::FinalParameter => {
                    tied.insert(name, Tied::No);
                    Variable::Parameter(next(&mut parameters))
                }
                Kept::Input => Variable::Input(next(&mut inputs)),
                Kept::Output | Kept::Plain if is_differentiated.contains(name) => {
                    names.states.push(index);
                    Variable::State(names.states.len() - 1)
                }
                Kept::Output | Kept::Plain => {
                    names.flows.push(index);
                    Variable::Flow(0)
                }
            };
            if names.all.insert(name.to_string(), variable).is_some() {
                let what = format!(
                    "{} is declared twice: give one of them another name",
                    shown(name)
                );
                return Err(at(what));
            }
        }
        of_parameters.append(&mut names.flows);
        names.flows = of_parameters;
        for (position, &index) in names.flows.iter().enumerate() {
            let name = syntax.declarations[index].name.clone();
            names.all.insert(name, Variable::Flow(position));
        }
        Ok(names)
    }
}

/// Two names that may differ by a typing error: one letter more, less or different, or another case.
pub(super) fn is_near(a: &str, b: &str) -> bool {
    if a.eq_ignore_ascii_case(b) {
        return true;
    }
    let (short, long) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    if long.len() - short.len() > 1 || short.is_empty() {
        return false;
    }
    let same = short
        .bytes()
        .zip(long.bytes())
        .take_while(|(a, b)| a == b)
        .count();
    let rest = short.len() - same;
    let tail = &long.as_bytes()[long.len() - rest..];
    if short.as_bytes()[same..] == *tail {
        return true;
    }
    short.len() == long.len()
        && rest > 0
        && short.len() > 1
        && short.as_bytes()[same + 1..] == long.as_bytes()[same + 1..]
}
