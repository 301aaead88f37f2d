//! The findings in words: `verdict.rs` first, then the effects, the residual, and remarks.

mod effects;
mod gaps;
mod remarks;
mod residual;
mod unknown;
mod verdict;

pub(crate) use self::{
    gaps::of_gaps,
    remarks::{
        of_a_minimum, of_a_part, of_a_stop, of_coloured_noise, of_courses, of_held_out,
        of_rankings, of_rounding, of_terms,
    },
    verdict::{of_comparison, of_diagnosis},
};
use crate::{Parameter, PerOutput, numbers::value_and_error};

/// A value with its standard error to two significant digits of the latter.
pub(crate) fn with_error(parameter: &Parameter) -> String {
    let (value, error) = value_and_error(parameter.value, parameter.std_error);
    let error = error.map_or(String::new(), |error| format!(" ± {error}"));
    with_unit(&format!("{value}{error}"), &parameter.unit)
}

pub(crate) fn with_unit(number: &str, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_string()
}

/// Root mean squares in words: `0.300 cm rms`, of several outputs `0.300 cm rms (upper) and 0.100 cm rms (lower)`.
fn rms(per_output: &PerOutput, unit: &str) -> String {
    let words = |(name, rms): &(String, f64)| {
        let of = if per_output.0.len() > 1 {
            format!(" ({name})")
        } else {
            String::new()
        };
        format!("{rms:.3} {unit} rms{of}")
    };
    let all: Vec<String> = per_output.0.iter().map(words).collect();
    list(&all, "and")
}

pub(crate) fn list(names: &[String], last_word: &str) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} {last_word} {last}", most.join(", ")),
    }
}
