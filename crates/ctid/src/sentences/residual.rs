//! Structure in the residual of a model that is not noise.

use ct_signals::duration;
use missing_effect::{Diagnosis, NotNoise, PerOutput, Step};

use super::rms;
use crate::numbers::significant;

/// Why the residual of a model (a step of the diagnosis) is not noise, as the end of a sentence.
pub(super) fn left_over(left: &NotNoise, step: &Step, diagnosis: &Diagnosis) -> String {
    let effect = if diagnosis.searched() {
        "an effect outside the catalogue"
    } else {
        "an effect that the model lacks"
    };
    // With several outputs, the output with the structure.
    let errors = step.rmse_per_output.0.iter();
    let shown = errors.filter(|(name, _)| name == left.output());
    let shown = PerOutput(shown.take(1).cloned().collect());
    let residual = rms(&shown, &diagnosis.output_unit);
    let at = if step.rmse_per_output.0.len() > 1 {
        format!(" of {}", left.output())
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
    let name = left.record().filter(|_| several);
    let residual = format!(
        "the residual{at} of {residual}{}",
        name.map_or(String::new(), |record| format!(" (in {record})"))
    );
    match left {
        NotNoise::Input { .. } => format!("{residual} depends on the input"),
        NotNoise::Period { period, .. } => format!(
            "{residual} oscillates with a period of about {}, which noise does not explain: it may be a disturbance or {effect}",
            about(*period)
        ),
        NotNoise::Instant { from, to, .. } => format!(
            "{residual} has an abrupt change, {}, which noise does not explain: it may be a disturbance, a fault of the sensor or {effect}",
            if to > from {
                diagnosis.clock.span(*from, *to)
            } else {
                format!("at {}", diagnosis.clock.at(*from))
            }
        ),
        NotNoise::Level { .. } => format!(
            "{residual} depends on the {}, which noise does not explain: the balance lacks {effect}",
            diagnosis.domain().level_words("level")
        ),
        NotNoise::Slow {
            correlation_time,
            time_constant,
            ..
        } => format!(
            "{residual} drifts: its correlation time ({}) exceeds the slowest time constant of the model ({}); it may be a disturbance or {effect}",
            if *correlation_time < record {
                about(*correlation_time)
            } else {
                "longer than the record".to_string()
            },
            about(*time_constant)
        ),
    }
}

/// A time with two significant digits: in seconds below two hours.
fn about(seconds: f64) -> String {
    if seconds.abs() < 7200.0 {
        format!("{} s", significant(seconds, 2))
    } else {
        duration(seconds)
    }
}
