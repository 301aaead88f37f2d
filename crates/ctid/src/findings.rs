//! Texts about the parts of a diagnosis, shared by the terminal, the report and the page.

use effect_search::HeldOutError;
use missing_effect::{
    Acceptance, Diagnosis, Effort, GROUP_MARGIN, PerOutput, PlaceScore, Score, Step,
};
use plants::Domain;

use crate::effort::{EffortLevel, limit_text};
use crate::numbers;
use crate::sentences::{of_failures, with_unit};

/// Number of effects of each ranking that are shown if two rankings differ.
const COMPARED: usize = 5;

/// Whether this effect, in this tank, was added.
pub(crate) fn is_added(diagnosis: &Diagnosis, score: &Score) -> bool {
    diagnosis
        .steps
        .iter()
        .any(|step| step.added.as_ref() == Some(&score.effect) && step.place == score.place)
}

/// Whether the data cannot distinguish this effect from an added one. A group names no tanks: the added effect in the other tank does not
/// count.
pub(crate) fn fits_as_well(diagnosis: &Diagnosis, score: &Score) -> bool {
    !diagnosis.effects.contains(&score.effect)
        && diagnosis
            .groups
            .iter()
            .any(|group| group.contains(&score.effect))
}

/// The tank of the added effect of this index, where the plant has two.
pub(crate) fn tank(diagnosis: &Diagnosis, index: usize) -> Option<&str> {
    diagnosis.steps.get(index + 1)?.place.as_deref()
}

/// Whether there are several outputs: then sentences name the output.
pub(crate) fn several(diagnosis: &Diagnosis) -> bool {
    diagnosis.outputs.len() > 1
}

/// Unit of numbers that are divided by the noise.
pub(crate) const TIMES_THE_NOISE: &str = "times the noise";

/// A number for each output: `0.55 V`, with several outputs `0.55 V (upper), 0.20 V (lower)`.
pub(crate) fn per_output(values: &PerOutput, digits: i32, unit: &str) -> String {
    let several = values.0.len() > 1;
    let of_output = |(name, value): &(String, f64)| {
        let value = with_unit(&numbers::significant(*value, digits), unit);
        if several {
            format!("{value} ({name})")
        } else {
            value
        }
    };
    let all: Vec<String> = values.0.iter().map(of_output).collect();
    all.join(", ")
}

/// The noise floors of the outputs as text.
pub(crate) fn noise_floors(diagnosis: &Diagnosis) -> PerOutput {
    let floors = diagnosis.noise.iter();
    PerOutput(
        floors
            .map(|floor| (floor.output.clone(), floor.level))
            .collect(),
    )
}

/// Errors of several outputs are combined only after division by their noise: with one output the error itself, with several the weighted
/// one, and its unit.
fn one_error<T>(diagnosis: &Diagnosis, only: T, weighted: T) -> (T, &str) {
    if several(diagnosis) {
        (weighted, TIMES_THE_NOISE)
    } else {
        (only, &diagnosis.output_unit)
    }
}

/// Simulation error with a single effect, and its unit.
pub(crate) fn score_error<'a>(diagnosis: &'a Diagnosis, score: &Score) -> (f64, &'a str) {
    one_error(diagnosis, score.rmse, score.weighted_rmse)
}

/// The error of a step on the fitted records, and its unit.
pub(crate) fn step_error<'a>(diagnosis: &'a Diagnosis, step: &Step) -> (f64, &'a str) {
    one_error(diagnosis, step.rmse, step.weighted_rmse)
}

/// Simulation error of a step on the held-out records, if there are some.
pub(crate) fn held_out_step_error(diagnosis: &Diagnosis, step: &Step) -> Option<f64> {
    one_error(diagnosis, step.rmse_test, step.weighted_rmse_test).0
}

/// Sentences about the errors of a step, output by output, with the name of the output if there are several.
pub(crate) fn sentences(diagnosis: &Diagnosis, step: &Step) -> Vec<String> {
    let several = several(diagnosis);
    let outputs = step.outputs.iter();
    let sentences = outputs.enumerate().flat_map(|(at, output)| {
        let of_output = of_failures(diagnosis, output, at).into_iter();
        of_output.map(move |sentence| {
            if several {
                format!("{}: {sentence}", output.name)
            } else {
                sentence
            }
        })
    });
    sentences.collect()
}

/// `held-out error 1.9 degC: offset 1.9, gain 0.1, shape 0.3 degC` of each output, with its name where there are several.
pub(crate) fn held_out_errors(diagnosis: &Diagnosis, step: &Step) -> Vec<String> {
    let several = several(diagnosis);
    let outputs = step.outputs.iter();
    let errors = outputs.filter_map(|output| {
        let parts = held_out_error(output.held_out_error.as_ref()?, &diagnosis.output_unit);
        let of = if several {
            format!(" of {}", output.name)
        } else {
            String::new()
        };
        Some(format!("held-out error{of} {parts}"))
    });
    errors.collect()
}

/// A ratio in whole percent; `-` if it is not known.
pub(crate) fn percent(part: f64) -> String {
    if part.is_finite() {
        let rounded = (100.0 * part).clamp(-999.0, 999.0).round();
        // Avoids a negative zero.
        format!("{:.0} %", rounded + 0.0)
    } else {
        "-".to_string()
    }
}

/// Whether no effect was scored: a comparison.
pub(crate) fn is_comparison(diagnosis: &Diagnosis) -> bool {
    diagnosis.scores.is_empty() && diagnosis.steps.len() < 2
}

/// `Mostly overflow: 62 % of the squared error above the noise floor (55 % on held-out data); what remains: ...`
pub(crate) fn partial_headline(diagnosis: &Diagnosis) -> String {
    let acceptance = diagnosis.acceptance.as_ref();
    let share = acceptance.and_then(|test| test.share);
    let explained = match share {
        Some(share) => format!(
            "{} of the squared error above the noise floor",
            percent(share)
        ),
        None => "the larger part of the squared error".to_string(),
    };
    let held_out = acceptance
        .and_then(|test| test.share_test)
        .map_or(String::new(), |share| {
            format!(" ({} on held-out data)", percent(share))
        });
    let remains = diagnosis.steps.last().map_or(String::new(), |last| {
        let unit = &diagnosis.output_unit;
        let outputs = last.outputs.iter().zip(&diagnosis.noise);
        let remains = outputs.map(|(output, floor)| {
            let of = if several(diagnosis) {
                format!("{} ", output.name)
            } else {
                String::new()
            };
            let error = with_unit(&numbers::significant(output.rmse, 2), unit);
            let floor = if floor.level.is_finite() {
                let level = with_unit(&numbers::significant(floor.level, 2), unit);
                format!(" (noise floor {level})")
            } else {
                String::new()
            };
            format!("{of}{error} rms{floor}")
        });
        let remains: Vec<String> = remains.collect();
        format!("; what remains: {}", remains.join(", "))
    });
    format!(
        "Mostly {}: {explained}{held_out}{remains}",
        diagnosis.effects.join(", ")
    )
}

/// A row of the acceptance test: what was measured, its value, and what is required.
pub(crate) type AcceptanceRow = (&'static str, String, String);

/// The acceptance test as a table.
pub(crate) fn acceptance_rows(test: &Acceptance, unit: &str) -> Vec<AcceptanceRow> {
    let share = |share: Option<f64>| share.map_or("-".to_string(), percent);
    let mut rows = vec![(
        "Squared error above the floor that is explained, fitted data",
        share(test.share),
        format!(
            "{} where the residual is not noise; {} for a partial explanation",
            percent(test.required),
            percent(test.required_partial)
        ),
    )];
    if test.share_test.is_some() {
        rows.push((
            "The same on held-out data",
            share(test.share_test),
            "not used for the verdict".to_string(),
        ));
    }
    rows.push((
        "Fall of BIC",
        test.bic_fall.map_or("-".to_string(), numbers::whole),
        format!("more than {}", numbers::whole(test.required_bic_fall)),
    ));
    rows.push((
        "Noise floor: error of this size is attributed to noise",
        per_output(&test.floor, 2, unit),
        String::new(),
    ));
    rows
}

/// Description of the acceptance test.
pub(crate) fn acceptance_title(diagnosis: &Diagnosis, test: &Acceptance) -> String {
    if test.effects.is_empty() {
        return "Acceptance test: no candidate effect lowers the error".to_string();
    }
    let names = test.effects.join(" + ");
    if diagnosis.effects.is_empty() {
        format!("Acceptance test of {names}, the best candidate, which was refused")
    } else {
        format!("Acceptance test of {names}")
    }
}

/// Places of each effect that can act in several places: `overflow: upper tank 1.00, lower tank 0.31: not determined`.
pub(crate) fn places(diagnosis: &Diagnosis) -> Vec<String> {
    let of_effects = diagnosis.effects.iter().zip(&diagnosis.places);
    of_effects
        .filter(|(_, places)| places.len() > 1)
        .map(|(effect, places)| format!("{effect}: {}", place_scores(diagnosis.domain(), places)))
        .collect()
}

/// Places of an effect in words: `upper tank 1.00, lower tank 0.31: not determined`.
pub(crate) fn place_scores(domain: Domain, places: &[PlaceScore]) -> String {
    let scores: Vec<String> = places
        .iter()
        .map(|score| {
            let likelihood = if score.relative_likelihood < 0.005 {
                "below 0.01".to_string()
            } else {
                format!("{:.2}", score.relative_likelihood)
            };
            format!("{} {likelihood}", place_name(domain, &score.place))
        })
        .collect();
    // Places are distinguished by the same margin of BIC as effects of a group.
    let least = (-0.5 * GROUP_MARGIN).exp();
    let possible = places
        .iter()
        .filter(|score| score.relative_likelihood >= least)
        .count();
    let finding = match (places.first(), possible) {
        (Some(best), 1) => format!("it is the {}", place_name(domain, &best.place)),
        _ => "not determined".to_string(),
    };
    format!("{}: {finding}", scores.join(", "))
}

/// A vessel or a pump in words.
fn place_name(domain: Domain, place: &str) -> String {
    match place {
        _ if domain == Domain::General => {
            let (which, kind) = domain.vessel_words(place);
            format!("{which} {kind}")
        }
        "upper" | "lower" => format!("{place} tank"),
        _ if place.starts_with("pump_") => place.replace('_', " "),
        _ => format!("tank {place}"),
    }
}

/// The two rankings side by side where they disagree: rank, by simulation error, prewhitened.
pub(crate) fn rankings(diagnosis: &Diagnosis) -> Vec<(String, String, String)> {
    let rankings = &diagnosis.rankings;
    if !rankings.disagree {
        return Vec::new();
    }
    let name = |list: &[String], k: usize| list.get(k).cloned().unwrap_or_default();
    let longest = rankings.white.len().max(rankings.prewhitened.len());
    (0..longest.min(COMPARED))
        .map(|k| {
            (
                (k + 1).to_string(),
                name(&rankings.white, k),
                name(&rankings.prewhitened, k),
            )
        })
        .collect()
}

/// Explanation of the two rankings.
pub(crate) const RANKINGS_DISAGREE: &str = "The ranking of the effects depends on the noise model: as if the noise were white (least simulation error), and \
     prewhitened by the noise model (GLS). Take both for candidates.";

/// Heads of the two rankings.
pub(crate) const RANKINGS_HEADS: [&str; 2] =
    ["by simulation error (white noise)", "prewhitened (GLS)"];

/// `1.9 degC: offset 1.9, gain 0.1, shape 0.3 degC`.
pub(crate) fn held_out_error(error: &HeldOutError, unit: &str) -> String {
    let total = error.offset.hypot(error.gain).hypot(error.shape);
    if !total.is_finite() || total <= 0.0 {
        return with_unit(&numbers::significant(total, 2), unit);
    }
    // Parts with the number of decimals of the whole, so that they are easy to compare.
    let places = (1 - numbers::exponent(total)).max(0);
    let [total, offset, gain, shape] =
        [total, error.offset, error.gain, error.shape].map(|part| numbers::decimals(part, places));
    let total = with_unit(&total, unit);
    let shape = with_unit(&shape, unit);
    format!("{total}: offset {offset}, gain {gain}, shape {shape}")
}

/// Meaning of the parts of the error on held-out data.
pub(crate) const HELD_OUT_PARTS: &str = "Held-out error: its offset is the mean of measured minus model, its gain the part that a factor on the model's deviations \
     from its mean would remove, its shape the rest; root mean squares.";

/// How the reader can request more time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reader {
    /// On the command line, or in its report.
    Commands,
    /// On the served page.
    Page,
}

/// Steps that were left out because of the time limit or an interruption.
pub(crate) fn left_out(effort: &Effort) -> Option<String> {
    if effort.left_out.is_empty() {
        return None;
    }
    let why = match effort.limit.filter(|_| !effort.interrupted) {
        Some(limit) => format!("Left out by the time limit of {}", limit_text(limit)),
        None => "Left out".to_string(),
    };
    Some(format!("{why}: {}.", effort.left_out.join("; ")))
}

/// Steps that were left out because of the time limit or an interruption, and how to get them.
pub(crate) fn effort(effort: &Effort, reader: Reader) -> Vec<String> {
    let mut said = Vec::new();
    if effort.interrupted {
        said.push(
            "The search was interrupted: this is the best result that was found until then."
                .to_string(),
        );
    }
    said.extend(left_out(effort));
    if effort.interrupted || effort.left_out.is_empty() {
        return said;
    }
    let most = EffortLevel::Thorough.limit().as_secs_f64();
    let more = match reader {
        _ if effort.limit.is_none_or(|limit| limit >= most) => {
            "For a complete search use fewer rows: thin the record, or split it.".to_string()
        }
        Reader::Commands => format!(
            "For a longer search: `--effort thorough` (limit {}).",
            limit_text(most)
        ),
        Reader::Page => format!(
            "For a longer search choose the effort thorough (limit {}) and diagnose again.",
            limit_text(most)
        ),
    };
    said.push(more);
    said
}

#[cfg(test)]
mod tests;
