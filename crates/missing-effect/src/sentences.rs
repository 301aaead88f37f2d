//! The findings in words.

use crate::{Diagnosis, Parameter, Step, Unknown, Verdict, remains::Remains};

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

/// What there is to say, the verdict first.
pub(crate) fn of_diagnosis(diagnosis: &Diagnosis, remains: Option<Remains>) -> Vec<String> {
    let unit = &diagnosis.output_unit;
    let (Some(first), Some(last)) = (diagnosis.steps.first(), diagnosis.steps.last()) else {
        return Vec::new();
    };
    let mut said = Vec::new();
    let shaped = diagnosis.unknown.as_ref().map(of_unknown);
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
    said.extend(shaped);
    said
}

/// Where what is missing acts, on what it depends, and what it looks like.
fn of_unknown(unknown: &Unknown) -> String {
    let place = |name: &str| match name {
        "actuator" => "at the actuator".to_string(),
        "sensor" => "at the sensor".to_string(),
        "vessel" => "in the vessel's balance".to_string(),
        which => format!("in the balance of the {which} tank"),
    };
    let mut said = format!("What is missing acts {}", place(&unknown.place));
    let others: Vec<String> = unknown
        .places
        .iter()
        .filter(|other| {
            other.below_best < crate::unknown::SAME_PLACE && other.place != unknown.place
        })
        .map(|other| place(&other.place))
        .collect();
    if !others.is_empty() && unknown.variable == "time" {
        said += &format!(
            " (or {}: the likelihood does not tell)",
            others.join(" or ")
        );
    }
    if unknown.variable == "time" {
        said += " and follows no variable of the plant, so that it is a function of time";
        if let Some(window) = unknown.windows.first() {
            said += &format!(
                ": most from {:.0} to {:.0} s, {} {} on average",
                window.from,
                window.to,
                two_digits(window.mean),
                unknown.unit
            );
        }
    } else {
        let variable = match (unknown.variable, unknown.place.as_str()) {
            ("input", _) => "the command",
            ("rate", _) => "the net inflow",
            (_, "sensor") => "the reading",
            _ => "the level",
        };
        said += &format!(" and depends on {variable}");
        if let Some(share) = unknown.shares.first() {
            said += &format!(
                ", which predicts {:.0} ± {:.0} % of it on data that were left out",
                100.0 * share.share.min(1.0),
                (100.0 * share.std_error).max(1.0)
            );
        }
        let (low, high) = unknown
            .ordinates
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(*v), high.max(*v))
            });
        said += &format!(
            "; it ranges over {} {}",
            two_digits(high - low),
            unknown.unit
        );
    }
    match &unknown.primitive {
        Some(nearest) => {
            said += &format!("; the nearest simple shape is a {}", nearest.name);
            if let Some(at) = nearest.at {
                let (at, unit) = (two_digits(at), &unknown.variable_unit);
                said += &match nearest.name {
                    "swing" => format!(" of a period of {at} {unit}"),
                    "end of a range" => format!(" below {at} {unit}"),
                    _ => format!(" at {at} {unit}"),
                };
            }
            if !nearest.effects.is_empty() {
                said += &format!(
                    " ({} would leave one)",
                    list(
                        &nearest
                            .effects
                            .iter()
                            .map(|e| (*e).to_string())
                            .collect::<Vec<_>>()
                    )
                );
            }
        }
        None => said += "; no simple shape comes near",
    }
    said + "."
}
