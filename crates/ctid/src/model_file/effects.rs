//! Effects, and terms of the user's own.

use std::collections::BTreeMap;

use ct_signals::quoted;
use plants::{EffectInfo, Fitted, Known, Place, Placed, Plant, Scales, Structure, Term};
use toml::Spanned;

use super::{
    OwnTerm,
    raw::{EffectTable, Entry, Number, RawTerm},
    source::Source,
};
use crate::{Error, MessageNames, names, term_file};

/// Content of an `[effect.X]` table.
#[derive(Default)]
pub(super) struct Setting {
    pub(super) vessel: Option<usize>,
    /// Value and place in the file, by parameter.
    pub(super) values: BTreeMap<String, (f64, usize)>,
    pub(super) fixed: Vec<String>,
    /// Place of the list in the file.
    pub(super) fixed_at: usize,
}

impl Source<'_> {
    /// The `[effect.X]` tables; a table of an effect that is not in the model is checked too, and kept for later use.
    pub(super) fn effect_tables(
        &self,
        (plant, known): (Plant, &Known),
        tables: &BTreeMap<Spanned<String>, Spanned<EffectTable>>,
    ) -> Result<BTreeMap<&'static str, Setting>, Error> {
        let mut settings = BTreeMap::new();
        for (name, table) in tables {
            let effect = self.effect(name)?;
            let mut setting = Setting::default();
            for (key, entry) in table.as_ref() {
                let at = entry.span().start;
                match (key.as_ref().as_str(), entry.as_ref()) {
                    ("where", Entry::Word(word)) => {
                        setting.vessel = Some(
                            vessel(plant, known, effect, word).map_err(|what| self.at(at, what))?,
                        );
                    }
                    ("where", _) => {
                        return Err(self.at(at, "where is a word, such as \"upper\" or \"T1\""));
                    }
                    ("fixed", Entry::Words(words)) => {
                        setting.fixed.clone_from(words);
                        setting.fixed_at = at;
                    }
                    ("fixed", _) => {
                        return Err(self.at(at, "fixed is a list of parameters, such as [\"rim\"]"));
                    }
                    (key, Entry::Number(value)) if value.is_finite() => {
                        setting.values.insert(key.to_string(), (*value, at));
                    }
                    (key, _) => {
                        return Err(self.at(
                            at,
                            format!("{} has to be a finite number, without quotes", quoted(key)),
                        ));
                    }
                }
            }
            self.check_parameters((plant, known), effect, &setting)?;
            settings.insert(effect.id, setting);
        }
        Ok(settings)
    }

    /// The `[term.X]` tables, and whether each term is in the model; a term that is not in the model is checked too.
    pub(super) fn terms(
        &self,
        (plant, known): (Plant, &Known),
        tables: &BTreeMap<Spanned<String>, Spanned<RawTerm>>,
    ) -> Result<BTreeMap<String, (OwnTerm, bool)>, Error> {
        let mut terms = BTreeMap::new();
        for (name, table) in tables {
            let raw = table.as_ref();
            let (place, vessel) = term_file::place_of(plant, known, raw.place.as_ref())
                .map_err(|what| self.at(raw.place.span().start, what))?;
            let variable = term_file::variable_of(raw.variable.as_ref())
                .map_err(|what| self.at(raw.variable.span().start, what))?;
            let numbers = |list: &[Number]| list.iter().map(|number| number.value()).collect();
            let term = Term {
                name: name.as_ref().clone(),
                place,
                vessel,
                variable,
                knots: numbers(&raw.at),
                ordinates: numbers(&raw.value),
                fitted: Fitted::Scale,
            };
            term.check(plant)
                .map_err(|error| self.at(name.span().start, error.to_string()))?;
            let own = OwnTerm {
                term,
                at_unit: raw.at_unit.clone(),
                unit: raw.unit.clone(),
            };
            terms.insert(name.as_ref().clone(), (own, raw.fixed));
        }
        Ok(terms)
    }

    /// The table's names are parameters of the effect at its place, and fixed parameters have a value.
    pub(super) fn check_parameters(
        &self,
        (plant, known): (Plant, &Known),
        effect: &'static EffectInfo,
        setting: &Setting,
    ) -> Result<(), Error> {
        let placed = Placed {
            effect,
            vessel: setting.vessel.unwrap_or(effect.usual_site(plant, known)),
        };
        let infos = any_structure(plant, known, true).effect_parameters(placed);
        let names: Vec<&str> = infos.iter().map(|info| info.name).collect();
        let unknown = |name: &str| {
            format!(
                "{} has no parameter {}; it has {}{}",
                effect.id,
                quoted(name),
                names.join(", "),
                names::suggestion(name, names.iter().copied())
            )
        };
        for (name, (_, at)) in &setting.values {
            if !names.contains(&name.as_str()) {
                return Err(self.at(*at, unknown(name)));
            }
        }
        for name in &setting.fixed {
            if !names.contains(&name.as_str()) {
                return Err(self.at(setting.fixed_at, unknown(name)));
            }
            if !setting.values.contains_key(name) {
                return Err(self.at(
                    setting.fixed_at,
                    format!(
                        "{name} is fixed but has no value; write {name} = ... in [effect.{}]",
                        effect.id
                    ),
                ));
            }
        }
        Ok(())
    }

    pub(super) fn effect(&self, name: &Spanned<String>) -> Result<&'static EffectInfo, Error> {
        EffectInfo::find(name.as_ref())
            .ok_or_else(|| self.at(name.span().start, names::unknown_effect(name.as_ref())))
    }

    /// An effect of the list, checked against the plant and the effects before it.
    pub(super) fn placed(
        &self,
        (plant, known, second_pump): (Plant, &Known, bool),
        before: &[Placed],
        name: &Spanned<String>,
        settings: &BTreeMap<&'static str, Setting>,
    ) -> Result<Placed, Error> {
        let effect = self.effect(name)?;
        let vessel = settings.get(effect.id).and_then(|setting| setting.vessel);
        let placed = Placed {
            effect,
            vessel: vessel.unwrap_or(effect.usual_site(plant, known)),
        };
        before
            .iter()
            .try_fold(
                any_structure(plant, known, second_pump),
                |structure, &on| structure.with(on),
            )
            .and_then(|structure| structure.with(placed))
            .map_err(|error| {
                self.at(
                    name.span().start,
                    error.worded(&MessageNames::PROGRAM.fit.plants),
                )
            })?;
        Ok(placed)
    }
}

/// The vessel, the pump or the output that `where = "..."` names.
pub(crate) fn vessel(
    plant: Plant,
    known: &Known,
    effect: &'static EffectInfo,
    word: &str,
) -> Result<usize, String> {
    let (places, kind) = match effect.place {
        Place::Vessel => (plant.vessels(), "vessel"),
        Place::Actuator => (plant.pumps(), "pump"),
        Place::Sensor => (known.outputs(plant).len(), "tank whose level is measured"),
    };
    let name = |vessel: usize| Placed { effect, vessel }.place_name(plant, known);
    if places == 1 {
        return Err(if effect.place == Place::Vessel {
            format!(
                "plant {} has one vessel, so where = \"{}\" has no meaning; leave it out",
                plant.id(),
                quoted(word)
            )
        } else {
            format!(
                "{} acts at the {}, so where = \"{}\" has no meaning; leave it out",
                effect.id,
                effect.place.name(),
                quoted(word)
            )
        });
    }
    (0..places)
        .find(|&vessel| name(vessel) == Some(word))
        .ok_or_else(|| {
            let names = (0..places).filter_map(name);
            let names: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
            format!(
                "where = \"{}\" is not a {kind}; write {}",
                quoted(word),
                names.join(" or ")
            )
        })
}

/// Names and places do not depend on the data: any ranges can be used for a query.
pub(super) fn any_scales(second_pump: bool) -> Scales {
    let mut scales = Scales::from_ranges((0.0, 1.0), (0.0, 1.0), 1.0, 100.0);
    scales.input_2 = second_pump.then_some((0.0, 1.0));
    scales
}

/// A structure for queries of names and places, with a second pump or without.
pub(crate) fn any_structure(plant: Plant, known: &Known, second_pump: bool) -> Structure {
    Structure::new(plant, known.clone(), any_scales(second_pump))
}
