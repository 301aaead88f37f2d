//! What in a model text may be the reason why it fails, beside a missing effect.

use ct_model::Given;
use effect_search::{Diagnosis, Verdict};

use super::file::OwnModelFile;
use super::words::shown_unit;
use crate::numbers;
use crate::sentences::with_unit;

/// The most names that a sentence lists.
const FEW: usize = 6;

/// Sentences about the model text of a diagnosis that does not end as adequate.
pub(super) fn of_text(file: &OwnModelFile, diagnosis: &Diagnosis) -> Vec<String> {
    if diagnosis.verdict == Verdict::Adequate {
        return Vec::new();
    }
    let mut all = at_bounds(file, diagnosis);
    all.extend(untried(file));
    all
}

/// The parameters that are at a bound of the text in the fit without the found effects; after a whole explanation, those that stay there: what
/// the model lacks may have moved the others.
fn at_bounds(file: &OwnModelFile, diagnosis: &Diagnosis) -> Vec<String> {
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let spec = file.model.spec();
    let bound = |name: &str, value: f64| {
        let mut own = spec.parameters.iter().map(|parameter| &parameter.about);
        let about = own.find(|about| about.name == name)?;
        let attribute = match value {
            _ if value == about.min => "min",
            _ if value == about.max => "max",
            _ => return None,
        };
        let sign = if value == 0.0 {
            "the sign of its term may be wrong, or the effect of the term is absent"
        } else {
            "the bound, a unit or the equation may be wrong"
        };
        let number = match value {
            0.0 => "0".to_string(),
            value => numbers::significant(value, 4),
        };
        let value = with_unit(&number, shown_unit(&about.unit));
        Some(format!(
            "In the first fit {name} is at its {attribute} of {value}: {sign}."
        ))
    };
    let is_whole = matches!(diagnosis.verdict, Verdict::Effect | Verdict::Undecided);
    let stays = |name: &str, value: f64| {
        let mut last = last.parameters.iter();
        !is_whole || last.any(|p| p.name == name && p.value == value)
    };
    let fitted = first.parameters.iter().filter(|p| !p.known);
    fitted
        .filter(|p| stays(&p.name, p.value))
        .filter_map(|p| bound(&p.name, p.value))
        .collect()
}

/// The parameters at which no effect is tried, because the text says that they are measured.
fn untried(file: &OwnModelFile) -> Option<String> {
    let spec = &file.base;
    let measured = spec.parameters.iter();
    let measured = measured.filter(|p| p.given == Given::Measured && p.definition.is_none());
    let names: Vec<&str> = measured.map(|p| p.about.name.as_str()).collect();
    if names.is_empty() {
        return None;
    }
    let more = match names.len().saturating_sub(FEW) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(format!(
        "{} measured (final parameter): effects at {} were not tried. For one that may change, write `parameter`, and its value under [known].",
        match names[..] {
            [only] => format!("{only} is"),
            _ => format!("{}{more} are", names[..names.len().min(FEW)].join(", ")),
        },
        if names.len() == 1 { "it" } else { "them" }
    ))
}
