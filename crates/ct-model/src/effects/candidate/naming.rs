//! Names of an effect's variables in the model, and names that a user gives to the smooth functions.

use super::Candidate;
use crate::effects::fragment::Fragment;
use crate::effects::{all_effects, level_shift, shape};
use crate::spec::ModelSpec;
use crate::text::is_reserved;

/// Name of an effect's result in its text; in the model it has the name of the effect.
const RESULT: &str = "v";

impl Candidate {
    /// Gives the variables the names that they have in the model.
    pub(in crate::effects) fn name_variables(&mut self, spec: &ModelSpec) {
        let stem = identifier(&self.id);
        let free = |name: String| {
            let mut name = name;
            while spec.find(&name).is_some() || is_reserved(&name) {
                name.push('_');
            }
            name
        };
        self.rename(|name| match name {
            RESULT => free(stem.clone()),
            name => free(format!("{stem}_{name}")),
        });
        self.stem = stem;
    }

    /// The same effect under a name of the user's choice ([`check_term_name`]): its identifier, and the begin of the names of its variables.
    #[must_use]
    pub fn named(mut self, spec: &ModelSpec, name: &str) -> Self {
        let stem = std::mem::take(&mut self.stem);
        self.rename(|name| {
            let short = name.strip_prefix(&stem).unwrap_or(name);
            match short.trim_matches('_') {
                "" => RESULT.to_string(),
                short => short.to_string(),
            }
        });
        self.id = name.to_string();
        self.name_variables(spec);
        self
    }

    /// Names of all its variables in the model.
    fn variables(&self) -> impl Iterator<Item = &str> {
        let Fragment {
            parameters,
            states,
            flows,
            ..
        } = &self.fragment;
        let parameters = parameters.iter().map(|parameter| &parameter.about);
        let states = states.iter().map(|state| &state.about);
        let abouts = parameters
            .chain(states)
            .chain(flows.iter().map(|flow| &flow.about));
        abouts.map(|about| about.name.as_str())
    }

    fn rename(&mut self, named: impl Fn(&str) -> String) {
        let fragment = &mut self.fragment;
        for parameter in &mut fragment.parameters {
            parameter.about.name = named(&parameter.about.name);
        }
        // Constants of the effect follow its parameters.
        for (own, parameter) in self.parameters.iter_mut().zip(&fragment.parameters) {
            own.name.clone_from(&parameter.about.name);
        }
        let states = fragment.states.iter_mut().map(|state| &mut state.about);
        let flows = fragment.flows.iter_mut().map(|flow| &mut flow.about);
        for about in states.chain(flows) {
            about.name = named(&about.name);
        }
    }
}

/// A name of Modelica from an identifier: `varies_with(k,T)` is `varies_with_k_T`.
fn identifier(id: &str) -> String {
    let clean = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = id.trim_end_matches(')').chars().map(clean).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("own_{name}")
    }
}

/// Checks that a name can be given to a smooth function that stays in the model: it is an identifier that neither the model nor one of
/// `all`, its candidates and other terms, uses, for itself or for a variable.
///
/// # Errors
/// What is wrong and the correction.
pub fn check_term_name(
    spec: &ModelSpec,
    all: &[Candidate],
    function: &Candidate,
    name: &str,
) -> Result<(), String> {
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(letters) {
        let what = "a term's name begins with a letter and has letters, digits and `_` alone, as `heat_loss`";
        return Err(what.to_string());
    }
    if is_reserved(name) {
        return Err(format!(
            "`{name}` is a reserved word: choose another name for the term"
        ));
    }
    if spec.find(name).is_some() {
        return Err(format!(
            "`{name}` is a variable of {}: choose another name for the term",
            spec.name
        ));
    }
    let mut effects = all_effects()
        .chain(&shape::EFFECTS)
        .chain([&level_shift::EFFECT]);
    if effects.any(|effect| effect.id == name) {
        return Err(format!(
            "`{name}` is an effect of the catalogue: choose another name for the term"
        ));
    }
    let named = function.clone().named(spec, name);
    let others = all.iter().filter(|other| other.id != name);
    let mut pairs = others.flat_map(|other| other.variables().map(move |taken| (other, taken)));
    match pairs.find(|(_, taken)| named.variables().any(|own| own == *taken)) {
        Some((other, taken)) => Err(format!(
            "a variable of {} is called `{taken}`: choose another name for the term",
            other.id
        )),
        None => Ok(()),
    }
}
