//! The unexplained error, if no effect of the catalogue explains it.

use ct_signals::Clock;
use missing_effect::{PLACE_MARGIN, Unknown};
use plants::Domain;

use super::list;
use crate::numbers::significant;

/// Place, variable and shape of the unexplained error.
pub(super) fn of_unknown(unknown: &Unknown, clock: &Clock, domain: Domain) -> String {
    let place = |name: &str| match name {
        "actuator" => "at the actuator".to_string(),
        "sensor" => "at the sensor".to_string(),
        "vessel" if domain == Domain::General => "in the balance".to_string(),
        "vessel" => "in the vessel's balance".to_string(),
        which => {
            if let Some(read) = which.strip_prefix("sensor ") {
                return format!("at the {}", domain.sensor_words(read));
            }
            let (which, kind) = domain.vessel_words(which);
            format!("in the balance of the {which} {kind}")
        }
    };
    let mut said = format!("What is missing acts {}", place(&unknown.place));
    let others: Vec<String> = unknown
        .places
        .iter()
        .filter(|other| other.below_best < PLACE_MARGIN && other.place != unknown.place)
        .map(|other| place(&other.place))
        .collect();
    if !others.is_empty() && unknown.variable == "time" {
        said += &format!(
            " (or {}: the likelihood does not distinguish the places)",
            others.join(" or ")
        );
    }
    if unknown.variable == "time" {
        said += " and depends on no variable of the plant, so it is a function of time";
        if let Some(window) = unknown.windows.first() {
            said += &format!(
                ": most {}, {} {} on average",
                clock.span(window.from, window.to),
                significant(window.mean, 2),
                unknown.unit
            );
        }
    } else {
        let variable = match (unknown.variable, unknown.place.as_str()) {
            ("input", _) => "the command",
            ("rate", _) if domain == Domain::General => "the rate of change",
            ("rate", _) => "the net inflow",
            (_, place) if place.starts_with("sensor") => "the reading",
            _ => &format!("the {}", domain.level_words("level")),
        };
        said += &format!(" and depends on {variable}");
        if let Some(share) = unknown.shares.first() {
            said += &format!(
                ", which predicts {:.0} ± {:.0} % of it on data that were left out",
                100.0 * share.share.min(1.0),
                (100.0 * share.std_error).max(1.0)
            );
        }
        let (low, high) = ct_signals::range_of(&unknown.ordinates);
        said += &format!(
            "; it ranges over {} {}",
            significant(high - low, 2),
            unknown.unit
        );
    }
    match &unknown.primitive {
        Some(nearest) => {
            said += &format!("; the nearest simple shape is a {}", nearest.name);
            if let Some(at) = nearest.at {
                let (at, unit) = (significant(at, 2), &unknown.variable_unit);
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
                            .collect::<Vec<_>>(),
                        "or"
                    )
                );
            }
        }
        None => said += "; no simple shape fits",
    }
    said + "."
}
