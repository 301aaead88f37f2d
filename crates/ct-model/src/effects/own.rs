//! Candidates of the model file: terms of the user's own, offered to the search like the catalogue's effects.

mod sizes;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use self::sizes::sizes;
use super::candidate::{Candidate, EffectParameter};
use super::effect::Role;
use super::fragment::{Action, Counts, Fragment, Target};
use super::port::Port;
use crate::expression::{Expression, Variable};
use crate::spec::{About, Given, ModelSpec, Parameter, State};
use crate::text::{Scope, TextError, is_reserved};

/// Parameters of an effect that is absent only in a limit also start at values smaller and larger by this factor: a time constant that is a
/// product or a quotient of two parameters is then scored over four decades.
const DECADE: f64 = 10.0;

/// A candidate as written in the model file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OwnCandidate {
    /// Parameters of the candidate, by name.
    pub parameters: BTreeMap<String, OwnParameter>,
    /// Additional states, by name.
    pub states: BTreeMap<String, OwnState>,
    /// Terms to add: to the right-hand side of a state equation, to a named flow, or to an output. The key is the name of the state, flow
    /// or output.
    pub terms: BTreeMap<String, String>,
}

/// A parameter of a candidate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OwnParameter {
    /// Unit of the parameter; empty if none is given.
    pub unit: String,
    /// Lower bound.
    pub min: Option<f64>,
    /// Upper bound.
    pub max: Option<f64>,
    /// Start value of a fit.
    pub start: f64,
}

/// A state of a candidate.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OwnState {
    /// Unit of the state; empty if none is given.
    pub unit: String,
    /// Start value of the initial state.
    pub start: f64,
    /// The initial value is known, and not fitted.
    pub fixed: bool,
    /// `c*der(x) = e`.
    pub equation: String,
}

/// Error of a candidate of the model file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {what}", place.join("."))]
pub struct OwnError {
    /// The keys below `candidates`: the candidate's name, `terms`, `T`.
    pub place: Vec<String>,
    /// The error and the correction; for an expression, with line and column inside it.
    pub what: String,
}

/// Reads candidates of the model file in the scope of a model, and rejects two equal ones. A candidate with a state may be repeated under
/// another name: two RC pairs are more than one ([`Candidate::repeats`]).
///
/// # Errors
/// The place in the model file and in the expression, what is wrong and the correction.
pub fn own_candidates(
    spec: &ModelSpec,
    all: &BTreeMap<String, OwnCandidate>,
) -> Result<Vec<Candidate>, OwnError> {
    let mut read: Vec<Candidate> = Vec::new();
    for (name, own) in all {
        let mut candidate = own_candidate(spec, name, own)?;
        let same = |other: &&Candidate| {
            let (a, b) = (&other.fragment, &candidate.fragment);
            let rights = |fragment: &Fragment| -> Vec<(Option<Expression>, Expression)> {
                let states = fragment.states.iter();
                states
                    .map(|state| (state.coefficient.clone(), state.right.clone()))
                    .collect()
            };
            a.action == b.action && rights(a) == rights(b)
        };
        if let Some(other) = read.iter().rfind(same) {
            if candidate.fragment.states.is_empty() {
                return Err(OwnError {
                    place: vec![name.clone()],
                    what: format!("it is the same as {}: keep one of them", other.id),
                });
            }
            candidate.repeats = Some(other.id.clone());
        }
        read.push(candidate);
    }
    Ok(read)
}

/// Reads a candidate of the model file in the scope of a model.
///
/// # Errors
/// The place in the model file and in the expression, what is wrong and the correction.
pub fn own_candidate(
    spec: &ModelSpec,
    name: &str,
    own: &OwnCandidate,
) -> Result<Candidate, OwnError> {
    let error = |keys: &[&str], what: String| OwnError {
        place: std::iter::once(name)
            .chain(keys.iter().copied())
            .map(String::from)
            .collect(),
        what,
    };
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || !name.chars().all(fits) {
        let what = "a candidate's name has letters, digits, `_` and `-` alone, as `radiation`";
        return Err(error(&[], what.to_string()));
    }
    let free = |kind: &str, key: &str| {
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !key.starts_with(|c: char| c.is_ascii_alphabetic()) || !key.chars().all(letters) {
            let what = "a name begins with a letter and has letters, digits and `_` alone";
            return Err(error(&[kind, key], what.to_string()));
        }
        if spec.find(key).is_some() {
            let what = format!(
                "`{key}` is a variable of {}: choose another name",
                spec.name
            );
            return Err(error(&[kind, key], what));
        }
        if is_reserved(key) {
            let what = format!("`{key}` is a reserved word: choose another name");
            return Err(error(&[kind, key], what));
        }
        Ok(())
    };
    let counts = Counts::of(spec);
    let mut scope = spec.clone();
    for (key, parameter) in &own.parameters {
        free("parameters", key)?;
        let about = about(key, &parameter.unit, parameter.min, parameter.max);
        let start = parameter.start;
        if !start.is_finite() || about.min.is_nan() || about.max.is_nan() {
            let what = "start, min and max are numbers: write finite ones";
            return Err(error(&["parameters", key], what.to_string()));
        }
        if start < about.min || start > about.max {
            let what = format!(
                "start = {start} is outside min = {} and max = {}: correct one of them",
                about.min, about.max
            );
            return Err(error(&["parameters", key], what));
        }
        scope.parameters.push(Parameter {
            about,
            value: start,
            definition: None,
            given: Given::Fitted,
        });
    }
    for (key, state) in &own.states {
        free("states", key)?;
        if own.parameters.contains_key(key) {
            let what = format!("`{key}` is a parameter of the candidate too: choose another name");
            return Err(error(&["states", key], what));
        }
        if !state.start.is_finite() {
            let what = "start is a number: write a finite one";
            return Err(error(&["states", key, "start"], what.to_string()));
        }
        scope.states.push(State {
            about: about(key, &state.unit, None, None),
            coefficient: None,
            right: Expression::Number(0.0),
            start: Expression::number(state.start),
            fixed: state.fixed,
        });
    }
    let said = |keys: &[&str], source: TextError| error(keys, source.to_string());
    let words = Scope::new(&scope);
    let mut states = scope.states[counts.states..].to_vec();
    for (state, (key, given)) in states.iter_mut().zip(&own.states) {
        let equation = words.equation(&given.equation, key);
        (state.coefficient, state.right) =
            equation.map_err(|source| said(&["states", key, "equation"], source))?;
    }
    let mut terms = Vec::new();
    for (key, text) in &own.terms {
        let target = target(spec, key).map_err(|what| error(&["terms", key], what))?;
        let term = words.expression(text);
        terms.push((
            target,
            term.map_err(|source| said(&["terms", key], source))?,
        ));
    }
    if terms.is_empty() {
        let what = "it has no terms: write what it adds to which equation, terms = { T = \"...\" }";
        return Err(error(&[], what.to_string()));
    }
    let mut used = vec![false; scope.parameters.len()];
    for part in parts(&states, &terms) {
        part.each_variable(&mut |variable| {
            if let Variable::Parameter(i) = variable {
                used[i] = true;
            }
        });
    }
    let own_used = used[counts.parameters..].iter();
    if let Some((key, _)) = own
        .parameters
        .keys()
        .zip(own_used)
        .find(|(_, used)| !**used)
    {
        let what = "it is used nowhere: delete it, or write it into a term or an equation";
        return Err(error(&["parameters", key], what.to_string()));
    }
    if own.parameters.is_empty() {
        let what =
            "it has no parameter: give it one that makes its terms vanish at zero, as a factor";
        return Err(error(&[], what.to_string()));
    }
    // If no such values exist, every parameter is a shape: the effect is absent only in a limit ([`Candidate::with_factor`]).
    let sizes = sizes(&scope, counts, &states, &terms);
    let in_limit = sizes.is_none();
    let sizes = sizes.unwrap_or_else(|| vec![false; own.parameters.len()]);
    if let Some(i) = (0..sizes.len()).find(|&i| {
        let about = &scope.parameters[counts.parameters + i].about;
        sizes[i] && (about.min > 0.0 || about.max < 0.0)
    }) {
        let key = &scope.parameters[counts.parameters + i].about.name;
        let what =
            "its bounds exclude zero, but the value zero has to switch the effect off: widen them";
        return Err(error(&["parameters", key], what.to_string()));
    }
    let parts: Vec<&Expression> = parts(&states, &terms).collect();
    let mut parameters = scope.parameters[counts.parameters..].to_vec();
    let effect = parameters
        .iter_mut()
        .enumerate()
        .zip(sizes)
        .map(|((i, parameter), is_size)| {
            let start = parameter.value;
            // Where the parameter decides between branches, its derivative at zero says little of other values.
            let own = Variable::Parameter(counts.parameters + i);
            let role = match is_size {
                false => Role::Shape,
                true if parts.iter().any(|part| part.branches_by(own)) => Role::Threshold,
                true => Role::Size,
            };
            let about = &parameter.about;
            if is_size {
                parameter.value = 0.0;
            }
            let starts = if in_limit {
                vec![start, start / DECADE, start * DECADE]
            } else if role == Role::Threshold && about.min < 0.0 {
                [start, start / 4.0, start * 4.0]
                    .into_iter()
                    .flat_map(|start| [start, -start])
                    .collect()
            } else if role != Role::Size {
                vec![start, start / 4.0, start * 4.0]
            } else if about.min < 0.0 {
                vec![start, -start]
            } else {
                vec![start]
            };
            EffectParameter {
                name: String::new(),
                short: about.name.clone(),
                unit: about.unit.clone(),
                description: String::new(),
                role,
                absent: parameter.value,
                bounds: (about.min, about.max),
                starts: starts
                    .into_iter()
                    .filter(|start| (about.min..=about.max).contains(start))
                    .collect(),
            }
        });
    let mut candidate = Candidate {
        id: name.to_string(),
        port: Port::Own,
        effect: None,
        parameters: effect.collect(),
        record_numbers: BTreeMap::new(),
        repeats: None,
        fragment: Fragment {
            parameters,
            states,
            flows: Vec::new(),
            action: Action::Add(terms),
        },
        stem: String::new(),
    };
    candidate.name_variables(spec);
    Ok(candidate)
}

/// All expressions of a candidate.
fn parts<'a>(
    states: &'a [State],
    terms: &'a [(Target, Expression)],
) -> impl Iterator<Item = &'a Expression> {
    let of_states = states.iter();
    let of_states = of_states.flat_map(|state| state.coefficient.iter().chain([&state.right]));
    of_states.chain(terms.iter().map(|(_, term)| term))
}

fn about(name: &str, unit: &str, min: Option<f64>, max: Option<f64>) -> About {
    About {
        name: name.to_string(),
        unit: unit.to_string(),
        description: String::new(),
        quantity: String::new(),
        min: min.unwrap_or(f64::NEG_INFINITY),
        max: max.unwrap_or(f64::INFINITY),
    }
}

/// The variable that a term is added to.
fn target(spec: &ModelSpec, name: &str) -> Result<Target, String> {
    let output = spec.about_outputs().position(|y| y.name == name);
    match (spec.find(name), output) {
        (Some(Variable::State(i)), _) => Ok(Target::State(i)),
        (Some(Variable::Flow(_)), Some(y)) => Ok(Target::Output(y)),
        (Some(Variable::Flow(i)), None) if !spec.flows[i].of_parameters => Ok(Target::Flow(i)),
        _ => {
            let states = (0..spec.states.len()).map(Variable::State);
            let flows = (0..spec.flows.len()).filter(|&i| !spec.flows[i].of_parameters);
            let all = states.chain(flows.map(Variable::Flow));
            let names: Vec<&str> = all.map(|v| spec.about(v).name.as_str()).collect();
            Err(format!(
                "`{name}` is not a state, named flow or output of {}: a term is added to one of {}",
                spec.name,
                names.join(", ")
            ))
        }
    }
}
