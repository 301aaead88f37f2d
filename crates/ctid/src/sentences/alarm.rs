//! Alarms of the monitor.

use monitor::{Alarm, ScatterAlarm, ScatterEvent, TimeAxis};
use plants::Domain;
use serde::Serialize;

use crate::numbers::significant;

/// An event of the monitor with its sentence, as both are written.
#[derive(Debug, Serialize)]
pub struct Told<'a, T> {
    #[serde(flatten)]
    event: &'a T,
    /// The event in words.
    pub sentence: String,
}

impl<'a> Told<'a, Alarm> {
    /// An alarm; `domain` is that of [`monitor::Monitor::domain`].
    #[must_use]
    pub fn alarm(event: &'a Alarm, domain: Option<Domain>, axis: &TimeAxis) -> Self {
        let sentence = of_alarm(event, domain, axis);
        Self { event, sentence }
    }
}

impl<'a> Told<'a, ScatterAlarm> {
    /// A change of the noise; `domain` as of an alarm.
    #[must_use]
    pub fn scatter(event: &'a ScatterAlarm, domain: Option<Domain>) -> Self {
        let sentence = of_scatter(event, domain);
        Self { event, sentence }
    }
}

/// An alarm of a plant of this domain; without one, of a user's own model.
#[must_use]
pub fn of_alarm(alarm: &Alarm, domain: Option<Domain>, axis: &TimeAxis) -> String {
    if let Some(sentence) = consistent(alarm, domain, axis) {
        return sentence;
    }
    let most = alarm.output.as_ref().map_or(String::new(), |output| {
        let the = if domain.is_some() { "the " } else { "" };
        format!(
            "; the misfit is largest at {the}{}",
            output_words(output, domain)
        )
    });
    let score = format!(
        "(score {:.1}, threshold {:.1})",
        alarm.score, alarm.threshold
    );
    let raised = axis.at(alarm.raised);
    match (domain, alarm.since) {
        (Some(_), _) => format!(
            "The model has not fitted since about {raised} or before, and no effect of the catalogue explains it {score}{most}."
        ),
        (None, Some(since)) => {
            let since = axis.at(since);
            format!("The model does not fit since about {since} {score}{most}.")
        }
        (None, None) => format!("The model does not fit since {raised} or before {score}{most}."),
    }
}

/// The effect that the rows are consistent with; `None` if no effect explains them.
fn consistent(alarm: &Alarm, domain: Option<Domain>, axis: &TimeAxis) -> Option<String> {
    let (since, evidence, size) = (alarm.since?, alarm.evidence?, alarm.size.as_ref()?);
    let unit = if size.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", size.unit)
    };
    let place = match (domain, &size.vessel) {
        (Some(domain), Some(vessel)) if size.at_sensor => {
            format!(", {}", domain.sensor_words(vessel))
        }
        (Some(domain), Some(vessel)) => {
            let (which, kind) = domain.vessel_words(vessel);
            format!(", {which} {kind}")
        }
        _ => String::new(),
    };
    let against = alarm.next.as_ref().map_or(String::new(), |next| {
        format!(
            ", {:.1} against {:.1} for {}",
            evidence, next.evidence, next.effect
        )
    });
    let group = match &alarm.effects[..] {
        [_, others @ ..] if !others.is_empty() => {
            format!("; not yet distinguishable from {}", others.join(", "))
        }
        _ => String::new(),
    };
    Some(format!(
        "Consistent with {} ({} = {}{unit}{place}) since {}{against}{group}.",
        alarm.effects.first().map_or("", String::as_str),
        size.name,
        significant(size.value, 3),
        axis.at(since),
    ))
}

fn output_words(output: &str, domain: Option<Domain>) -> String {
    match domain {
        Some(domain) => domain.sensor_words(output),
        None => format!("output {output}"),
    }
}

/// A change of the noise at an output of a plant of this domain; without one, of a user's own model.
#[must_use]
pub fn of_scatter(scatter: &ScatterAlarm, domain: Option<Domain>) -> String {
    let of = scatter.output.as_ref().map_or(String::new(), |output| {
        format!(" at the {}", output_words(output, domain))
    });
    let written = |value: f64| {
        let number = significant(value, 3);
        format!("{number} {}", scatter.unit).trim_end().to_string()
    };
    match scatter.event {
        ScatterEvent::ScatterGrown => format!(
            "The noise of the readings{of} has grown from {} to {}, without the signature of an effect of the plant: look at the sensor and its cable.",
            written(scatter.learned),
            written(scatter.now)
        ),
        ScatterEvent::ScatterBack => format!(
            "The noise of the readings{of} is back at {}.",
            written(scatter.learned)
        ),
    }
}

#[cfg(test)]
mod tests {
    use monitor::{Other, SCHEMA, Size, Stage, Verdict};

    use super::*;

    fn alarm() -> Alarm {
        Alarm {
            schema: SCHEMA,
            event: Stage::Update,
            time: 4128.0,
            raised: 4050.0,
            since: Some(4000.0),
            verdict: Verdict::Undecided,
            effects: vec!["valve_step".to_string(), "const_leak".to_string()],
            evidence: Some(31.2),
            next: Some(Other {
                effect: "const_leak".to_string(),
                evidence: 29.0,
            }),
            size: Some(Size {
                name: "change".to_string(),
                value: 0.04,
                unit: String::new(),
                vessel: Some("lower".to_string()),
                at_sensor: false,
            }),
            score: 5.7,
            threshold: 5.4,
            output: Some("lower".to_string()),
        }
    }

    #[test]
    fn an_effect_has_its_size_its_place_and_its_alternatives() {
        let axis = TimeAxis::default();
        let mut alarm = alarm();
        assert_eq!(
            of_alarm(&alarm, Some(Domain::Hydraulic), &axis),
            "Consistent with valve_step (change = 0.0400, lower tank) since t = 4000 s, 31.2 against 29.0 for const_leak; not yet distinguishable from const_leak."
        );
        if let Some(size) = &mut alarm.size {
            size.at_sensor = true;
            size.unit = "cm".to_string();
        }
        let said = of_alarm(&alarm, Some(Domain::Hydraulic), &axis);
        assert!(
            said.contains("(change = 0.0400 cm, sensor of the lower tank)"),
            "{said}"
        );
    }

    #[test]
    fn without_an_effect_the_output_and_the_time_are_named() {
        let axis = TimeAxis::default();
        let mut alarm = Alarm {
            evidence: None,
            size: None,
            ..alarm()
        };
        assert_eq!(
            of_alarm(&alarm, None, &axis),
            "The model does not fit since about t = 4000 s (score 5.7, threshold 5.4); the misfit is largest at output lower."
        );
        alarm.since = None;
        assert_eq!(
            of_alarm(&alarm, None, &axis),
            "The model does not fit since t = 4050 s or before (score 5.7, threshold 5.4); the misfit is largest at output lower."
        );
        assert_eq!(
            of_alarm(&alarm, Some(Domain::Hydraulic), &axis),
            "The model has not fitted since about t = 4050 s or before, and no effect of the catalogue explains it (score 5.7, threshold 5.4); the misfit is largest at the sensor of the lower tank."
        );
    }

    #[test]
    fn noise_that_changes_has_both_sizes_and_its_output() {
        let mut scatter = ScatterAlarm {
            schema: SCHEMA,
            event: ScatterEvent::ScatterGrown,
            time: 5858.0,
            output: Some("lower".to_string()),
            learned: 0.12,
            now: 1.01,
            unit: "cm".to_string(),
        };
        assert_eq!(
            of_scatter(&scatter, Some(Domain::Hydraulic)),
            "The noise of the readings at the sensor of the lower tank has grown from 0.120 cm to 1.01 cm, without the signature of an effect of the plant: look at the sensor and its cable."
        );
        (scatter.event, scatter.unit) = (ScatterEvent::ScatterBack, String::new());
        assert_eq!(
            of_scatter(&scatter, None),
            "The noise of the readings at the output lower is back at 0.120."
        );
    }
}
