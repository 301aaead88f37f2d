//! A model file and its records as a search problem, and the model with the effects of its file inserted.

use std::collections::{BTreeMap, BTreeSet};

use ct_model::Model;
use ct_model::effects::{Candidate, Role, Visited, apply};
use effect_search::{Believed, Options, Problem, all_candidates, believed, with_effects};

use super::blame::blame;
use super::effects::RecordNumbers;
use super::file::{OwnModelFile, Records};
use super::time_unit::unit_of;
use crate::effort::EffortLevel;
use crate::{Error, interrupt, numbers};

/// Options of a search that Ctrl-C ends.
pub(crate) fn options(seed: u64, effort: EffortLevel) -> Options<'static> {
    Options {
        seed,
        time_limit: Some(effort.limit()),
        interrupt: Some(interrupt::flag()),
        ..Options::default()
    }
}

/// The problem for a search.
///
/// # Errors
/// As [`OwnModelFile::loop_controllers`].
pub(super) fn problem(file: &OwnModelFile, records: &Records) -> Result<Problem, Error> {
    Ok(Problem {
        spec: file.base.clone(),
        effects: file.effects.on.clone(),
        kept: file.effects.kept.clone(),
        records: records.records.clone(),
        test: records.test.clone(),
        gaps: records.gaps,
        known: file.known.clone(),
        priors: file.priors.clone(),
        candidates: file.candidates.clone(),
        left_out: BTreeSet::new(),
        controllers: file.loop_controllers(records)?,
        time_unit: records.time_unit,
        time_unit_name: unit_of(records.time_unit).to_string(),
    })
}

impl OwnModelFile {
    /// The model with its effects in it. With records the effects are fitted to them one after the other, and parameters begin there; what
    /// the file does not keep of an earlier record is taken from these. Without any the file has to say all of it.
    ///
    /// # Errors
    /// Where the records do not allow a fit, or without any where the file lacks a number.
    pub fn mended(&self, records: Option<&Records>) -> Result<Self, Error> {
        self.mended_within(records, &Options::default())
    }

    /// Inserts and fits the effects within a time limit, or until an interruption.
    ///
    /// # Errors
    /// As [`OwnModelFile::mended`].
    pub fn mended_within(
        &self,
        records: Option<&Records>,
        options: &Options,
    ) -> Result<Self, Error> {
        if self.effects.on.is_empty() {
            return Ok(self.clone());
        }
        let Believed {
            spec,
            record_numbers,
        } = match records {
            None => self.as_it_stands()?,
            Some(records) => {
                let problem = problem(self, records)?;
                believed(&problem, options).map_err(|e| blame(&problem.records, e))?
            }
        };
        Ok(Self {
            model: Model::new(spec),
            record_numbers,
            ..self.clone()
        })
    }

    /// The model with its effects and their values in the file.
    fn as_it_stands(&self) -> Result<Believed, Error> {
        let refuse = |what: String| Error::File {
            file: self.name.clone(),
            what,
        };
        let all = self.every_kept_candidate()?;
        let on = self.listed(&all)?;
        let mut record_numbers = RecordNumbers::new();
        let mut values = BTreeMap::new();
        for candidate in &on {
            let id = &candidate.id;
            let kept = self.effects.kept.get(id);
            let numbers = candidate.record_numbers.keys();
            let lacks = numbers.filter(|n| !kept.is_some_and(|k| k.numbers.contains_key(**n)));
            let lacks: Vec<&str> = lacks.copied().collect();
            if !lacks.is_empty() {
                return Err(refuse(format!(
                    "{id} is written in numbers of a record ({}): fit the model to records, or keep those of a diagnosis with `ctid add '{id}' --from RESULT.json`",
                    lacks.join(", ")
                )));
            }
            record_numbers.insert(id.clone(), candidate.numbers_of_record());
            for parameter in &candidate.parameters {
                let kept = kept.and_then(|kept| kept.start.get(&parameter.short).copied());
                let own = candidate.effect.is_none().then(|| own_start(parameter));
                // A choice that is not stated is that of the effect's text.
                let own = own.or((parameter.role == Role::Choice).then_some(parameter.absent));
                let value = kept.or(self.known.get(&parameter.name).copied()).or(own);
                let value = value.ok_or_else(|| {
                    refuse(format!(
                        "{id} has no value for {0}: fit the model to records, or write {0} = ... under [effect.\"{id}\"]",
                        parameter.short
                    ))
                })?;
                values.insert(parameter.name.clone(), value);
            }
        }
        let spec = with_effects(&self.base, &on, &values);
        let spec = spec.map_err(|error| refuse(error.to_string()))?;
        Ok(Believed {
            spec,
            record_numbers,
        })
    }

    /// All effects that can act in the model without records: with the values that the file keeps.
    fn every_kept_candidate(&self) -> Result<Vec<Candidate>, Error> {
        let visited = Visited {
            time_unit: unit_of(self.declared_time_unit().unwrap_or(1.0)).to_string(),
            ..Visited::nominal(&self.base)
        };
        let (kept, own) = (&self.effects.kept, &self.candidates);
        all_candidates(&self.base, &visited, kept, own)
            .map_err(|error| Error::Columns(error.to_string()))
    }

    /// The candidates that the file lists as its effects, in its order.
    fn listed<'c>(&self, all: &'c [Candidate]) -> Result<Vec<&'c Candidate>, Error> {
        let find = |id: &String| {
            let found = all.iter().find(|candidate| candidate.id == *id);
            found.ok_or_else(|| Error::File {
                file: self.name.clone(),
                what: format!("{id} cannot act in this model"),
            })
        };
        self.effects.on.iter().map(find).collect()
    }

    /// For each candidate of the file that is not among its effects: the candidate, and the model with its effects and that candidate. A
    /// candidate that repeats another one is left out if that one is not in the model: alone the two are equal.
    ///
    /// # Errors
    /// Where a candidate cannot act beside the effects.
    pub fn with_each_candidate(&self) -> Result<Vec<(Candidate, Model)>, Error> {
        let all = self.every_kept_candidate()?;
        let on = self.listed(&all)?;
        let is_on = |id: &String| self.effects.on.contains(id);
        let own = all.iter().filter(|candidate| {
            candidate.effect.is_none()
                && !is_on(&candidate.id)
                && candidate.repeats.as_ref().is_none_or(is_on)
        });
        own.map(|candidate| {
            let together: Vec<&Candidate> = on.iter().copied().chain([candidate]).collect();
            let spec = apply(&self.base, &together).map_err(|error| Error::File {
                file: self.name.clone(),
                what: error.to_string(),
            })?;
            Ok((candidate.clone(), Model::new(spec)))
        })
        .collect()
    }

    /// Notes on effects whose record numbers come from the present records because the file has none: one sentence each. `used`: the record
    /// numbers of a result.
    pub fn not_kept(&self, used: &RecordNumbers) -> Vec<String> {
        let on = self.effects.on.iter();
        let lacking = on.filter_map(|id| {
            let kept = self.effects.kept.get(id);
            let numbers = used.get(id)?.iter();
            let lacks = numbers.filter(|(n, _)| !kept.is_some_and(|k| k.numbers.contains_key(*n)));
            let lacks =
                lacks.map(|(name, value)| format!("{name} = {}", numbers::significant(*value, 4)));
            let lacks: Vec<String> = lacks.collect();
            (!lacks.is_empty()).then_some((id, lacks))
        });
        lacking
            .map(|(id, lacks)| {
                format!(
                    "{id} is written in numbers of these records ({}): `ctid add '{id}' --from RESULT.json` keeps them, so that it means the same beside others",
                    lacks.join(", ")
                )
            })
            .collect()
    }
}

/// Start value of a parameter of a candidate in the model file.
fn own_start(parameter: &ct_model::effects::EffectParameter) -> f64 {
    let first = parameter.starts.first().copied();
    match parameter.role {
        Role::Shape | Role::Begin => parameter.absent,
        _ => first.unwrap_or(parameter.absent),
    }
}
