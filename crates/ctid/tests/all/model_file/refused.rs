//! Model files that are refused, each with its own message.

use super::{parse, refuses};

#[test]
fn a_missing_plant() {
    refuses(
        "effects = []",
        "tank.toml: no plant is named",
        "write plant = \"...\"",
    );
}

#[test]
fn an_unknown_plant() {
    refuses(
        "\nplant = \"single_tank\"",
        "tank.toml:2: unknown plant \"single_tank\"",
        "did you mean single-tank?",
    );
}

#[test]
fn an_unknown_effect() {
    refuses(
        "plant = \"single-tank\"\neffects = [\n  \"overfow\",\n]",
        "tank.toml:3: unknown effect \"overfow\"",
        "did you mean overflow?",
    );
}

#[test]
fn an_effect_twice() {
    refuses(
        "plant = \"single-tank\"\neffects = [\"overflow\", \"overflow\"]",
        "tank.toml:2: effect `overflow` is listed twice",
        "delete one of them",
    );
}

#[test]
fn an_effect_of_another_plant() {
    refuses(
        "plant = \"single-tank\"\neffects = [\"sqrt_outflow\"]",
        "tank.toml:2: effect `sqrt_outflow` does not act on plant `single-tank`",
        "",
    );
}

#[test]
fn an_unknown_key() {
    refuses(
        "plant = \"single-tank\"\nefects = []",
        "tank.toml:2: unknown key efects",
        "did you mean effects?",
    );
    refuses(
        "plant = \"single-tank\"\n[known]\ntank_hight = 4",
        "tank.toml:3: unknown key tank_hight",
        "did you mean tank_height?",
    );
    refuses(
        "plant = \"single-tank\"\n[columns]\nouput = \"y\"",
        "tank.toml:3: unknown key ouput",
        "did you mean output?",
    );
}

#[test]
fn text_where_a_number_belongs() {
    refuses(
        "plant = \"single-tank\"\n\n[known]\narea = \"154\"",
        "tank.toml:4: ",
        "write it without quotes",
    );
    refuses(
        "plant = \"single-tank\"\n[start]\nalpha = true",
        "tank.toml:3: ",
        "not a number",
    );
}

#[test]
fn a_number_with_a_unit_or_a_decimal_comma() {
    for (written, meant) in [
        ("154 cm^2", "area = 154.0"),
        ("154.5cm^2 # measured", "area = 154.5"),
        ("154,0", "area = 154.0"),
        ("1.5e2 cm^2", "area = 150.0"),
        ("1,154.0", "area = 154.0, say"),
    ] {
        refuses(
            &format!("plant = \"single-tank\"\n[known]\narea = {written}\ntank_height = 60.0"),
            "tank.toml:3: numbers without a unit and with a decimal point",
            meant,
        );
    }
}

#[test]
fn a_syntax_error() {
    refuses("plant = \"single-tank\"\neffects = [", "tank.toml:2: ", "");
    refuses(
        "plant = single-tank",
        "tank.toml:1: ",
        "words in quotes, numbers without quotes and without a unit",
    );
    refuses(
        "plant = \"single-tank\"\nplant = \"first-order\"",
        "tank.toml:2: ",
        "duplicate key",
    );
}

#[test]
fn an_unknown_hold() {
    refuses(
        "plant = \"single-tank\"\nhold = \"linear\"",
        "tank.toml:2: hold = \"linear\" is not known",
        "hold = \"zero\" (the command is held between rows) or hold = \"first\" (a straight line",
    );
}

#[test]
fn constants_have_to_be_finite_and_above_zero() {
    let known = |line: &str| format!("plant = \"single-tank\"\n[known]\n{line}");
    refuses(
        &known("area = 0"),
        "tank.toml:3: area = 0 has to be above zero",
        "correct it",
    );
    refuses(
        &known("area = -154.0"),
        "tank.toml:3: area = -154",
        "above zero",
    );
    refuses(
        &known("tank_height = nan"),
        "tank.toml:3: tank_height = NaN is not a finite",
        "delete",
    );
    refuses(
        &known("input_range = inf"),
        "tank.toml:3: input_range = inf is not a finite",
        "delete",
    );
}

#[test]
fn areas_of_another_plant() {
    refuses(
        "plant = \"cascaded-tanks\"\n[known]\narea = 154.0",
        "tank.toml:3: plant cascaded-tanks has two vessels",
        "area_upper and area_lower instead of area",
    );
    refuses(
        "plant = \"single-tank\"\n[known]\narea_upper = 154.0",
        "tank.toml:3: plant single-tank has one vessel",
        "write area instead of area_upper",
    );
    refuses(
        "plant = \"cascaded-tanks\"\n[known]\narea_lower = 154.0",
        "tank.toml:3: one area alone",
        "give both",
    );
}

#[test]
fn an_unknown_start() {
    refuses(
        "plant = \"single-tank\"\n[start]\nalfa = 1.0",
        "tank.toml:3: [start] has alfa, which is not a parameter of this model; it has pump_gain, alpha",
        "did you mean alpha?",
    );
}

#[test]
fn a_prior() {
    let model =
        parse("plant = \"single-tank\"\n[prior]\nalpha = [2, 0.5]\n[start]\npump_gain = 3.0");
    let prior = model.priors["alpha"];
    assert_eq!((prior.value, prior.std_error), (2.0, 0.5));
    // The fit starts there, unless a guess gives another value.
    assert_eq!(model.start["alpha"], 2.0);
    let model = parse("plant = \"single-tank\"\n[prior]\nalpha = [2, 0.5]\n[start]\nalpha = 3.0");
    assert_eq!(model.start["alpha"], 3.0);
}

#[test]
fn an_impossible_prior() {
    let prior = |line: &str| format!("plant = \"single-tank\"\n[prior]\n{line}");
    refuses(
        &prior("alfa = [1.0, 0.1]"),
        "tank.toml:3: [prior] has alfa, which is not a parameter of this model; it has pump_gain, alpha",
        "alpha",
    );
    refuses(&prior("alpha = 1.0"), "tank.toml:3", "such as [2.1, 0.1]");
    refuses(&prior("alpha = [1.0]"), "tank.toml:3", "such as [2.1, 0.1]");
    refuses(
        &prior("alpha = [1.0, 0.1, 2]"),
        "tank.toml:3",
        "such as [2.1, 0.1]",
    );
    refuses(&prior("alpha = [-1.0, 0.1]"), "tank.toml:3", "above zero");
    refuses(
        &prior("alpha = [1.0, 0.0]"),
        "tank.toml:3: the standard error of alpha = 0",
        "above zero",
    );
    refuses(
        "plant = \"single-tank\"\neffects = [\"overflow\"]\n[effect.overflow]\nrim = 2.0\nfixed = [\"rim\"]\n[prior]\n\"overflow.rim\" = [2.0, 0.1]",
        "tank.toml:7: overflow.rim has a prior and is fixed",
        "keep one of the two",
    );
}

#[test]
fn an_impossible_start() {
    refuses(
        "plant = \"single-tank\"\n[start]\nalpha = -1.0",
        "tank.toml:3: alpha = -1 has to be above zero",
        "",
    );
    refuses(
        "plant = \"single-tank-linear\"\n[start]\nK = nan",
        "tank.toml:3: K = NaN is not a finite number",
        "",
    );
    // The gain of a linear plant may have either sign.
    assert_eq!(
        parse("plant = \"single-tank-linear\"\n[start]\nK = -2").start["K"],
        -2.0
    );
}

#[test]
fn a_start_given_twice() {
    refuses(
        "plant = \"single-tank\"\neffects = [\"overflow\"]\n[start]\n\"overflow.rim\" = 4\n[effect.overflow]\nrim = 5.0",
        "tank.toml:6: overflow.rim is given here and under [start]",
        "keep one",
    );
}
