//! Properties that have to agree between a saved state and the model, with the names of the model file, and their differences.

use std::collections::{BTreeMap, BTreeSet};

use greybox::PriorValue;

use crate::Model;

/// For a user's own model: the seconds in one unit of its time.
pub(crate) const TIME_UNIT: &str = "unit of time, s";

/// A longer value is not quoted: a term may have 512 knots.
const LONGEST: usize = 60;

/// Each entry of the model file with its value, printed with all digits.
pub(crate) type Fingerprint = BTreeMap<String, String>;

/// The entries of a model.
pub(crate) fn fingerprint(model: &Model) -> Fingerprint {
    let mut all = Fingerprint::new();
    let mut add = |key: &str, value: Option<String>| {
        if let Some(value) = value {
            all.insert(key.to_string(), value);
        }
    };
    let number = |value: Option<f64>| value.map(|value| value.to_string());
    let (plant, known) = (model.plant, &model.known);
    add("plant", Some(plant.id().to_string()));
    add("hold", Some(format!("{:?}", model.hold).to_lowercase()));
    let areas: &[&str] = match plant.vessels() {
        1 => &["area"],
        2 => &["area_upper", "area_lower"],
        _ => &["area_1", "area_3", "area_2"],
    };
    for (key, &area) in areas.iter().zip(&known.area) {
        add(key, number(area));
    }
    let measured = known.measured.iter();
    let measured: Vec<&str> = measured
        .filter_map(|&vessel| plant.vessel_name(vessel))
        .collect();
    add(
        "measured",
        (!measured.is_empty()).then(|| measured.join(", ")),
    );
    add("pipe_area sqrt(2 gravity)", number(known.orifice));
    add("tank_height", number(known.tank_height));
    add("input_range", number(known.input_range));
    let effects = model.effects.iter().map(|placed| {
        let place = placed.place_name(plant, known);
        placed.effect.id.to_string() + &place.map_or(String::new(), |place| format!(" ({place})"))
    });
    let terms = model.terms.iter().map(|term| term.name.clone());
    let on: Vec<String> = effects.chain(terms).collect();
    add("effects", (!on.is_empty()).then(|| on.join(", ")));
    for term in &model.terms {
        add(&format!("term.{}", term.name), Some(format!("{term:?}")));
    }
    for (name, value) in &model.start {
        add(&format!("start of {name}"), Some(value.to_string()));
    }
    for (name, PriorValue { value, std_error }) in &model.priors {
        add(
            &format!("prior of {name}"),
            Some(format!("{value} +- {std_error}")),
        );
    }
    let fixed = model.fixed.join(", ");
    add("fixed", (!fixed.is_empty()).then_some(fixed));
    all
}

/// The entries that differ, in words.
pub(crate) fn differences(then: &Fingerprint, now: &Fingerprint) -> String {
    let keys: BTreeSet<&String> = then.keys().chain(now.keys()).collect();
    let said = |value: Option<&String>| value.map_or("none", String::as_str).to_string();
    let lines = keys.into_iter().filter_map(|key| {
        let (then, now) = (then.get(key), now.get(key));
        let long = [then, now]
            .into_iter()
            .flatten()
            .any(|value| value.len() > LONGEST);
        (then != now).then(|| match (then, now) {
            (Some(_), Some(_)) if long => format!("{key}: another then"),
            (Some(_), None) if long => format!("{key}: one then, none now"),
            (None, Some(_)) if long => format!("{key}: none then, one now"),
            _ => format!("{key}: {} then, {} now", said(then), said(now)),
        })
    });
    lines.collect::<Vec<_>>().join("; ")
}
