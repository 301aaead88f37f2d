//! What a model file keeps of a result: values of an effect, or the missing term under a name of the user's choice.

use ct_model::effects::{Candidate, all_effects, check_term_name};
use effect_search::Kept;

use super::own::Findings;
use crate::Error;
use crate::own_model::OwnModelFile;
use crate::own_model::effects::{every_candidate, find};
use crate::own_model::raw_effects::plain;
use crate::own_model::term::function;
use crate::report::rounded;

impl Findings {
    /// The effect that a name means, and the values of the result for it: start values of its parameters, and the numbers of its records. A
    /// name that no effect has becomes that of the missing term of the result.
    ///
    /// # Errors
    /// If the result is of another model or contains no information about the effect, or the name cannot be that of a term.
    pub fn kept(&self, model: &OwnModelFile, name: &str) -> Result<(Candidate, Kept), Error> {
        let refuse = |what: String| Error::File {
            file: model.name.clone(),
            what,
        };
        let (spec, functions) = (&model.base, &model.effects.functions);
        if self.model != spec.name {
            return Err(refuse(format!(
                "the result is for model {}, but this file has {}: give a result of this model",
                self.model, spec.name
            )));
        }
        let all = every_candidate(spec, &model.candidates, functions)?;
        let id = plain(name);
        let is_free = is_free(&all, &id);
        let missing = self.unknown.as_ref().and_then(|step| step.effect.as_ref());
        if let (true, Some(missing)) = (is_free, missing) {
            let shape = function(spec, &all, missing).map_err(Error::UnknownEffect)?;
            check_term_name(spec, &all, shape, &id)
                .map_err(|what| refuse(format!("{id}: {what}")))?;
            let kept = self.values(shape).map_err(refuse)?;
            return Ok((shape.clone().named(spec, &id), of_function(kept, missing)));
        }
        let candidate = find(spec, &all, name)
            .map_err(|what| Error::UnknownEffect(what + &self.missing_term(is_free)))?;
        let Some(term) = functions.get(&candidate.id) else {
            let kept = self.values(candidate).map_err(refuse)?;
            return Ok((candidate.clone(), kept));
        };
        // A term of the file: in the result as an effect, or again as its missing term.
        let kept = if self.has(&candidate.id) {
            self.values(candidate)
        } else if missing == Some(term) && !model.effects.on.contains(&candidate.id) {
            self.values(function(spec, &all, term).map_err(Error::UnknownEffect)?)
        } else {
            Err(format!(
                "the result does not contain {0}, which this file has as {term}: give another name, or delete [effect.{0}] and {0} in effects",
                candidate.id
            ))
        };
        Ok((candidate.clone(), of_function(kept.map_err(refuse)?, term)))
    }

    /// Whether the result has values for a name: those of an effect, or of its missing term, to which the name can be given.
    pub fn keeps(&self, model: &OwnModelFile, name: &str) -> bool {
        let (spec, functions) = (&model.base, &model.effects.functions);
        let all = every_candidate(spec, &model.candidates, functions);
        let id = plain(name);
        // A term of the file that is not in the model takes the values of the missing term, or is refused.
        let waits = functions.contains_key(&id) && !model.effects.on.contains(&id);
        self.has(&id)
            || self.unknown.is_some() && (waits || all.is_ok_and(|all| is_free(&all, &id)))
    }

    /// The values of an effect in the result.
    fn values(&self, candidate: &Candidate) -> Result<Kept, String> {
        let id = &candidate.id;
        let Some(numbers) = self.record_numbers.get(id) else {
            let known: Vec<&str> = self.record_numbers.keys().map(String::as_str).collect();
            return Err(format!(
                "the result does not contain {id}: it has {}; without --from the effect is fitted anew",
                known.join(", ")
            ));
        };
        let start = candidate.parameters.iter().filter_map(|parameter| {
            let size = self.value(&parameter.name)?;
            Some((parameter.short.clone(), rounded(size, 7)))
        });
        Ok(Kept {
            numbers: numbers.clone(),
            start: start.collect(),
            function: None,
        })
    }

    /// The missing term of the result, for a message.
    fn missing_term(&self, is_free: bool) -> String {
        let effect = self.unknown.as_ref().and_then(|step| step.effect.as_ref());
        match effect {
            Some(effect) => format!(
                "; the missing term of the result is {effect}: `ctid add NAME --from RESULT.json` keeps it under a name of your choice"
            ),
            None if is_free => {
                "; the result has no missing term that could have this name".to_string()
            }
            None => String::new(),
        }
    }
}

/// Whether a name may become that of a term: no effect has it, it names no port, and it is not in the catalogue, whose effects need a port.
fn is_free(all: &[Candidate], id: &str) -> bool {
    !id.contains('(')
        && !all_effects().any(|effect| effect.id == id)
        && !all.iter().any(|candidate| candidate.id == id)
}

fn of_function(kept: Kept, function: &str) -> Kept {
    Kept {
        function: Some(function.to_string()),
        ..kept
    }
}
