//! Effects of a model file as they are written, before they are checked against the model.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

/// The tables of effects, by identifier.
pub(super) type RawEffects = BTreeMap<Spanned<String>, BTreeMap<Spanned<String>, Setting>>;

/// A setting of an effect.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    untagged,
    expecting = "a number, `fixed = [\"a parameter\"]`, `record = { duration = 600.0 }`, or `function = \"shape(x,u)\"`"
)]
pub(super) enum Setting {
    Start(f64),
    Fixed(Vec<String>),
    Record(BTreeMap<String, f64>),
    Function(String),
}

/// An identifier without the blanks that the user typed.
pub(crate) fn plain(id: &str) -> String {
    id.chars().filter(|c| !c.is_whitespace()).collect()
}
