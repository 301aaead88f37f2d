//! Structure in the residual of a model that is not noise.

use ct_signals::duration;

use super::rms;
use crate::{
    Diagnosis, PerOutput, Step,
    diagnostics::residual_tests::{NotNoise, Pattern},
    numbers::significant,
};

/// Structure in the residual of a step, as the end of a sentence.
pub(super) fn left_over(left: NotNoise, step: &Step, diagnosis: &Diagnosis) -> String {
    // A comparison has not searched the catalogue.
    let effect = if diagnosis.scores.is_empty() {
        "an effect that the model lacks"
    } else {
        "an effect outside the catalogue"
    };
    // With several outputs, the output with the structure.
    let shown = step.rmse_per_output.0.get(left.output);
    let shown = PerOutput(shown.cloned().into_iter().collect());
    let residual = rms(&shown, &diagnosis.output_unit);
    let at = if step.rmse_per_output.0.len() > 1 {
        format!(" of {}", shown.0.first().map_or("", |(name, _)| name))
    } else {
        String::new()
    };
    let record = diagnosis
        .records
        .iter()
        .filter_map(|record| Some(record.time.last()? - record.time.first()?))
        .fold(0.0, f64::max);
    let several = diagnosis
        .records
        .iter()
        .filter(|record| !record.held_out)
        .count()
        > 1;
    let name = left
        .record
        .filter(|_| several)
        .and_then(|k| diagnosis.records.get(k));
    let residual = format!(
        "the residual{at} of {residual}{}",
        name.map_or(String::new(), |record| format!(" (in {})", record.name))
    );
    match left.what {
        Pattern::Input => format!("{residual} depends on the input"),
        Pattern::Period(period) => format!(
            "{residual} oscillates with a period of about {}, which noise does not explain: it may be a disturbance or {effect}",
            about(period)
        ),
        Pattern::Instant(at, length) => format!(
            "{residual} has an abrupt change, {}, which noise does not explain: it may be a disturbance, a fault of the sensor or {effect}",
            if length > 0.0 {
                diagnosis.clock.span(at, at + length)
            } else {
                format!("at {}", diagnosis.clock.at(at))
            }
        ),
        Pattern::Level => format!(
            "{residual} depends on the {}, which noise does not explain: the balance lacks {effect}",
            diagnosis.domain().level_words("level")
        ),
        Pattern::Slow(wander, process) => format!(
            "{residual} drifts: its correlation time of {} reaches the slowest time constant, {}; it may be a disturbance or {effect}",
            if wander < record {
                about(wander)
            } else {
                "longer than the record".to_string()
            },
            about(process)
        ),
    }
}

/// A time with two significant digits: in seconds below two hours.
pub(super) fn about(seconds: f64) -> String {
    if seconds.abs() < 7200.0 {
        format!("{} s", significant(seconds, 2))
    } else {
        duration(seconds)
    }
}
