//! The findings in words.

use crate::{Diagnosis, Parameter, Verdict};

/// A value with its standard error to two significant digits of the latter.
pub(crate) fn with_error(parameter: &Parameter) -> String {
    let unit = if parameter.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", parameter.unit)
    };
    match parameter.std_error {
        Some(error) if error > 0.0 && error.is_finite() => {
            let digits = (1 - error.log10().floor() as i32).clamp(0, 12) as usize;
            format!("{:.digits$} ± {:.digits$}{unit}", parameter.value, error)
        }
        _ => format!(
            "{:.4}{unit}, at the edge of what is plausible or of what the data determine",
            parameter.value
        ),
    }
}

fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// What a comparison alone can say.
pub(crate) fn of_comparison(diagnosis: &Diagnosis) -> Vec<String> {
    let Some(step) = diagnosis.steps.first() else {
        return Vec::new();
    };
    let unit = &diagnosis.output_unit;
    vec![match diagnosis.verdict {
        Verdict::Adequate => {
            format!(
                "The model explains the data: its simulation error of {:.3} {unit} rms looks like noise.",
                step.rmse
            )
        }
        _ => format!(
            "The model does not explain the data: its simulation error of {:.3} {unit} rms holds more than noise.",
            step.rmse
        ),
    }]
}

/// What there is to say, the verdict first.
pub(crate) fn of_diagnosis(diagnosis: &Diagnosis, structure_remains: bool) -> Vec<String> {
    let unit = &diagnosis.output_unit;
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let mut said = Vec::new();
    let held_out = |step: &crate::Step| {
        step.rmse_test.map_or(String::new(), |e| {
            format!(", {e:.3} {unit} on held-out data")
        })
    };
    match diagnosis.verdict {
        Verdict::Adequate => {
            said.push(format!(
                "The model is adequate: its simulation error of {:.3} {unit} rms is noise{}.",
                first.rmse,
                held_out(first)
            ));
            let visible: Vec<String> = diagnosis
                .scores
                .iter()
                .filter_map(|score| {
                    let size = score.size.as_ref()?;
                    Some(format!("{} {:.2} {}", score.effect, score.smallest_visible?, size.unit).trim_end().to_string())
                })
                .take(4)
                .collect();
            if !visible.is_empty() {
                said.push(format!("These data would have shown {}.", visible.join(", ")));
            }
        }
        Verdict::Unexplained => said.push(format!(
            "Something is missing, and nothing in the catalogue explains it: the input still shows in the residual of {:.3} {unit} rms.",
            first.rmse
        )),
        Verdict::Effect | Verdict::Undecided => {
            for ((effect, group), step) in diagnosis.effects.iter().zip(&diagnosis.groups).zip(diagnosis.steps.iter().skip(1)) {
                let size = last
                    .parameters
                    .iter()
                    .find(|parameter| parameter.name.starts_with(&format!("{effect}.")))
                    .map_or(String::new(), |p| format!(" ({} = {})", p.name.trim_start_matches(&format!("{effect}.")), with_error(p)));
                let place = step.place.as_ref().map_or(String::new(), |place| format!(" in the {place} tank"));
                if group.len() > 1 {
                    said.push(format!(
                        "It is {}: this data cannot tell them apart; {effect}{place}{size} fits best.",
                        list(group)
                    ));
                } else {
                    said.push(format!("It is {effect}{place}{size}."));
                }
            }
            said.push(format!(
                "The simulation error falls from {:.3} to {:.3} {unit} rms{}.",
                first.rmse,
                last.rmse,
                match (first.rmse_test, last.rmse_test) {
                    (Some(before), Some(after)) => format!(", on held-out data from {before:.3} to {after:.3} {unit}"),
                    _ => String::new(),
                }
            ));
            if structure_remains {
                said.push(format!(
                    "Something smaller remains: the input still shows in the residual of {:.3} {unit} rms.",
                    last.rmse
                ));
            }
        }
    }
    said
}
