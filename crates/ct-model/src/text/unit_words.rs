//! Check of the units in a text.

use ct_signals::Unit;

use super::error::{TextError, shown};
use super::names::differentiated;
use super::parser;
use super::resolve;
use super::syntax::{Attribute, Kind, Syntax};
use crate::units::{UnitWarning, unit_warnings};

/// Units that are known as words, in addition to those that can be converted. SI prefixes are allowed.
const OTHER: [&str; 33] = [
    "H", "S", "T", "Wb", "F", "C", "cd", "lm", "lx", "Bq", "Gy", "Sv", "kat", "sr", "dB", "B",
    "pH", "mmHg", "inHg", "Torr", "torr", "mmH2O", "inH2O", "mH2O", "cal", "BTU", "Btu", "eV", "M",
    "ppb", "var", "VAr", "kgf",
];
const PREFIXES: [&str; 14] = [
    "da", "n", "u", "\u{b5}", "\u{3bc}", "m", "c", "d", "h", "k", "M", "G", "T", "p",
];

/// What is wrong with the units of a model's text, each with its place: first the unknown words, usually typing errors, then what
/// [`unit_warnings`] finds. An unknown unit is compatible with everything, so it is not checked or converted.
///
/// # Errors
/// As [`crate::ModelSpec::parse`].
pub fn check_units(text: &str) -> Result<Vec<TextError>, TextError> {
    let syntax = parser::parse(text)?;
    let mut found = unknown_units(text, &syntax);
    let places = |warning: &UnitWarning| {
        let (of, from) = if warning.in_start {
            ("start value", start_place(&syntax, &warning.of))
        } else {
            ("equation", equation_place(&syntax, &warning.of))
        };
        let what = format!(
            "units in the {of} of {}: {}: correct one of the units, or the {of}",
            warning.of, warning.what
        );
        TextError::at(text, from.unwrap_or(0), what)
    };
    let model = resolve::resolve(text, syntax.clone())?;
    found.extend(unit_warnings(&model).iter().map(places));
    Ok(found)
}

/// Begin of the equation of a variable \[bytes\]: its value, if it is declared with one.
fn equation_place(syntax: &Syntax, name: &str) -> Option<usize> {
    let own = syntax.equations.iter().find(|equation| {
        let left = &equation.left;
        let state = differentiated(left).is_some_and(|(state, _)| state == name);
        state || matches!(&left.kind, Kind::Name(flow) if flow == name)
    });
    let declared = syntax.declarations.iter().find(|d| d.name == name);
    let declared = declared.map(|d| d.binding.as_ref().map_or(d.from, |value| value.from));
    own.map(|equation| equation.left.from).or(declared)
}

/// Place of the start value of a state \[bytes\].
fn start_place(syntax: &Syntax, name: &str) -> Option<usize> {
    let initial = syntax
        .initial
        .iter()
        .find(|equation| matches!(&equation.left.kind, Kind::Name(state) if state == name));
    let declared = syntax.declarations.iter().find(|d| d.name == name);
    let declared = declared.map(|d| {
        let start = d.attributes.iter().find(|(name, ..)| name == "start");
        start.map_or(d.from, |(_, from, _)| *from)
    });
    initial.map(|equation| equation.left.from).or(declared)
}

/// The unknown words in units.
fn unknown_units(text: &str, syntax: &Syntax) -> Vec<TextError> {
    let attributes = syntax.declarations.iter().flat_map(|d| &d.attributes);
    let unknown = attributes.filter_map(|(name, from, attribute)| match attribute {
        Attribute::Text(unit) if name == "unit" => {
            let word = unknown_word(unit)?;
            let what = if word == *unit {
                format!("unit {} is unknown", shown(unit))
            } else {
                format!("{} in the unit {} is unknown", shown(word), shown(unit))
            };
            let mend = "write one, as `W/(m2.K)`, or leave it out";
            Some(TextError::at(text, *from, format!("{what}: {mend}")))
        }
        _ => None,
    });
    unknown.collect()
}

/// The first unknown word of a unit.
fn unknown_word(unit: &str) -> Option<&str> {
    if Unit::parse(unit).is_some() || unit.trim().is_empty() {
        return None;
    }
    let is_letter = |c: char| c.is_alphabetic() || "%°‰_".contains(c);
    let words = unit.split(|c: char| !is_letter(c) && !c.is_ascii_digit());
    // A power follows its unit: `m2`.
    let words = words.map(|word| {
        let word = word.trim_start_matches(|c: char| c.is_ascii_digit());
        (word, word.trim_end_matches(|c: char| c.is_ascii_digit()))
    });
    let known = |word: &str| {
        let prefixed = |prefix: &str| {
            let rest = word.strip_prefix(prefix);
            rest.is_some_and(|rest| OTHER.contains(&rest))
        };
        Unit::parse(word).is_some()
            || OTHER.contains(&word)
            || PREFIXES.iter().any(|prefix| prefixed(prefix))
    };
    words
        .filter(|(word, _)| !word.is_empty())
        .find(|(word, bare)| !known(word) && !known(bare))
        .map(|(_, bare)| bare)
}
