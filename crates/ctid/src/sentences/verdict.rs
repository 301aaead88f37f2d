//! The verdict of a comparison and of a diagnosis, and the errors that it is based on.

use missing_effect::{Diagnosis, NotNoise, PerOutput, Step, Verdict};

use super::effects::{of_acceptance, of_effects};
use super::residual::left_over;
use super::unknown::of_unknown;
use super::{list, rms, with_unit};
use crate::numbers::significant;

/// Verdict of a comparison alone.
pub(super) fn of_comparison(diagnosis: &Diagnosis) -> Vec<String> {
    let Some(step) = diagnosis.steps.first() else {
        return Vec::new();
    };
    let unit = &diagnosis.output_unit;
    vec![match (diagnosis.verdict, &diagnosis.not_noise) {
        (Verdict::Adequate, _) => format!(
            "The model explains the data: its simulation error of {} looks like noise.",
            rms(&step.rmse_per_output, unit)
        ),
        (_, None) => format!(
            "The model does not explain the data: its simulation error of {} is more than noise.",
            rms(&step.rmse_per_output, unit)
        ),
        (_, Some(left)) => format!(
            "The model does not explain the data: {}.",
            left_over(left, step, diagnosis)
        ),
    }]
}

/// The minimum detectable sizes of the most likely effects.
fn visible(diagnosis: &Diagnosis) -> String {
    let sizes: Vec<String> = diagnosis
        .scores
        .iter()
        .filter_map(|score| {
            let size = score.size.as_ref()?;
            let smallest = significant(score.smallest_visible?, 2);
            Some(format!(
                "{} {}",
                score.effect,
                with_unit(&smallest, &size.unit)
            ))
        })
        .take(4)
        .collect();
    sizes.join(", ")
}

/// Verdict of a search of the catalogue, the accepted effects first.
pub(super) fn of_search(diagnosis: &Diagnosis) -> Vec<String> {
    let unit = &diagnosis.output_unit;
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let left = diagnosis.not_noise.as_ref();
    let mut said = Vec::new();
    let unknown = diagnosis.unknown.as_ref();
    let shaped = unknown.map(|unknown| of_unknown(unknown, &diagnosis.clock, diagnosis.domain()));
    let held_out = |step: &Step| {
        step.rmse_test_per_output
            .as_ref()
            .map_or(String::new(), |errors| {
                let errors = rms(errors, unit).replace(" rms", "");
                format!(", {errors} on held-out data")
            })
    };
    match diagnosis.verdict {
        Verdict::Adequate => {
            said.push(format!(
                "The model is adequate: its simulation error of {} is noise{}.",
                rms(&first.rmse_per_output, unit),
                held_out(first)
            ));
            let visible = visible(diagnosis);
            if !visible.is_empty() {
                said.push(format!("These data would have shown {visible}."));
            }
        }
        Verdict::Unexplained => match left {
            // A correct model under a slow disturbance has such a residual too.
            Some(left @ NotNoise::Slow { .. }) => {
                said.push(format!(
                    "No effect of the catalogue is significant, but the residual is not noise: {}.",
                    left_over(left, first, diagnosis)
                ));
                let visible = visible(diagnosis);
                if !visible.is_empty() {
                    said.push(format!("It hides what is smaller than {visible}."));
                }
            }
            _ => said.push(format!(
                "Something is missing, and nothing in the catalogue explains it: {}.",
                left.map_or_else(
                    || format!(
                        "the residual of {} is more than noise",
                        rms(&first.rmse_per_output, unit)
                    ),
                    |left| left_over(left, first, diagnosis)
                )
            )),
        },
        Verdict::Effect | Verdict::Undecided | Verdict::Partial => {
            said.extend(of_effects(diagnosis, last));
            said.push(format!(
                "The simulation error falls {}{}.",
                falls(
                    &first.rmse_per_output,
                    &last.rmse_per_output,
                    &format!("{unit} rms")
                ),
                match (&first.rmse_test_per_output, &last.rmse_test_per_output) {
                    (Some(before), Some(after)) =>
                        format!(", on held-out data {}", falls(before, after, unit)),
                    _ => String::new(),
                }
            ));
            if diagnosis.verdict == Verdict::Partial {
                said.extend(diagnosis.acceptance.as_ref().and_then(of_acceptance));
            }
            if let Some(left) = left {
                said.push(format!(
                    "Something remains: {}.",
                    left_over(left, last, diagnosis)
                ));
            }
        }
    }
    said.extend(shaped);
    said
}

/// Fall of the errors: `from 0.900 to 0.300 cm`, with the output's name if there are several.
fn falls(before: &PerOutput, after: &PerOutput, unit: &str) -> String {
    let several = before.0.len() > 1;
    let pairs = before.0.iter().zip(after.values());
    let words = pairs.map(|((name, before), after)| {
        let of = if several {
            format!(" ({name})")
        } else {
            String::new()
        };
        format!("from {before:.3} to {after:.3} {unit}{of}")
    });
    list(&words.collect::<Vec<_>>(), "and")
}
