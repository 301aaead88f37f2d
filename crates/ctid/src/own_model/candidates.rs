//! `[candidates.NAME]`: effects of the user's own, read from the model file.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{OwnCandidate, OwnParameter, OwnState, own_candidates};
use serde::Deserialize;
use toml::Spanned;

use crate::Error;
use crate::model_file::Source;

/// All candidates of a model file, by name.
pub(super) type RawCandidates = BTreeMap<Spanned<String>, RawCandidate>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCandidate {
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, RawParameter>,
    #[serde(default)]
    states: BTreeMap<Spanned<String>, RawState>,
    #[serde(default)]
    terms: BTreeMap<String, Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawParameter {
    #[serde(default)]
    unit: String,
    min: Option<f64>,
    max: Option<f64>,
    start: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawState {
    #[serde(default)]
    unit: String,
    #[serde(default)]
    start: f64,
    #[serde(default)]
    fixed: bool,
    equation: Spanned<String>,
}

impl RawCandidate {
    fn plain(&self) -> OwnCandidate {
        let parameter = |(name, raw): (&Spanned<String>, &RawParameter)| {
            let parameter = OwnParameter {
                unit: raw.unit.clone(),
                min: raw.min,
                max: raw.max,
                start: raw.start,
            };
            (name.as_ref().clone(), parameter)
        };
        let state = |(name, raw): (&Spanned<String>, &RawState)| {
            let state = OwnState {
                unit: raw.unit.clone(),
                start: raw.start,
                fixed: raw.fixed,
                equation: raw.equation.as_ref().clone(),
            };
            (name.as_ref().clone(), state)
        };
        let term = |(name, raw): (&String, &Spanned<String>)| (name.clone(), raw.as_ref().clone());
        OwnCandidate {
            parameters: self.parameters.iter().map(parameter).collect(),
            states: self.states.iter().map(state).collect(),
            terms: self.terms.iter().map(term).collect(),
        }
    }

    /// Position of these keys in the model file.
    fn place(&self, keys: &[String]) -> Option<usize> {
        let key = keys.get(1)?;
        match keys.first()?.as_str() {
            "terms" => Some(self.terms.get(key)?.span().start),
            "parameters" => {
                let mut names = self.parameters.keys();
                Some(names.find(|name| name.as_ref() == key)?.span().start)
            }
            "states" => {
                let mut states = self.states.iter();
                let (name, state) = states.find(|(name, _)| name.as_ref() == key)?;
                let of_equation = keys.len() > 2 && keys[2] == "equation";
                Some(if of_equation {
                    state.equation.span().start
                } else {
                    name.span().start
                })
            }
            _ => None,
        }
    }
}

/// The candidates as plain data; each is valid for the model.
///
/// # Errors
/// One line that names the file, the line, the place in the expression, what is wrong and the correction.
pub(super) fn read(
    spec: &ModelSpec,
    raw: &RawCandidates,
    source: &Source,
) -> Result<BTreeMap<String, OwnCandidate>, Error> {
    let plain = raw
        .iter()
        .map(|(name, raw)| (name.as_ref().clone(), raw.plain()));
    let plain: BTreeMap<String, OwnCandidate> = plain.collect();
    own_candidates(spec, &plain).map_err(|error| {
        let mut names = raw.iter();
        let own = names.find(|(name, _)| Some(name.as_ref()) == error.place.first());
        let at = own.map_or(0, |(name, raw)| {
            raw.place(&error.place[1..]).unwrap_or(name.span().start)
        });
        source.at(at, format!("candidates.{error}"))
    })?;
    Ok(plain)
}
