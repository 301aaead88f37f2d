//! The model file: which plant, which effects, which columns, what is known.
//!
//! ```
//! let model = ctid::model_file::parse("tank.toml", r#"
//!     plant = "cascaded-tanks"
//!     effects = ["overflow"]
//!
//!     [start]
//!     pump_gain = 4.0
//!
//!     [effect.overflow]
//!     where = "upper"
//!     rim = 8.2
//!     fixed = ["rim"]
//! "#)?;
//! assert_eq!(model.start["overflow.rim"], 8.2);
//! assert_eq!(model.fixed, ["overflow.rim"]);
//!
//! let error = ctid::model_file::parse("tank.toml", "plant = \"single-tank\"\neffects = [\"overflw\"]");
//! assert_eq!(
//!     error.unwrap_err().to_string(),
//!     "tank.toml:2: unknown effect \"overflw\": `ctid effects` lists the catalogue; did you mean overflow?"
//! );
//! # Ok::<(), ctid::Error>(())
//! ```

use std::collections::BTreeMap;
use std::path::Path;

use ct_signals::{Columns, Hold};
use plants::{
    EffectInfo, Fitted, Known, Place, Placed, Plant, Scales, Structure, Term,
    controller::Controller,
};
use serde::Deserialize;
use toml::Spanned;

use crate::{Error, names, term_file};

/// What a model file says, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The plant.
    pub plant: Plant,
    /// The effects that have been added, in the file's order.
    pub effects: Vec<Placed>,
    /// The terms of the user's own that have been added, in the file's order.
    pub terms: Vec<OwnTerm>,
    /// Which column of the records is what.
    pub columns: Columns,
    /// Constants that are not fitted.
    pub known: Known,
    /// First guesses by name, as [`Structure::parameter_names`] writes it: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names of the parameters that stay at their value in `start`.
    pub fixed: Vec<String>,
    /// The controller of the loop, where it is known.
    pub controller: Option<ControllerSettings>,
    /// What the input does between samples.
    pub hold: Hold,
}

/// A term of the user's own, and the units that it is written in; empty where the file does not say.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnTerm {
    /// The term.
    pub term: Term,
    /// Unit of its knots.
    pub at_unit: String,
    /// Unit of its values.
    pub unit: String,
}

/// How a controller answers to `e = r - y`.
#[derive(Debug, Clone, PartialEq)]
pub enum ControllerLaw {
    /// `u = u_op + gain (e + (1/integral_time) int e dt)`.
    Pi {
        /// Proportional gain \[input/output\].
        gain: f64,
        /// Integral time \[s\].
        integral_time: f64,
    },
    /// `S(q^-1) u = R(q^-1) e`, the powers 0, 1, 2, ... of a delay of one sample.
    Sampled {
        /// R.
        r: Vec<f64>,
        /// S.
        s: Vec<f64>,
    },
    /// `S(p) u = R(p) e`, the highest power first.
    Continuous {
        /// R.
        r: Vec<f64>,
        /// S.
        s: Vec<f64>,
    },
}

/// The settings of a controller; those of a PI have been accepted by [`Controller::pi`].
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerSettings {
    /// What it does with the error.
    pub law: ControllerLaw,
    /// Smallest command \[input unit\]; minus infinity where none is given.
    pub u_min: f64,
    /// Largest command \[input unit\]; infinity where none is given.
    pub u_max: f64,
}

impl ControllerSettings {
    /// The controller in continuous time, without its limits.
    ///
    /// # Errors
    /// Where it is sampled, or is no controller.
    pub fn linear(&self) -> Result<fcloe::Controller, Error> {
        let polynomial = |highest_first: &[f64]| {
            ct_lti::Polynomial::new(highest_first.iter().rev().copied().collect::<Vec<_>>())
        };
        Ok(match &self.law {
            ControllerLaw::Pi {
                gain,
                integral_time,
            } => fcloe::Controller::pi(*gain, *gain / *integral_time)?,
            ControllerLaw::Continuous { r, s } => {
                fcloe::Controller::new(polynomial(r)?, polynomial(s)?)?
            }
            ControllerLaw::Sampled { .. } => {
                return Err(Error::Usage(
                    "[controller] is given in powers of a delay, but this method needs it in continuous time; write variable = \"p\" and its polynomials in p"
                        .to_owned(),
                ));
            }
        })
    }

    /// The controller, run every `interval` seconds.
    ///
    /// # Errors
    /// Where it cannot work.
    pub fn controller(&self, interval: f64) -> Result<Controller, plants::Error> {
        let limits = (self.u_min, self.u_max);
        match &self.law {
            ControllerLaw::Pi {
                gain,
                integral_time,
            } => Controller::pi(*gain, *integral_time, limits),
            ControllerLaw::Sampled { r, s } => Controller::sampled(r, s, limits),
            ControllerLaw::Continuous { r, s } => Controller::continuous(r, s, interval, limits),
        }
    }
}

impl ModelFile {
    /// The plant with its effects, over the ranges that the data visit.
    ///
    /// # Errors
    /// None for a model that [`parse`] has returned.
    pub fn structure(&self, scales: Scales) -> Result<Structure, plants::Error> {
        let plant = Structure::new(self.plant, self.known.clone(), scales);
        self.effects
            .iter()
            .try_fold(plant, |structure, &placed| structure.with(placed))
            .and_then(|structure| {
                let mut terms = self.terms.iter();
                terms.try_fold(structure, |structure, own| {
                    structure.with_term(own.term.clone())
                })
            })
    }
}

/// Reads a model file.
///
/// # Errors
/// One line that names the file, the line, what is wrong and the mend.
pub fn read(path: &Path) -> Result<ModelFile, Error> {
    parse(&path.display().to_string(), &read_text(path)?)
}

/// The text of a model file.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let cannot = |what: String| Error::file(path, what);
    if path.is_dir() {
        return Err(cannot("it is a folder; name a file in it".to_string()));
    }
    let bytes = std::fs::read(path).map_err(|error| {
        cannot(format!(
            "the model file cannot be opened: {error}; check the path and the permissions"
        ))
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| cannot("the model file is not UTF-8 text; save it as UTF-8".to_string()))?;
    // Some editors put a byte-order mark in front.
    Ok(text
        .strip_prefix('\u{feff}')
        .map(str::to_string)
        .unwrap_or(text))
}

/// Reads the text of a model file; `file` names it in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<ModelFile, Error> {
    let source = Source { file, text };
    let raw: Raw = toml::from_str(text).map_err(|error| source.syntax(&error))?;
    let plant = source.plant(raw.plant.as_ref())?;
    let known = source.known(plant, &raw.known)?;
    let controller = raw
        .controller
        .as_ref()
        .map(|controller| source.controller(controller))
        .transpose()?;
    let mut model = ModelFile {
        plant,
        effects: Vec::new(),
        terms: Vec::new(),
        columns: raw.columns,
        known,
        start: BTreeMap::new(),
        fixed: Vec::new(),
        controller,
        hold: raw.hold,
    };
    let settings = source.effect_tables(plant, &raw.effect)?;
    let terms = source.terms(plant, &raw.term)?;
    for name in &raw.effects {
        if let Some((term, fixed)) = terms.get(name.as_ref().as_str()) {
            if model.terms.iter().any(|on| on.term.name == term.term.name) {
                let what = format!("{} stands here twice; keep it once", name.as_ref());
                return Err(source.at(name.span().start, what));
            }
            if *fixed {
                let scale = format!("{}.scale", term.term.name);
                model.start.insert(scale.clone(), 1.0);
                model.fixed.push(scale);
            }
            model.terms.push(term.clone());
            continue;
        }
        let placed = source.placed(plant, &model.effects, name, &settings)?;
        model.effects.push(placed);
    }
    source.start(&mut model, &raw.start)?;
    for placed in &model.effects {
        let Some(setting) = settings.get(placed.effect.id) else {
            continue;
        };
        for (parameter, (value, at)) in &setting.values {
            let name = format!("{}.{parameter}", placed.effect.id);
            if model.start.insert(name.clone(), *value).is_some() {
                return Err(source.at(
                    *at,
                    format!("{name} is given here and under [start]; keep one of the two"),
                ));
            }
            if setting.fixed.contains(parameter) {
                model.fixed.push(name);
            }
        }
    }
    Ok(model)
}

/// The file as it stands; its numbers and names are checked afterwards, where their lines are known.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    plant: Option<Spanned<String>>,
    #[serde(default)]
    effects: Vec<Spanned<String>>,
    #[serde(default)]
    columns: Columns,
    #[serde(default)]
    known: RawKnown,
    #[serde(default)]
    start: BTreeMap<Spanned<String>, Spanned<Number>>,
    controller: Option<Spanned<RawController>>,
    #[serde(default)]
    effect: BTreeMap<Spanned<String>, Spanned<EffectTable>>,
    #[serde(default)]
    term: BTreeMap<Spanned<String>, Spanned<RawTerm>>,
    #[serde(default)]
    hold: Hold,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTerm {
    place: Spanned<String>,
    variable: Spanned<String>,
    at: Vec<Number>,
    value: Vec<Number>,
    #[serde(default)]
    at_unit: String,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    fixed: bool,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct RawKnown {
    area: Option<Spanned<Number>>,
    area_upper: Option<Spanned<Number>>,
    area_lower: Option<Spanned<Number>>,
    tank_height: Option<Spanned<Number>>,
    input_range: Option<Spanned<Number>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawController {
    #[serde(rename = "type")]
    kind: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    integral_time: Option<Spanned<Number>>,
    variable: Option<Spanned<String>>,
    r: Option<Spanned<Vec<Number>>>,
    s: Option<Spanned<Vec<Number>>>,
    u_min: Option<Spanned<Number>>,
    u_max: Option<Spanned<Number>>,
}

/// A number, written with or without a decimal point.
#[derive(Deserialize, Clone, Copy)]
#[serde(
    untagged,
    expecting = "not a number: write it without quotes, such as 154.0"
)]
enum Number {
    Float(f64),
    Integer(i64),
}

impl Number {
    fn value(self) -> f64 {
        match self {
            Self::Float(value) => value,
            Self::Integer(value) => value as f64,
        }
    }
}

/// An `[effect.X]` table as it stands.
type EffectTable = BTreeMap<Spanned<String>, Spanned<Entry>>;

/// An entry of an `[effect.X]` table.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "not understood: a number, where = \"upper\" or \"lower\", or fixed = [\"parameter\"] may stand here"
)]
enum Entry {
    Number(f64),
    Word(String),
    Words(Vec<String>),
}

/// What an `[effect.X]` table says.
#[derive(Default)]
struct Setting {
    vessel: Option<usize>,
    /// Value and place in the file, by parameter.
    values: BTreeMap<String, (f64, usize)>,
    fixed: Vec<String>,
}

/// The file being read: it knows its lines.
struct Source<'a> {
    file: &'a str,
    text: &'a str,
}

impl Source<'_> {
    /// An error at a byte of the text.
    fn at(&self, byte: usize, what: impl Into<String>) -> Error {
        Error::AtLine {
            file: self.file.to_string(),
            line: 1 + self.text.bytes().take(byte).filter(|&b| b == b'\n').count(),
            what: what.into(),
        }
    }

    /// What the parser refuses, in one line, with the key that was probably meant.
    fn syntax(&self, error: &toml::de::Error) -> Error {
        let mut what = error.message().trim().replace('\n', "; ");
        if let Some(rest) = what.strip_prefix("unknown field `") {
            let mut names = rest.split('`').step_by(2);
            let written = names.next().unwrap_or_default();
            let known: Vec<&str> = rest.split('`').skip(2).step_by(2).collect();
            what = format!(
                "unknown key {written}: one of {} may stand here{}",
                known.join(", "),
                names::suggestion(written, known.iter().copied())
            );
        } else if let Some((_, rest)) = what.split_once("unknown variant `") {
            what = format!("unknown word `{rest}");
        } else if toml::from_str::<toml::Table>(self.text).is_err() {
            // what is wrong is the writing, not what it says
            what += "; write `key = value`, words in quotes, numbers without quotes and without a unit, each key once";
        }
        let Some(span) = error.span() else {
            return Error::File {
                file: self.file.to_string(),
                what,
            };
        };
        self.at(span.start, what)
    }

    fn plant(&self, name: Option<&Spanned<String>>) -> Result<Plant, Error> {
        let ids = || Plant::ALL.into_iter().map(Plant::id);
        let all = ids().collect::<Vec<_>>().join(", ");
        let Some(name) = name else {
            return Err(Error::File {
                file: self.file.to_string(),
                what: format!("no plant is named; write plant = \"...\" first, with one of {all}"),
            });
        };
        name.as_ref().parse().map_err(|_| {
            let name_text = name.as_ref();
            let what = format!(
                "unknown plant \"{name_text}\": take one of {all}{}",
                names::suggestion(name_text, ids())
            );
            self.at(name.span().start, what)
        })
    }

    /// A finite number.
    fn finite(&self, key: &str, number: &Spanned<Number>) -> Result<f64, Error> {
        let value = number.as_ref().value();
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.at(
            number.span().start,
            format!("{key} = {value} is not a finite number; give one, or delete the line"),
        ))
    }

    /// A finite number above zero.
    fn positive(&self, key: &str, number: &Spanned<Number>) -> Result<f64, Error> {
        let value = self.finite(key, number)?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.at(
            number.span().start,
            format!("{key} = {value} has to be above zero; correct it, or delete the line where it is not known"),
        ))
    }

    fn known(&self, plant: Plant, raw: &RawKnown) -> Result<Known, Error> {
        let id = plant.id();
        let two = plant.vessels() > 1;
        let foreign = if two {
            vec![("area", &raw.area)]
        } else {
            vec![
                ("area_upper", &raw.area_upper),
                ("area_lower", &raw.area_lower),
            ]
        };
        for (key, number) in foreign {
            let Some(number) = number else { continue };
            let mend = if two {
                "has two vessels; write area_upper and area_lower"
            } else {
                "has one vessel; write area"
            };
            let what = format!("plant {id} {mend} instead of {key}");
            return Err(self.at(number.span().start, what));
        }
        let take = |key: &str, number: &Option<Spanned<Number>>| {
            number.as_ref().map(|n| self.positive(key, n)).transpose()
        };
        if let (Some(only), None) | (None, Some(only)) = (&raw.area_upper, &raw.area_lower) {
            return Err(self.at(
                only.span().start,
                "one area alone does not say how the levels compare; give both area_upper and area_lower, or neither",
            ));
        }
        let area = if two {
            [
                take("area_upper", &raw.area_upper)?,
                take("area_lower", &raw.area_lower)?,
            ]
        } else {
            [take("area", &raw.area)?, None]
        };
        Ok(Known {
            area,
            tank_height: take("tank_height", &raw.tank_height)?,
            input_range: take("input_range", &raw.input_range)?,
        })
    }

    fn controller(&self, raw: &Spanned<RawController>) -> Result<ControllerSettings, Error> {
        let at = raw.span().start;
        let raw = raw.as_ref();
        const TYPES: &str =
            "write type = \"PI\" with gain and integral_time, or type = \"RS\" with r and s";
        let Some(kind) = &raw.kind else {
            return Err(self.at(at, format!("[controller] has no type; {TYPES}")));
        };
        let foreign: &[(&str, Option<usize>)] = match kind.as_ref().as_str() {
            "PI" => &[
                ("r", raw.r.as_ref().map(|r| r.span().start)),
                ("s", raw.s.as_ref().map(|s| s.span().start)),
                ("variable", raw.variable.as_ref().map(|v| v.span().start)),
            ],
            "RS" => &[
                ("gain", raw.gain.as_ref().map(|n| n.span().start)),
                (
                    "integral_time",
                    raw.integral_time.as_ref().map(|n| n.span().start),
                ),
            ],
            other => {
                let what = format!("controller type \"{other}\" is not known; {TYPES}");
                return Err(self.at(kind.span().start, what));
            }
        };
        if let Some((key, Some(place))) = foreign.iter().find(|(_, place)| place.is_some()) {
            let what = format!(
                "{key} is not a setting of a controller of type \"{}\"; delete it",
                kind.as_ref()
            );
            return Err(self.at(*place, what));
        }
        let needed = |key: &str, number: &Option<Spanned<Number>>| match number {
            Some(number) => self.finite(key, number),
            None => Err(self.at(at, format!("[controller] has no {key}; write {key} = ..."))),
        };
        let limit = |key: &str, number: &Option<Spanned<Number>>, none: f64| {
            number.as_ref().map_or(Ok(none), |n| self.finite(key, n))
        };
        let law = if kind.as_ref() == "PI" {
            ControllerLaw::Pi {
                gain: needed("gain", &raw.gain)?,
                integral_time: needed("integral_time", &raw.integral_time)?,
            }
        } else {
            let list = |key: &str, list: &Option<Spanned<Vec<Number>>>| match list {
                Some(list) => Ok(list
                    .as_ref()
                    .iter()
                    .map(|n| n.value())
                    .collect::<Vec<f64>>()),
                None => Err(self.at(
                    at,
                    format!("[controller] has no {key}; write {key} = [...]"),
                )),
            };
            let (r, s) = (list("r", &raw.r)?, list("s", &raw.s)?);
            match raw
                .variable
                .as_ref()
                .map(|v| (v.as_ref().as_str(), v.span().start))
            {
                None | Some(("q", _)) => ControllerLaw::Sampled { r, s },
                Some(("p", _)) => ControllerLaw::Continuous { r, s },
                Some((other, place)) => {
                    let what = format!(
                        "variable \"{other}\" is not known; write variable = \"q\" for powers of a delay of one sample, or \"p\" for derivatives, highest power first"
                    );
                    return Err(self.at(place, what));
                }
            }
        };
        let settings = ControllerSettings {
            law,
            u_min: limit("u_min", &raw.u_min, f64::NEG_INFINITY)?,
            u_max: limit("u_max", &raw.u_max, f64::INFINITY)?,
        };
        // The interval is the records'; what cannot work does not hang on it.
        settings
            .controller(1.0)
            .map_err(|error| self.at(at, error.to_string()))?;
        Ok(settings)
    }

    /// The `[effect.X]` tables; a table of an effect that is not on is checked too, and kept for
    /// the day on which it is added.
    fn effect_tables(
        &self,
        plant: Plant,
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
                        setting.vessel =
                            Some(vessel(plant, effect, word).map_err(|what| self.at(at, what))?);
                    }
                    ("where", _) => {
                        return Err(self.at(at, "where is a word: \"upper\" or \"lower\""));
                    }
                    ("fixed", Entry::Words(words)) => setting.fixed.clone_from(words),
                    ("fixed", _) => {
                        return Err(self.at(at, "fixed is a list of parameters, such as [\"rim\"]"));
                    }
                    (key, Entry::Number(value)) if value.is_finite() => {
                        setting.values.insert(key.to_string(), (*value, at));
                    }
                    (key, _) => {
                        return Err(self.at(
                            at,
                            format!("{key} has to be a finite number, without quotes"),
                        ));
                    }
                }
            }
            self.check_parameters(plant, effect, &setting, table.span().start)?;
            settings.insert(effect.id, setting);
        }
        Ok(settings)
    }

    /// The `[term.X]` tables, and whether each is kept as it stands; one that is not on is checked too.
    fn terms(
        &self,
        plant: Plant,
        tables: &BTreeMap<Spanned<String>, Spanned<RawTerm>>,
    ) -> Result<BTreeMap<String, (OwnTerm, bool)>, Error> {
        let mut terms = BTreeMap::new();
        for (name, table) in tables {
            let raw = table.as_ref();
            let (place, vessel) = term_file::place_of(plant, raw.place.as_ref())
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

    /// The table's names are parameters of the effect at its place, and what is fixed has a value.
    fn check_parameters(
        &self,
        plant: Plant,
        effect: &'static EffectInfo,
        setting: &Setting,
        table_at: usize,
    ) -> Result<(), Error> {
        let placed = Placed {
            effect,
            vessel: setting.vessel.unwrap_or(effect.usual_site(plant)),
        };
        let infos = any_structure(plant).effect_parameters(placed);
        let names: Vec<&str> = infos.iter().map(|info| info.name).collect();
        let unknown = |name: &str| {
            format!(
                "{} has no parameter {name}; it has {}{}",
                effect.id,
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
                return Err(self.at(table_at, unknown(name)));
            }
            if !setting.values.contains_key(name) {
                return Err(self.at(
                    table_at,
                    format!(
                        "{name} is fixed but has no value; write {name} = ... in [effect.{}]",
                        effect.id
                    ),
                ));
            }
        }
        Ok(())
    }

    fn effect(&self, name: &Spanned<String>) -> Result<&'static EffectInfo, Error> {
        EffectInfo::find(name.as_ref())
            .ok_or_else(|| self.at(name.span().start, names::unknown_effect(name.as_ref())))
    }

    /// An effect of the list, checked against the plant and the effects before it.
    fn placed(
        &self,
        plant: Plant,
        before: &[Placed],
        name: &Spanned<String>,
        settings: &BTreeMap<&'static str, Setting>,
    ) -> Result<Placed, Error> {
        let effect = self.effect(name)?;
        let vessel = settings.get(effect.id).and_then(|setting| setting.vessel);
        let placed = Placed {
            effect,
            vessel: vessel.unwrap_or(effect.usual_site(plant)),
        };
        before
            .iter()
            .try_fold(any_structure(plant), |structure, &on| structure.with(on))
            .and_then(|structure| structure.with(placed))
            .map_err(|error| self.at(name.span().start, error.to_string()))?;
        Ok(placed)
    }

    fn start(
        &self,
        model: &mut ModelFile,
        raw: &BTreeMap<Spanned<String>, Spanned<Number>>,
    ) -> Result<(), Error> {
        let structure = model.structure(any_scales())?;
        let infos = structure.parameters();
        let names = structure.parameter_names();
        for (name, number) in raw {
            let key = name.as_ref();
            let Some(index) = names.iter().position(|known| known == key) else {
                return Err(self.at(
                    name.span().start,
                    format!(
                        "[start] has {key}, which is not a parameter of this model; it has {}{}",
                        names.join(", "),
                        names::suggestion(key, names.iter().map(String::as_str))
                    ),
                ));
            };
            // Gains, outflow coefficients and time constants of the plant are above zero whatever
            // the data; the bounds of an effect follow from the data.
            let above_zero = infos[index].lower > 0.0 && !key.contains('.');
            let value = if above_zero {
                self.positive(key, number)?
            } else {
                self.finite(key, number)?
            };
            model.start.insert(key.clone(), value);
        }
        Ok(())
    }
}

/// The vessel that `where = "..."` names.
pub(crate) fn vessel(plant: Plant, effect: &EffectInfo, word: &str) -> Result<usize, String> {
    if effect.place != Place::Vessel {
        return Err(format!(
            "{} acts at the {}, so where = \"{word}\" has no meaning; leave it out",
            effect.id,
            effect.place.name()
        ));
    }
    if plant.vessels() == 1 {
        return Err(format!(
            "plant {} has one vessel, so where = \"{word}\" has no meaning; leave it out",
            plant.id()
        ));
    }
    (0..plant.vessels())
        .find(|&vessel| plant.vessel_name(vessel) == Some(word))
        .ok_or_else(|| format!("where = \"{word}\" is no vessel; write \"upper\" or \"lower\""))
}

/// Names and places do not depend on the data: any ranges will do to ask for them.
fn any_scales() -> Scales {
    Scales::from_ranges((0.0, 1.0), (0.0, 1.0), 1.0, 100.0)
}

/// A structure to ask for names and places.
pub(crate) fn any_structure(plant: Plant) -> Structure {
    Structure::new(plant, Known::default(), any_scales())
}
