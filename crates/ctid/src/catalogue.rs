//! `ctid effects`: the catalogue of effects, and the description of one effect.

use ct_signals::quoted;
use plants::{CATALOGUE, Domain, EffectInfo, Known, ParameterInfo, Place, Placed, Plant};

use crate::look::{Look, Side, table};
use crate::model_file::{self, ModelFile};
use crate::symptoms::{Sought, best};
use crate::{Error, generic, names, numbers, signature};

/// The whole catalogue, by place: the effects of tanks, then those at the ports of models of the user's own.
#[must_use]
pub fn list(look: Look) -> String {
    let tanks = listed(Domain::Hydraulic, |_| true, look);
    format!("{tanks}{}{}", generic::list(look), says_more(look))
}

/// The effects that may be added to a model, by place, in the terms of its physical domain.
#[must_use]
pub fn list_for(model: &ModelFile, look: Look) -> String {
    listed(model.domain(), |effect| offered(model, effect), look) + &says_more(look)
}

fn says_more(look: Look) -> String {
    look.paragraph(
        "",
        "`ctid effects EFFECT` says more of one: its equation, its parameters, how to confirm it.",
    )
}

fn offered(model: &ModelFile, effect: &'static EffectInfo) -> bool {
    model.domain().offers(effect)
        && effect.sites(model.plant, &model.known).next().is_some()
        && model.effects.iter().all(|on| on.effect.id != effect.id)
}

/// The effects that match a description of a symptom, best first: with a model, those that may be added to it; without one, those of tanks,
/// then those at the ports of models of the user's own.
///
/// # Errors
/// Where none does.
pub(crate) fn like(
    sought: &Sought,
    model: Option<&ModelFile>,
    look: Look,
) -> Result<String, Error> {
    let domain = model.map_or(Domain::Hydraulic, ModelFile::domain);
    let all = CATALOGUE.iter().copied();
    let all = all.filter(|effect| model.is_none_or(|model| offered(model, effect)));
    let found = best(all, |effect| sought.score_of_plant(effect));
    let at_ports = match model {
        None => generic::like(sought, look),
        Some(_) => String::new(),
    };
    if found.is_empty() && at_ports.is_empty() {
        return Err(sought.nothing());
    }
    let widest = found.iter().map(|effect| effect.id.len()).max();
    let rows = found
        .iter()
        .map(|effect| row(effect, domain, widest.unwrap_or(0), look));
    Ok(rows.collect::<String>() + &at_ports)
}

/// Describes one effect of the catalogue.
fn row(effect: &EffectInfo, domain: Domain, widest: usize, look: Look) -> String {
    let first = format!(
        "  {}{}  ",
        look.strong(effect.id),
        " ".repeat(widest - effect.id.len())
    );
    look.paragraph(&first, effect.in_words(domain))
}

fn listed(domain: Domain, offered: impl Fn(&'static EffectInfo) -> bool, look: Look) -> String {
    let widest = CATALOGUE.iter().map(|effect| effect.id.len()).max();
    let widest = widest.unwrap_or(0);
    let mut text = String::new();
    let headings = match domain {
        Domain::Hydraulic => [
            "actuator: between the command and the inflow",
            "vessel: in its balance",
            "sensor: between the level and the reading",
        ],
        Domain::General => ["actuator", "process", "sensor"],
    };
    let places = [Place::Actuator, Place::Vessel, Place::Sensor];
    for (place, heading) in places.into_iter().zip(headings) {
        text += &format!("{}\n", look.heading(heading));
        let here = CATALOGUE.iter().filter(|effect| effect.place == place);
        for effect in here.filter(|effect| offered(effect)) {
            text += &row(effect, domain, widest, look);
        }
        text.push('\n');
    }
    text
}

/// Everything the catalogue knows of an effect: of tanks, at the ports of models of the user's own, or both.
///
/// # Errors
/// If no effect has this name.
pub fn describe(id: &str, look: Look) -> Result<String, Error> {
    let tanks = EffectInfo::find(id).map(|effect| of_tanks(effect, look));
    let at_ports = generic::matching(id).into_iter();
    let at_ports = at_ports.map(|effect| generic::description(effect, look));
    let all: Vec<String> = tanks.into_iter().chain(at_ports).collect();
    if all.is_empty() {
        return Err(Error::UnknownEffect(names::unknown_everywhere(id)));
    }
    Ok(all.join("\n"))
}

/// Everything the catalogue knows of an effect of a plant, and whether it can act in this model.
///
/// # Errors
/// Where plants have no effect of that name.
pub(crate) fn describe_for(id: &str, model: &ModelFile, look: Look) -> Result<String, Error> {
    let effect = match EffectInfo::find(id) {
        None if !generic::matching(id).is_empty() => {
            return Err(Error::UnknownEffect(format!(
                "\"{}\" is for models of your own (model = \"x.mo\"): `ctid effects` without --model describes it, --model lists those of {}",
                quoted(id),
                model.plant.id()
            )));
        }
        _ => names::effect(id)?,
    };
    let here = if model.effects.iter().any(|on| on.effect.id == effect.id) {
        "it is in this model"
    } else if offered(model, effect) {
        "it can act in this model"
    } else {
        "it cannot act in this model"
    };
    let entry = format!("  {}", look.faint(format!("{:<14}", "here")));
    Ok(of_tanks(effect, look) + &look.paragraph(&entry, here))
}

fn of_tanks(effect: &'static EffectInfo, look: Look) -> String {
    let entry = |name: &str, what: &str| {
        look.paragraph(&format!("  {}", look.faint(format!("{name:<14}"))), what)
    };
    let mut text = format!("{}\n", look.heading(effect.id));
    text += &look.paragraph("  ", effect.physics);
    text.push('\n');
    text += &entry("equation", effect.equation);
    text += &entry("where", &place(effect));
    text += &entry(
        "plants",
        &applies_to(effect)
            .map(Plant::id)
            .collect::<Vec<_>>()
            .join(", "),
    );
    let elsewhere = "not offered for linear plants whose output is not a level";
    text += &entry("no tank", effect.general.unwrap_or(elsewhere));
    text.push('\n');
    text += &parameters(effect, look);
    text.push('\n');
    let confused = if effect.confused_with.is_empty() {
        "nothing in the catalogue".to_string()
    } else {
        effect.confused_with.join(", ")
    };
    text += &entry("confused with", &confused);
    text += &entry("confirm", effect.confirm);
    text += &entry("source", effect.source);
    text.push('\n');
    if let Some(picture) = signature::picture(effect, look) {
        text += &picture;
        text.push('\n');
    }
    text += &entry(
        "add it",
        &format!("ctid add {} --model MODEL.toml", effect.id),
    );
    text
}

/// The signatures of all effects as a page of Markdown, for `docs/gallery.md`.
#[must_use]
pub fn gallery() -> String {
    let mut text = String::new();
    for effect in CATALOGUE {
        if let Some(picture) = signature::picture(effect, Look::plain()) {
            text += &format!("### `{}`\n\n```text\n{picture}```\n\n", effect.id);
        }
    }
    text
}

fn applies_to(effect: &'static EffectInfo) -> impl Iterator<Item = Plant> {
    Plant::ALL
        .into_iter()
        .filter(|&plant| effect.sites(plant, &Known::default()).next().is_some())
}

fn place(effect: &'static EffectInfo) -> String {
    match effect.place {
        Place::Actuator => "at the actuator, between the command and the inflow; with two pumps, choose one: `ctid add --where pump_1|pump_2`".to_string(),
        Place::Vessel => {
            let names = |vessels: usize| {
                let several = applies_to(effect).find(|plant| plant.vessels() == vessels);
                several.map_or(Vec::new(), |plant| {
                    let sites = effect.sites(plant, &Known::default());
                    let names = sites.filter_map(|vessel| plant.vessel_name(vessel));
                    names.collect::<Vec<_>>()
                })
            };
            let of_two = match names(2)[..] {
                [] => "in the balance of a single vessel".to_string(),
                [only] => format!("in a vessel's balance; with two vessels, the {only} one"),
                _ => "in a vessel's balance; with two vessels, choose one: `ctid add --where upper|lower`"
                    .to_string(),
            };
            match &names(3)[..] {
                [] => of_two,
                [only] => format!("{of_two}; with three tanks, {only}"),
                _ => format!("{of_two}; with three tanks, choose one: `T1|T2|T3`"),
            }
        }
        Place::Sensor => {
            "at the sensor, between the level and the reading; where several levels are measured at that of the last, or `ctid add --where upper|T1|...`"
                .to_string()
        }
    }
}

/// The parameters of the effect on any plant, in any vessel.
fn parameters(effect: &'static EffectInfo, look: Look) -> String {
    let mut all: Vec<ParameterInfo> = Vec::new();
    for plant in applies_to(effect) {
        let structure = model_file::any_structure(plant, &Known::default(), true);
        for vessel in effect.sites(plant, &Known::default()) {
            for info in structure.effect_parameters(Placed { effect, vessel }) {
                if all.iter().all(|known| known.name != info.name) {
                    all.push(info);
                }
            }
        }
    }
    let heading = ["parameter", "unit", "absent at", "meaning"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for info in all {
        let unit = info.unit.label("level", "input", false);
        rows.push(vec![
            info.name.to_string(),
            if unit.is_empty() {
                "1".to_string()
            } else {
                unit
            },
            absent(info.absent),
            info.meaning.to_string(),
        ]);
    }
    table(&[Side::Left, Side::Left, Side::Right, Side::Left], &rows)
        .iter()
        .map(|line| format!("  {line}\n"))
        .collect()
}

fn absent(value: f64) -> String {
    match value {
        f64::INFINITY => "never reached".to_string(),
        value if value.is_nan() => "any".to_string(),
        value => numbers::significant(value, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_listed_and_described_within_the_width() {
        let look = Look::plain();
        let all = list(look);
        for effect in CATALOGUE {
            assert!(all.contains(effect.id));
            let text = describe(effect.id, look).unwrap();
            for word in ["equation", "parameter", "absent at", "confirm", "source"] {
                assert!(text.contains(word), "{text}");
            }
        }
        assert!(all.lines().all(|line| line.chars().count() <= 80), "{all}");
    }

    #[test]
    fn a_slip_is_answered_with_the_name() {
        let error = describe("overfow", Look::plain()).unwrap_err().to_string();
        assert!(error.contains("did you mean overflow?"), "{error}");
        for (slip, meant) in [
            ("radiaton", "radiation"),
            ("qantisation(y)", "quantisation"),
        ] {
            let error = describe(slip, Look::plain()).unwrap_err().to_string();
            assert!(error.contains(&format!("did you mean {meant}?")), "{error}");
        }
    }

    #[test]
    fn an_effect_of_tanks_and_of_ports_is_described_as_both() {
        let text = describe("overflow", Look::plain()).unwrap();
        assert!(text.contains("ctid add overflow --model"), "{text}");
        assert!(text.contains("overflow(h1,h2)"), "{text}");
    }

    #[test]
    fn a_symptom_finds_effects_of_tanks_and_of_ports() {
        let like = |words: &str| like(&Sought::of(words), None, Look::plain()).unwrap();
        assert!(
            like("radiation")
                .trim_start()
                .starts_with("radiation(T,Ta)")
        );
        let clog = like("clog");
        let tank = clog.find("valve_drift").unwrap();
        assert!(tank < clog.find("drift(p)").unwrap(), "{clog}");
    }

    #[test]
    fn a_plant_has_its_own_effects_only() {
        let text = "plant = \"single-tank\"\neffects = [\"overflow\"]\n";
        let model = model_file::parse("m.toml", text).unwrap();
        let of = |id: &str| describe_for(id, &model, Look::plain());
        assert!(of("overflow").unwrap().contains("it is in this model"));
        assert!(of("pump_lag").unwrap().contains("it can act in this model"));
        let error = of("radiation").unwrap_err().to_string();
        assert!(error.contains("for models of your own"), "{error}");
    }
}
