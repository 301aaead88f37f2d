//! The file as `serde` reads it.

use std::collections::BTreeMap;

use ct_signals::{Columns, Hold};
use serde::Deserialize;
use toml::Spanned;

/// Raw content of the file; numbers and names are checked later, when their lines are known.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Raw {
    pub(super) plant: Option<Spanned<String>>,
    #[serde(default)]
    pub(super) effects: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) columns: Columns,
    #[serde(default)]
    pub(super) known: RawKnown,
    #[serde(default)]
    pub(super) start: BTreeMap<Spanned<String>, Spanned<Number>>,
    #[serde(default)]
    pub(super) prior: BTreeMap<Spanned<String>, Spanned<RawPrior>>,
    pub(super) controller: Option<Spanned<RawController>>,
    #[serde(default)]
    pub(super) effect: BTreeMap<Spanned<String>, Spanned<EffectTable>>,
    #[serde(default)]
    pub(super) term: BTreeMap<Spanned<String>, Spanned<RawTerm>>,
    #[serde(default)]
    pub(super) hold: Hold,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTerm {
    pub(super) place: Spanned<String>,
    pub(super) variable: Spanned<String>,
    pub(super) at: Vec<Number>,
    pub(super) value: Vec<Number>,
    #[serde(default)]
    pub(super) at_unit: String,
    #[serde(default)]
    pub(super) unit: String,
    #[serde(default)]
    pub(super) fixed: bool,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RawKnown {
    pub(super) area: Option<Spanned<Number>>,
    pub(super) area_upper: Option<Spanned<Number>>,
    pub(super) area_lower: Option<Spanned<Number>>,
    pub(super) area_1: Option<Spanned<Number>>,
    pub(super) area_2: Option<Spanned<Number>>,
    pub(super) area_3: Option<Spanned<Number>>,
    pub(super) pipe_area: Option<Spanned<Number>>,
    pub(super) gravity: Option<Spanned<Number>>,
    pub(super) measured: Option<Spanned<Words>>,
    pub(super) disturbance: Option<Spanned<String>>,
    pub(super) tank_height: Option<Spanned<Number>>,
    pub(super) input_range: Option<Spanned<Number>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawController {
    /// For a user's own model: the output that the controller reads, ...
    pub(crate) output: Option<Spanned<String>>,
    /// ... and the column of the reference.
    pub(crate) reference: Option<Spanned<String>>,
    #[serde(rename = "type")]
    pub(super) kind: Option<Spanned<String>>,
    pub(super) gain: Option<Spanned<Number>>,
    pub(super) integral_time: Option<Spanned<Number>>,
    pub(super) variable: Option<Spanned<String>>,
    pub(super) r: Option<Spanned<Vec<Number>>>,
    pub(super) s: Option<Spanned<Vec<Number>>>,
    pub(super) u_min: Option<Spanned<Number>>,
    pub(super) u_max: Option<Spanned<Number>>,
}

/// A word, or a list of them.
#[derive(Deserialize, Clone)]
#[serde(
    untagged,
    expecting = "a word in quotes, such as \"T1\", or a list of them"
)]
pub(super) enum Words {
    One(String),
    Several(Vec<String>),
}

impl Words {
    pub(super) fn all(&self) -> &[String] {
        match self {
            Self::One(word) => std::slice::from_ref(word),
            Self::Several(words) => words,
        }
    }
}

/// A side measurement: value and standard error.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "not understood: write the value and its standard error, such as [2.1, 0.1]"
)]
pub(super) enum RawPrior {
    ValueAndError([Number; 2]),
}

/// A number, written with or without a decimal point.
#[derive(Deserialize, Clone, Copy)]
#[serde(
    untagged,
    expecting = "not a number: write it without quotes, such as 154.0"
)]
pub(crate) enum Number {
    Float(f64),
    Integer(i64),
}

impl Number {
    pub(crate) fn value(self) -> f64 {
        match self {
            Self::Float(value) => value,
            Self::Integer(value) => value as f64,
        }
    }
}

/// Raw content of an `[effect.X]` table.
pub(super) type EffectTable = BTreeMap<Spanned<String>, Spanned<Entry>>;

/// An entry of an `[effect.X]` table.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "not understood: a number, a place such as where = \"upper\" or \"T1\", or fixed = [\"parameter\"] may stand here"
)]
pub(super) enum Entry {
    Number(f64),
    Word(String),
    Words(Vec<String>),
}
