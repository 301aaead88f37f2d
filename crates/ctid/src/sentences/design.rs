//! Sentences from a design: what the records say so far, and the next experiment.

use effect_search::design::{Kind, Power, Prospect};
use missing_effect::GROUP_MARGIN;
use missing_effect::design::{Alternative, Candidate, Design};
use plants::Domain;

use super::{with_error, with_unit};
use crate::numbers::significant;

/// Criteria with a smaller difference are called equal.
const TWIN: f64 = 0.01;

/// An effect, with its tank if there are two, and its size.
fn sized(alternative: &Alternative, domain: Domain) -> String {
    let size = alternative.size.as_ref().map_or(String::new(), |size| {
        let name = size.name.rsplit('.').next().unwrap_or_default();
        format!(" ({name} = {})", with_error(size))
    });
    format!("{}{size}", named(alternative, domain))
}

/// An effect, with its tank if there are two.
fn named(alternative: &Alternative, domain: Domain) -> String {
    match &alternative.place {
        Some(place) => {
            format!(
                "{} {}",
                alternative.effect,
                domain.place_words(&alternative.effect, place)
            )
        }
        None => alternative.effect.clone(),
    }
}

/// A probability in words, never certain or impossible.
fn probability(p: f64) -> String {
    if p > 0.99 {
        "above 0.99".to_string()
    } else if p < 0.01 {
        "below 0.01".to_string()
    } else {
        format!("about {p:.2}")
    }
}

fn with_power(power: &Power) -> String {
    format!(
        "power {}, a probability to decide of {}",
        significant(power.power, 2),
        probability(power.decides).trim_start_matches("about ")
    )
}

/// Power of an experiment in words, with reservations.
fn promised(candidate: &Candidate) -> String {
    format!("{}{}", with_power(&candidate.power), reservation(candidate))
}

/// Reservation about a power that is not confirmed.
fn reservation(candidate: &Candidate) -> &'static str {
    if candidate.refitted {
        ""
    } else {
        ", not confirmed by a refit"
    }
}

/// A kind of sequence with its settings.
fn described(candidate: &Candidate, unit: &str) -> String {
    let range = format!(
        "between {} and {}",
        significant(candidate.low, 3),
        with_unit(&significant(candidate.high, 3), unit)
    );
    let clock = format!("{} s", significant(candidate.clock, 3));
    let slowly = candidate.slew.map_or(String::new(), |slew| {
        let slew = with_unit(&significant(slew, 2), unit);
        format!(", changed by at most {slew} a second")
    });
    let sequence = match (candidate.kind, candidate.levels) {
        (Kind::Again, _) => format!("what the record had, {range}"),
        (Kind::Step, _) => format!("steps {range}, one every {clock}"),
        (Kind::Staircase, Some(levels)) => {
            format!("a staircase of {levels} levels {range}, up and down, each held for {clock}")
        }
        (Kind::Staircase, None) => format!("a staircase {range}, each level held for {clock}"),
        (Kind::Binary, _) => {
            format!("a pseudo-random binary sequence {range} with a clock period of {clock}")
        }
        (Kind::MultiLevel, _) => {
            format!("a sequence of many levels drawn {range}, each held for {clock}")
        }
        (Kind::Constant, _) => format!("a constant value {range}"),
    };
    sequence + &slowly
}

/// Evidence in the existing records.
fn so_far(design: &Design) -> Vec<String> {
    let domain = design.domain();
    let [a, b] = &design.between;
    let mut said = Vec::new();
    let ahead = significant(design.bic_ahead.abs(), 2);
    let (first, second) = if design.bic_ahead < 0.0 {
        (b, a)
    } else {
        (a, b)
    };
    said.push(if design.bic_ahead.abs() > GROUP_MARGIN {
        format!(
            "The existing records decide for {}: the criterion of {} is higher by {ahead}.",
            sized(first, domain),
            sized(second, domain)
        )
    } else if design.bic_ahead.abs() < TWIN {
        format!(
            "The existing records leave it open: {} and {} fit equally well.",
            sized(first, domain),
            sized(second, domain)
        )
    } else {
        format!(
            "The existing records leave it open: {} fits best, the criterion of {} is higher by only {ahead}.",
            sized(first, domain),
            sized(second, domain)
        )
    });
    for alternative in [a, b] {
        if alternative.bic_gain < GROUP_MARGIN {
            let called = if alternative.bic_gain < 0.0 {
                format!(
                    "the criterion is higher with it, by {:.0}",
                    -alternative.bic_gain
                )
            } else {
                format!(
                    "it lowers the criterion by only {:.0}",
                    alternative.bic_gain
                )
            };
            let edge = if alternative.at_the_edge {
                ", and its size is at a bound of its plausible range"
            } else {
                ""
            };
            said.push(format!(
                "They do not support {}: {called}{edge}. A very small effect cannot be distinguished from others.",
                named(alternative, domain)
            ));
        }
    }
    said
}

/// The design in sentences: what the existing records say, the next experiment, and alternatives to it.
#[must_use]
pub fn of_design(design: &Design) -> Vec<String> {
    let mut said = so_far(design);
    let unit = &design.experiment.unit;
    let domain = design.domain();
    let [a, b] = &design.between;
    let Some(best) = design.candidates.first() else {
        return said;
    };
    let applied = if design.in_loop {
        "reference"
    } else {
        "command"
    };
    if design.twins() {
        said.push(format!(
            "{} distinguishes them: in the best of {} experiments the criterion is expected to differ by only {}, because {} with other parameters gives nearly the response of {}.",
            if design.effort.left_out.is_empty() {
                "No experiment within these limits"
            } else {
                "No experiment that was tried"
            },
            design.candidates.len(),
            significant(best.power.power, 1),
            if best.power.if_true[0] < best.power.if_true[1] { named(b, domain) } else { named(a, domain) },
            if best.power.if_true[0] < best.power.if_true[1] { named(a, domain) } else { named(b, domain) },
        ));
    } else {
        let first = design.experiment.values.first().copied();
        said.push(format!(
            "The next experiment: {}, {} samples of {} s. Let the plant settle at a {applied} of {} first.",
            described(best, unit),
            design.experiment.values.len(),
            significant(design.limits.interval, 3),
            with_unit(&significant(first.unwrap_or(f64::NAN), 3), unit)
        ));
        let levels: Vec<String> = best
            .reaches
            .iter()
            .map(|reach| {
                format!(
                    "{} moves between {} and {}",
                    domain.level_words(&reach.level),
                    significant(reach.low, 3),
                    with_unit(&significant(reach.high, 3), &design.output_unit)
                )
            })
            .collect();
        said.push(format!("In it {}.", levels.join(", ")));
        said.push(format!(
            "All records together then decide for the true one with a probability {} (power {}{}): {}.",
            of_probability(best.power.decides),
            significant(best.power.power, 2),
            reservation(best),
            match design.prospect {
                _ if design.bic_ahead.abs() > GROUP_MARGIN => "it is not needed to distinguish them",
                Prospect::Decides => "apply it",
                Prospect::May => "it is worth applying, and may leave the question open",
                _ => "it is unlikely to decide",
            }
        ));
        if let Some(times) = design.times_as_long {
            said.push(format!(
                "Applied {times} times, it would decide between them."
            ));
        }
    }
    if design.overfull > 0 {
        said.push(format!(
            "{} left out: a level would rise above the tank.",
            match design.overfull {
                1 => "One experiment was".to_string(),
                n => format!("{n} experiments were"),
            }
        ));
    }
    if design.limited > 0 {
        said.push(format!(
            "{} left out: the controller would reach a limit, which opens the loop.",
            match design.limited {
                1 => "One experiment was".to_string(),
                n => format!("{n} experiments were"),
            }
        ));
    }
    if let Some(again) = &design.again {
        said.push(format!(
            "The same as before once more would give {}.",
            promised(again)
        ));
    }
    let wider = design.wider.as_ref();
    if let Some(wider) = wider.filter(|_| design.prospect != Prospect::Decides) {
        said.push(format!(
            "With --range {} {} the best would give {}.",
            significant(wider.low, 3),
            significant(wider.high, 3),
            promised(&wider.best)
        ));
    }
    if let Some(second) = &design.second_sensor {
        said.push(format!(
            "With {} measured too, with the same noise: in records like the existing ones {} (instead of {}), in the best experiment {}.",
            domain.level_words(&second.level),
            with_power(&second.existing_with),
            with_power(&second.existing_without),
            with_power(&second.best_with)
        ));
    }
    if design.prospect != Prospect::Decides && domain == Domain::Hydraulic {
        said.push("Without an experiment, at the plant:".to_string());
        said.extend(
            [a, b].map(|alternative| format!("{}: {}", alternative.effect, alternative.confirm)),
        );
    }
    said
}

/// A probability after the words "with a probability".
fn of_probability(p: f64) -> String {
    let said = probability(p);
    if said.starts_with("about") {
        format!("of {said}")
    } else {
        said
    }
}
