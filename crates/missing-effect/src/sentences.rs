//! The findings in words.

use crate::{Diagnosis, Parameter, Step, Verdict, remains::Remains};

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

/// A number to two significant digits, without an exponent.
fn two_digits(value: f64) -> String {
    let exponent = value.abs().max(f64::MIN_POSITIVE).log10().floor();
    let step = 10_f64.powf(exponent - 1.0);
    let digits = (1.0 - exponent).clamp(0.0, 12.0) as usize;
    format!("{:.digits$}", (value / step).round() * step)
}

/// What is left in the residual of a step, as the end of a sentence.
fn left_over(remains: Remains, step: &Step, diagnosis: &Diagnosis) -> String {
    // A comparison has not looked into the catalogue.
    let effect = if diagnosis.scores.is_empty() {
        "an effect that the model lacks"
    } else {
        "an effect outside the catalogue"
    };
    let (rmse, unit) = (step.rmse, &diagnosis.output_unit);
    let record = diagnosis
        .records
        .iter()
        .filter_map(|record| Some(record.time.last()? - record.time.first()?))
        .fold(0.0, f64::max);
    match remains {
        Remains::Input => format!("the input still shows in the residual of {rmse:.3} {unit} rms"),
        Remains::Period(period) => format!(
            "the residual of {rmse:.3} {unit} rms swings with a period of about {} s, which noise does not: it may be a disturbance or {effect}",
            two_digits(period)
        ),
        Remains::Instant(at, length) => format!(
            "the residual of {rmse:.3} {unit} rms holds something sudden, {} s, which noise does not: it may be a disturbance, a fault of the sensor or {effect}",
            if length > 0.0 {
                format!("from {at:.0} to {:.0}", at + length)
            } else {
                format!("at {at:.0}")
            }
        ),
        Remains::Slow(wander, process) => format!(
            "the residual of {rmse:.3} {unit} rms wanders more slowly than the process: its correlation lasts {}, the slowest time constant is {} s; it may be a disturbance or {effect}",
            if wander < record {
                format!("{} s", two_digits(wander))
            } else {
                "longer than the record".to_string()
            },
            two_digits(process)
        ),
    }
}

/// What a comparison alone can say.
pub(crate) fn of_comparison(diagnosis: &Diagnosis, remains: Option<Remains>) -> Vec<String> {
    let Some(step) = diagnosis.steps.first() else {
        return Vec::new();
    };
    let unit = &diagnosis.output_unit;
    vec![match (diagnosis.verdict, remains) {
        (Verdict::Adequate, _) => format!(
            "The model explains the data: its simulation error of {:.3} {unit} rms looks like noise.",
            step.rmse
        ),
        (_, None) => format!(
            "The model does not explain the data: its simulation error of {:.3} {unit} rms holds more than noise.",
            step.rmse
        ),
        (_, Some(remains)) => format!(
            "The model does not explain the data: {}.",
            left_over(remains, step, diagnosis)
        ),
    }]
}

/// That more effects were found than may be added.
pub(crate) fn of_a_stop(most: usize, needed: usize) -> String {
    format!(
        "The search was stopped at {most} {}: the data call for {needed}.",
        if most == 1 { "effect" } else { "effects" }
    )
}

/// What the colour of the noise costs, where it costs something.
pub(crate) fn of_the_colour(price: f64) -> Option<String> {
    (price >= 1.2).then(|| format!(
        "The noise is coloured, and hides what white noise of the same size would show: an effect has to be about {} times larger to be seen. Smaller ones than the sizes under \"visible from\" may be there.",
        two_digits(price)
    ))
}

/// What there is to say, the verdict first.
pub(crate) fn of_diagnosis(diagnosis: &Diagnosis, remains: Option<Remains>) -> Vec<String> {
    let unit = &diagnosis.output_unit;
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let mut said = Vec::new();
    let held_out = |step: &Step| {
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
                    Some(
                        format!(
                            "{} {:.2} {}",
                            score.effect, score.smallest_visible?, size.unit
                        )
                        .trim_end()
                        .to_string(),
                    )
                })
                .take(4)
                .collect();
            if !visible.is_empty() {
                said.push(format!(
                    "These data would have shown {}.",
                    visible.join(", ")
                ));
            }
        }
        Verdict::Unexplained => said.push(format!(
            "Something is missing, and nothing in the catalogue explains it: {}.",
            remains.map_or_else(
                || format!(
                    "the residual of {:.3} {unit} rms holds more than noise",
                    first.rmse
                ),
                |remains| left_over(remains, first, diagnosis)
            )
        )),
        Verdict::Effect | Verdict::Undecided => {
            for ((effect, group), step) in diagnosis
                .effects
                .iter()
                .zip(&diagnosis.groups)
                .zip(diagnosis.steps.iter().skip(1))
            {
                let size = last
                    .parameters
                    .iter()
                    .find(|parameter| parameter.name.starts_with(&format!("{effect}.")))
                    .map_or(String::new(), |p| {
                        format!(
                            " ({} = {})",
                            p.name.trim_start_matches(&format!("{effect}.")),
                            with_error(p)
                        )
                    });
                let place = step
                    .place
                    .as_ref()
                    .map_or(String::new(), |place| format!(" in the {place} tank"));
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
                    (Some(before), Some(after)) =>
                        format!(", on held-out data from {before:.3} to {after:.3} {unit}"),
                    _ => String::new(),
                }
            ));
            if let Some(remains) = remains {
                said.push(format!(
                    "Something remains: {}.",
                    left_over(remains, last, diagnosis)
                ));
            }
        }
    }
    said
}
