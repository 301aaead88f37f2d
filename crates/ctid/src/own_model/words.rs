//! Descriptions of effects at the ports of a model: place and action.

use std::collections::BTreeMap;

use ct_model::effects::{Candidate, OwnCandidate, Port};
use ct_model::{About, ModelSpec, Variable};
use ct_signals::escaped;

use super::effects::every_candidate;
use super::file::OwnModelFile;

/// Descriptions of the effects of a model.
pub(crate) struct EffectWords(BTreeMap<String, Words>);

/// A port with effects, by the name of its variable.
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
    /// Kind of the effect.
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
    physics: String,
}

impl EffectWords {
    /// Descriptions of all effects that can act in a model.
    pub fn of(file: &OwnModelFile) -> Self {
        Self::among(&file.base, &file.candidates, &file.effects.functions)
    }

    /// As [`EffectWords::of`], for a model with candidates of the user's own and the terms of `functions`.
    pub fn among(
        spec: &ModelSpec,
        own: &BTreeMap<String, OwnCandidate>,
        functions: &BTreeMap<String, String>,
    ) -> Self {
        // The candidates were checked when the model file was read.
        let all = every_candidate(spec, own, functions).unwrap_or_default();
        let words = |candidate: &Candidate| match own.get(&candidate.id) {
            Some(own) => of_own(spec, own),
            None => Words {
                place: place(spec, candidate.port),
                sites: sites(spec, candidate.port),
                physics: candidate
                    .described(spec)
                    .map_or(String::new(), |text| text.physics.to_string()),
            },
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

    /// Where an effect acts: `at the output y (block)`.
    pub fn place(&self, id: &str) -> &str {
        self.0.get(id).map_or("", |words| &words.place)
    }

    /// The ports of the effect.
    pub fn sites(&self, id: &str) -> &[Site] {
        self.0.get(id).map_or(&[], |words| &words.sites)
    }

    /// The physics of an effect, in a sentence without its final point.
    pub fn physics(&self, id: &str) -> &str {
        let words = self.0.get(id).map_or("", |words| &words.physics);
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

/// A unit for display: empty for a dimensionless number.
pub(crate) fn shown_unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// A candidate of the model file, by the targets of its terms.
fn of_own(spec: &ModelSpec, own: &OwnCandidate) -> Words {
    let ports = own.terms.keys().filter_map(|key| port_of_term(spec, key));
    let ports: Vec<Port> = ports.collect();
    let places: Vec<String> = ports.iter().map(|port| place(spec, *port)).collect();
    let terms = own.terms.iter();
    let terms: Vec<String> = terms
        .map(|(key, term)| format!("{} to {key}", escaped(term)))
        .collect();
    Words {
        place: places.join(" and "),
        sites: ports.iter().flat_map(|port| sites(spec, *port)).collect(),
        physics: format!(
            "A candidate of the model file, which adds {}",
            terms.join(" and ")
        ),
    }
}

/// Port to which a term of the model file is added.
fn port_of_term(spec: &ModelSpec, name: &str) -> Option<Port> {
    match spec.find(name)? {
        Variable::State(i) => Some(Port::Balance(i)),
        variable => {
            let mut outputs = spec.outputs.iter();
            let output = outputs.position(|output| output.variable == variable);
            Some(output.map_or(Port::Value(variable), Port::Output))
        }
    }
}

/// A variable with the description from the model text.
fn named(about: &About) -> String {
    match about.description.as_str() {
        "" => about.name.clone(),
        description => format!("{} ({})", about.name, escaped(description)),
    }
}

/// Description of a port.
fn place(spec: &ModelSpec, port: Port) -> String {
    let of = |variable: Variable| named(spec.about(variable));
    let state = |i: usize| of(Variable::State(i));
    // The measured variable is better described in the text than an equal reading.
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
        let spec = ModelSpec::parse(include_str!("../../models/heated-block.mo"));
        let words = EffectWords::among(&spec.unwrap(), &BTreeMap::new(), &BTreeMap::new());
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

    #[test]
    fn a_candidate_of_the_model_file_is_where_its_terms_are() {
        let spec = ModelSpec::parse(include_str!("../../models/heated-block.mo"));
        let parameter = ct_model::effects::OwnParameter {
            unit: String::new(),
            min: None,
            max: None,
            start: 1.0,
        };
        let term = |key: &str, term: &str| (key.to_string(), term.to_string());
        let own = OwnCandidate {
            parameters: BTreeMap::from([("q".to_string(), parameter)]),
            terms: BTreeMap::from([term("T", "-q*T"), term("loss", "q*u"), term("y", "q")]),
            ..OwnCandidate::default()
        };
        let all = BTreeMap::from([("vent".to_string(), own)]);
        let words = EffectWords::among(&spec.unwrap(), &all, &BTreeMap::new());
        assert_eq!(
            words.placed("vent"),
            "vent in the equation of T (block) and at the flow loss and at the output y, which reads T (block)"
        );
        assert_eq!(
            words.physics("vent"),
            "A candidate of the model file, which adds -q*T to T and q*u to loss and q to y"
        );
        let site = |name: &str| name.to_string();
        assert_eq!(
            words.sites("vent"),
            [
                Site::Equation(site("T")),
                Site::Value(site("loss")),
                Site::Output(site("y"))
            ]
        );
    }
}
