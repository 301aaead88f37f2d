//! Sentences from the findings of a plant: the verdict, the effects, the residual, remarks, and the next experiment; and from those of an
//! identification and of the monitor.
//!
//! Every sentence is a function of the typed result alone.

mod alarm;
mod control_loop;
mod design;
mod effects;
mod failures;
mod gaps;
mod identification;
mod noise;
mod prior;
mod rejections;
pub(crate) mod remarks;
mod residual;
#[cfg(test)]
mod tests;
mod unknown;
mod verdict;
mod warnings;

use missing_effect::numbers;
use missing_effect::{Diagnosis, Parameter, PerOutput, Remark};

use crate::MessageNames;

pub use self::alarm::{Told, of_alarm, of_scatter};
pub use self::control_loop::of_the_loop;
pub use self::design::of_design;
pub use self::failures::{FailureWords, of_failures};
pub use self::gaps::of_gaps;
pub use self::identification::{of_identification, of_side_by_side, of_violation};
pub use self::noise::of_noise_source;
pub use self::prior::of_prior;
pub use self::rejections::of_rejections;
pub use self::warnings::of_warning;

/// The findings of a comparison or a diagnosis in sentences: first one for each accepted effect, or the verdict; then the rest of the
/// verdict, the unexplained error, and remarks. Empty if nothing was fitted.
#[must_use]
pub fn of_diagnosis(diagnosis: &Diagnosis) -> Vec<String> {
    if diagnosis.steps.is_empty() {
        return Vec::new();
    }
    let mut said = if diagnosis.searched() {
        verdict::of_search(diagnosis)
    } else {
        verdict::of_comparison(diagnosis)
    };
    // What was found and not accepted belongs to the verdict; the other remarks follow the errors of the last model.
    let (refused, other): (Vec<&Remark>, Vec<&Remark>) =
        diagnosis.remarks.iter().partition(|remark| {
            matches!(
                remark,
                Remark::ReplacedByTime { .. } | Remark::BestPart { .. }
            )
        });
    said.extend(remarks::of_quantisation(diagnosis));
    said.extend(
        refused
            .into_iter()
            .filter_map(|remark| remarks::of(remark, diagnosis)),
    );
    said.extend(remarks::of_held_out(diagnosis));
    said.extend(remarks::of_a_minimum(diagnosis));
    said.extend(
        other
            .into_iter()
            .filter_map(|remark| remarks::of(remark, diagnosis)),
    );
    said.extend(remarks::of_rankings(&diagnosis.rankings));
    let control_loop = diagnosis.control_loop.iter();
    said.extend(
        control_loop.map(|known| of_the_loop(known, &diagnosis.input_unit, &MessageNames::PROGRAM)),
    );
    said.extend(diagnosis.gaps.as_ref().and_then(of_gaps));
    said
}

/// A value with its standard error to two significant digits of the latter.
fn with_error(parameter: &Parameter) -> String {
    let value = numbers::with_error(parameter.value, parameter.std_error);
    with_unit(&value, &parameter.unit)
}

pub(crate) fn with_unit(number: &str, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_string()
}

/// `0 .. 3.50 V`: two values to three digits, with what stands between them.
pub(crate) fn interval((low, high): (f64, f64), between: &str, unit: &str) -> String {
    let [low, high] = [low, high].map(|end| numbers::significant(end, 3));
    with_unit(&format!("{low}{between}{high}"), unit)
}

/// An effect, and its place where there is a choice: `overflow (upper)`.
pub(crate) fn placed(effect: &str, place: Option<&str>) -> String {
    place.map_or(effect.to_string(), |place| format!("{effect} ({place})"))
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

fn list(names: &[String], last_word: &str) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} {last_word} {last}", most.join(", ")),
    }
}
