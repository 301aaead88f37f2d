//! Effects at the ports of a model in words: where each acts, and what it does there.

use std::collections::BTreeMap;

use ct_model::effects::{Candidate, OwnCandidate, Port};
use ct_model::{About, ModelSpec, Variable};
use ct_signals::escaped;

use super::effects::every_candidate;

/// What is said of the effects of a model.
pub(crate) struct EffectWords(BTreeMap<String, Words>);

/// A port that effects sit at, by the name of its variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Site {
    Input(String),
    Output(String),
    /// The equation of a state.
    Equation(String),
    /// A parameter or a named flow.
    Value(String),
}

impl Site {
    /// What it is.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Input(_) => "input",
            Self::Output(_) => "output",
            Self::Equation(_) => "equation",
            Self::Value(_) => "parameter or flow",
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
struct Words {
    place: String,
    sites: Vec<Site>,
    physics: &'static str,
}

impl EffectWords {
    /// Of all that can act in a model.
    pub fn of(spec: &ModelSpec, own: &BTreeMap<String, OwnCandidate>) -> Self {
        // A model file has been read with these candidates.
        let all = every_candidate(spec, own).unwrap_or_default();
        let words = |candidate: &Candidate| Words {
            place: place(spec, candidate.port),
            sites: match own.get(&candidate.id) {
                Some(own) => own
                    .terms
                    .keys()
                    .map(|key| site_of_term(spec, key))
                    .collect(),
                None => sites(spec, candidate.port),
            },
            physics: candidate
                .effect
                .map_or("A term of the model file", |effect| effect.physics),
        };
        Self(all.iter().map(|c| (c.id.clone(), words(c))).collect())
    }

    /// An effect with where it acts: `lag(y) at the output y (block)`.
    pub fn placed(&self, id: &str) -> String {
        match self.0.get(id) {
            Some(words) if !words.place.is_empty() => format!("{id} {}", words.place),
            _ => id.to_string(),
        }
    }

    /// The ports that it sits at.
    pub fn sites(&self, id: &str) -> &[Site] {
        self.0.get(id).map_or(&[], |words| &words.sites)
    }

    /// What it does, in a sentence without its end.
    pub fn physics(&self, id: &str) -> &'static str {
        let words = self.0.get(id).map_or("", |words| words.physics);
        words.trim_end_matches('.')
    }
}

fn sites(spec: &ModelSpec, port: Port) -> Vec<Site> {
    let of = |variable: Variable| spec.about(variable).name.clone();
    let input = |u: usize| Site::Input(of(Variable::Input(u)));
    let equation = |x: usize| Site::Equation(of(Variable::State(x)));
    let output = |y: usize| Site::Output(of(spec.outputs[y].variable));
    match port {
        Port::Input(u) => vec![input(u)],
        Port::Output(y) | Port::OutputAnd(y, _) => vec![output(y)],
        Port::Balance(x) | Port::BalanceAnd(x, _) => vec![equation(x)],
        Port::Value(v) | Port::Dependence(v, _) => vec![Site::Value(of(v))],
        Port::Between(a, b) => vec![equation(a), equation(b)],
        Port::InputAndBalance(u, x) => vec![input(u), equation(x)],
        Port::Own => Vec::new(),
    }
}

/// A unit as it is shown: nothing behind a number without dimension.
pub(crate) fn shown_unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// What a term of the model file is added to.
fn site_of_term(spec: &ModelSpec, name: &str) -> Site {
    match spec.find(name) {
        Some(Variable::State(_)) => Site::Equation(name.to_string()),
        Some(variable) if spec.outputs.iter().any(|o| o.variable == variable) => {
            Site::Output(name.to_string())
        }
        _ => Site::Value(name.to_string()),
    }
}

/// A variable with what its text says of it.
fn named(about: &About) -> String {
    match about.description.as_str() {
        "" => about.name.clone(),
        description => format!("{} ({})", about.name, escaped(description)),
    }
}

/// Where a port is.
fn place(spec: &ModelSpec, port: Port) -> String {
    let of = |variable: Variable| named(spec.about(variable));
    let state = |i: usize| of(Variable::State(i));
    // The text says more of what is measured than of the reading that is equal to it.
    let output = |i: usize| {
        let about = spec.about(spec.outputs[i].variable);
        let measured = match spec.outputs[i].variable {
            Variable::Flow(f) => match &spec.flows[f].value {
                ct_model::Expression::Variable(variable) => Some(spec.about(*variable)),
                _ => None,
            },
            _ => None,
        };
        match (about.description.is_empty(), measured) {
            (true, Some(measured)) => format!("{}, which reads {}", about.name, named(measured)),
            _ => named(about),
        }
    };
    let value = |variable: Variable| match variable {
        Variable::Parameter(_) => format!("the parameter {}", of(variable)),
        _ => format!("the flow {}", of(variable)),
    };
    match port {
        Port::Input(i) => format!("at the input {}", of(Variable::Input(i))),
        Port::Output(i) => format!("at the output {}", output(i)),
        Port::Balance(i) => format!("in the equation of {}", state(i)),
        Port::Value(v) => format!("at {}", value(v)),
        Port::Dependence(v, x) => format!("at {}, with {}", value(v), of(x)),
        Port::Between(a, b) => format!("between {} and {}", state(a), state(b)),
        Port::InputAndBalance(u, x) => {
            format!(
                "from the input {} into the equation of {}",
                of(Variable::Input(u)),
                state(x)
            )
        }
        Port::BalanceAnd(x, a) => format!("in the equation of {}, with {}", state(x), of(a)),
        Port::OutputAnd(y, a) => format!("at the output {}, with {}", output(y), of(a)),
        Port::Own => String::new(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn ports_are_named_with_what_the_text_says_of_them() {
        let spec = ModelSpec::parse(include_str!("../../../../examples/models/heated-block.mo"));
        let words = EffectWords::of(&spec.unwrap(), &BTreeMap::new());
        let said = [
            ("lag(u)", "lag(u) at the input u (power of the heater)"),
            ("lag(y)", "lag(y) at the output y, which reads T (block)"),
            ("step(T)", "step(T) in the equation of T (block)"),
            ("drift(k)", "drift(k) at the parameter k (loss to the room)"),
            (
                "varies_with(k,T)",
                "varies_with(k,T) at the parameter k (loss to the room), with T (block)",
            ),
            (
                "radiation(T,Ta)",
                "radiation(T,Ta) in the equation of T (block), with Ta (room)",
            ),
        ];
        for (id, placed) in said {
            assert_eq!(words.placed(id), placed);
            assert!(words.physics(id).len() > 10, "{id}");
        }
    }
}
