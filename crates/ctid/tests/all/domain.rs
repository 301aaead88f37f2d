//! Effects of tanks are offered for tanks only.

use plants::{CATALOGUE, Domain};
use serde_json::Value;

use crate::common::{Place, Random};

const PLANT: &str = "plant = \"first-order\"\n";

/// A heated block, and a heater that cuts out at 75: `tau dT/dt = K u - T`, `T` above the room, read with noise.
fn heated_block(unit: &str) -> String {
    const ROWS: usize = 400;
    let mut random = Random(7);
    let (mut temperature, mut power) = (40.0, 20.0);
    let mut text = format!("t [s],u [%],T [{unit}]\n");
    for k in 0..ROWS {
        if k % 40 == 0 {
            power = 10.0 + 45.0 * random.uniform();
        }
        let reading = temperature + 0.1 * random.normal();
        text += &format!("{},{power:.3},{reading:.4}\n", 5 * k);
        for _ in 0..500 {
            let heater = if temperature < 75.0 { power } else { 0.0 };
            temperature += 0.01 * (2.0 * heater - temperature) / 60.0;
        }
    }
    text
}

fn model(unit: &str) -> String {
    format!("{PLANT}[columns]\noutput = \"T [{unit}]\"\n")
}

/// Identifiers of all effects in a diagnosis.
fn named(result: &Value) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    let list = |value: &Value| -> Vec<String> {
        let values = value.as_array().unwrap().iter();
        values.map(|id| id.as_str().unwrap().to_string()).collect()
    };
    all.extend(list(&result["effects"]));
    all.extend(list(&result["ranked"]));
    all.extend(result["groups"].as_array().unwrap().iter().flat_map(list));
    let scores = result["scores"].as_array().unwrap().iter();
    all.extend(scores.map(|score| score["effect"].as_str().unwrap().to_string()));
    for weighting in ["white", "prewhitened"] {
        all.extend(list(&result["rankings"][weighting]));
    }
    all
}

/// Words about tanks in a text, without the identifiers of effects and parameters.
fn words_of_tanks(text: &str) -> Vec<String> {
    let plain = text.to_lowercase().replace("level(0)", "");
    let plain = CATALOGUE
        .iter()
        .fold(plain, |text, effect| text.replace(effect.id, ""));
    let words = plain.split(|c: char| !c.is_alphabetic());
    let of_tanks = ["pump", "tank", "valve", "level", "leak", "water", "vessel"];
    let found = words.filter(|word| of_tanks.contains(&word.trim_end_matches('s')));
    found.map(str::to_string).collect()
}

#[test]
fn a_heated_block_is_offered_general_effects_only() {
    let place = Place::empty();
    place.write("block.csv", heated_block("degC"));
    place.write("block.toml", format!("{PLANT}[columns]\noutput = \"T\"\n"));
    let text = place.succeeds("diagnose block.csv --model block.toml --json d.json");
    let result = place.json("d.json");
    let named = named(&result);
    for effect in CATALOGUE {
        let offered = Domain::General.offers(effect);
        assert!(offered || named.iter().all(|id| id != effect.id), "{text}");
    }
    // The available effects are scored.
    for id in ["sensor_saturation", "pump_saturation", "const_leak"] {
        assert!(named.iter().any(|known| known == id), "{named:?}");
    }
    assert!(!text.contains("overflow"), "{text}");
    assert_eq!(words_of_tanks(&text), Vec::<String>::new(), "{text}");
}

#[test]
fn the_same_numbers_in_cm_are_offered_the_effects_of_tanks() {
    let place = Place::empty();
    place.write("block.csv", heated_block("cm"));
    place.write("block.toml", format!("{PLANT}[columns]\noutput = \"T\"\n"));
    let text = place.succeeds("diagnose block.csv --model block.toml --json d.json");
    let named = named(&place.json("d.json"));
    for id in ["overflow", "leak_at_height", "area_varies", "sqrt_outflow"] {
        assert!(named.iter().any(|known| known == id), "{named:?}");
    }
    assert!(text.contains("overflow"), "{text}");
}

#[test]
fn an_effect_of_tanks_is_not_added_to_what_is_none() {
    let place = Place::empty();
    place.write("m.toml", model("degC"));
    place.refuses(
        "add overflow --model m.toml",
        &["m.toml", "overflow", "in degC", "ctid effects --model"],
    );
    assert_eq!(place.read("m.toml"), model("degC"));
    place.succeeds("add pump_saturation --model m.toml");
    for unit in ["%", "l", "m3", "cm"] {
        place.write("m.toml", model(unit));
        place.succeeds("add overflow --model m.toml");
    }
    place.write("m.toml", PLANT);
    place.succeeds("add overflow --model m.toml");
    // A root of a level in volts is one: the plant says it.
    place.write(
        "m.toml",
        "plant = \"single-tank\"\n[columns]\noutput = \"y [V]\"\n",
    );
    place.succeeds("add overflow --model m.toml");
}

#[test]
fn an_effect_that_stands_in_the_file_stays() {
    let place = Place::empty();
    place.write(
        "m.toml",
        format!("effects = [\"overflow\"]\n{}", model("degC")),
    );
    place.succeeds("add pump_saturation --model m.toml");
    place.succeeds("remove overflow --model m.toml");
}

#[test]
fn the_catalogue_of_a_model_is_its_domains() {
    let place = Place::empty();
    place.write("m.toml", model("degC"));
    let text = place.succeeds("effects --model m.toml");
    assert!(text.contains("the actuator saturates"), "{text}");
    assert!(!text.contains("overflow"), "{text}");
    assert_eq!(words_of_tanks(&text), Vec::<String>::new(), "{text}");
    place.write("m.toml", model("%"));
    let text = place.succeeds("effects --model m.toml");
    assert!(text.contains("overflow"), "{text}");
    assert!(!text.contains("laminar_outflow"), "{text}");
}

#[test]
fn no_experiment_is_designed_for_an_effect_that_is_not_offered() {
    let place = Place::empty();
    place.write("block.csv", heated_block("degC"));
    place.write("block.toml", format!("{PLANT}[columns]\noutput = \"T\"\n"));
    place.refuses(
        "design block.csv --model block.toml --between overflow sensor_saturation",
        &["overflow", "in degC"],
    );
}
