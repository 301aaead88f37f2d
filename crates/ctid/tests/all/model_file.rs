//! The model file: what it says, and one message for each mistake.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use ct_signals::Hold;
use ctid::model_file::{self, ControllerLaw, ModelFile};
use plants::Plant;

use crate::common::Place;

fn parse(text: &str) -> ModelFile {
    model_file::parse("tank.toml", text).unwrap()
}

fn message(text: &str) -> String {
    let message = model_file::parse("tank.toml", text)
        .unwrap_err()
        .to_string();
    assert!(!message.contains('\n'), "more than one line: {message}");
    message
}

/// The message begins so, and says this further on.
fn refuses(text: &str, start: &str, mend: &str) {
    let message = message(text);
    assert!(
        message.starts_with(start),
        "{message}\n does not begin with {start}"
    );
    assert!(message.contains(mend), "{message}\n does not say {mend}");
}

#[test]
fn everything_that_may_be_said_is_understood() {
    let model = parse(
        r#"
plant = "cascaded-tanks"     # two tanks
effects = ["pump_deadzone", "overflow"]
hold = "first"

[columns]
time = "t [s]"
output = "y [cm]"

[known]
area_upper = 154
area_lower = 154.0
tank_height = 60.0
input_range = 10

[start]
alpha_upper = 11
"pump_deadzone.u_dz" = 0.4

[controller]
type = "PI"
gain = 0.6
integral_time = 90
u_min = 0
u_max = 10.0

[effect.overflow]
where = "lower"
rim = 50.0
fixed = ["rim"]
"#
        .replace("u_dz", deadzone_parameter())
        .as_str(),
    );
    assert_eq!(model.plant, Plant::CascadedTanks);
    let effects: Vec<_> = model
        .effects
        .iter()
        .map(|e| (e.effect.id, e.vessel))
        .collect();
    assert_eq!(effects, [("pump_deadzone", 0), ("overflow", 1)]);
    assert_eq!(model.columns.outputs, ["y [cm]"]);
    assert!(model.columns.inputs.is_empty());
    assert_eq!(model.known.area, [Some(154.0), Some(154.0), None]);
    assert_eq!(model.known.input_range, Some(10.0));
    assert_eq!(model.start["alpha_upper"], 11.0);
    assert_eq!(model.start["overflow.rim"], 50.0);
    assert_eq!(model.start.len(), 3);
    assert_eq!(model.fixed, ["overflow.rim"]);
    assert_eq!(model.hold, Hold::First);
    let controller = model.controller.unwrap();
    assert_eq!(controller.u_max, 10.0);
    assert_eq!(
        controller.law,
        ControllerLaw::Pi {
            gain: 0.6,
            integral_time: 90.0
        }
    );
}

/// The catalogue names it; the file format does not.
fn deadzone_parameter() -> &'static str {
    let model = parse("plant = \"cascaded-tanks\"\neffects = [\"pump_deadzone\"]");
    let scales = plants::Scales::from_ranges((0.0, 1.0), (0.0, 1.0), 1.0, 10.0);
    let structure = model.structure(scales).unwrap();
    structure.effect_parameters(model.effects[0])[0].name
}

#[test]
fn a_plant_is_enough() {
    let model = parse("plant = \"single-tank\"");
    assert!(model.effects.is_empty() && model.start.is_empty() && model.controller.is_none());
    assert_eq!(model.hold, Hold::Zero);
    assert_eq!(model.known.area, [None; 3]);
}

#[test]
fn a_linear_plant_may_know_its_area() {
    assert_eq!(
        parse("plant = \"single-tank-linear\"\n[known]\narea = 2.0")
            .known
            .area[0],
        Some(2.0)
    );
}

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
        "tank.toml:2: effect `overflow` is on already",
        "remove it once",
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
    // The fit begins there, but where a guess says otherwise.
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

#[test]
fn controllers_that_cannot_work() {
    let controller = |lines: &str| format!("plant = \"single-tank\"\n\n[controller]\n{lines}");
    refuses(
        &controller("gain = 1.0"),
        "tank.toml:3: [controller] has no type",
        "type = \"PI\"",
    );
    refuses(
        &controller("type = \"PID\"\ngain = 1.0"),
        "tank.toml:4: controller type \"PID\" is not known",
        "type = \"PI\"",
    );
    refuses(
        &controller("type = \"RS\"\nr = [1.0]"),
        "tank.toml:3: [controller] has no s",
        "write s = [...]",
    );
    refuses(
        &controller("type = \"RS\"\nr = [1.0]\ns = [0.0, 1.0]"),
        "tank.toml:3: controller: s = []",
        "give s[0]",
    );
    refuses(
        &controller("type = \"RS\"\nr = [1.0]\ns = [1.0]\ngain = 2"),
        "tank.toml:7: gain is not a setting of a controller of type \"RS\"",
        "delete it",
    );
    refuses(
        &controller("type = \"RS\"\nr = [1.0]\ns = [1.0]\nvariable = \"z\""),
        "tank.toml:7: variable \"z\" is not known",
        "highest power first",
    );
    refuses(
        &controller("type = \"RS\"\nr = [1, 0, 0]\ns = [1, 1]\nvariable = \"p\""),
        "tank.toml:3: controller: r/s as a transfer function in p",
        "add poles",
    );
    refuses(
        &controller("type = \"PI\"\ngain = 1.0"),
        "tank.toml:3: [controller] has no integral_time",
        "",
    );
    refuses(
        &controller("type = \"PI\"\ngain = 0\nintegral_time = 9"),
        "tank.toml:3: controller: gain = 0",
        "other than zero",
    );
    refuses(
        &controller("type = \"PI\"\ngain = 1\nintegral_time = -9"),
        "tank.toml:3: controller: integral_time = -9",
        "positive time",
    );
    refuses(
        &controller("type = \"PI\"\ngain = 1\nintegral_time = 9\nu_min = 10\nu_max = 0"),
        "tank.toml:3: controller: u_min = 10 is not below u_max = 0",
        "swap them",
    );
    refuses(
        &controller("type = \"PI\"\ngain = 1\nintegral_time = 9\nderivative_time = 1"),
        "tank.toml:7: unknown key derivative_time",
        "integral_time",
    );
}

#[test]
fn tables_of_effects() {
    let table = |plant: &str, lines: &str| {
        format!("plant = \"{plant}\"\neffects = [\"overflow\", \"pump_lag\"]\n{lines}")
    };
    let two = |lines: &str| table("cascaded-tanks", lines);
    refuses(
        &two("[effect.overfow]\nrim = 1.0"),
        "tank.toml:3: unknown effect \"overfow\"",
        "overflow?",
    );
    refuses(
        &two("[effect.overflow]\nwhere = \"middle\""),
        "tank.toml:4: where = \"middle\" is no vessel",
        "\"upper\" or \"lower\"",
    );
    refuses(
        &two("[effect.overflow]\nwhere = 1.0"),
        "tank.toml:4: where is a word",
        "",
    );
    refuses(
        &table("single-tank", "[effect.overflow]\nwhere = \"upper\""),
        "tank.toml:4: plant single-tank has one vessel",
        "leave it out",
    );
    refuses(
        &two("[effect.pump_lag]\nwhere = \"upper\""),
        "tank.toml:4: pump_lag acts at the actuator",
        "leave it out",
    );
    refuses(
        &two("[effect.overflow]\nrimm = 1.0"),
        "tank.toml:4: overflow has no parameter rimm; it has rim, fraction",
        "did you mean rim?",
    );
    refuses(
        &two("[effect.overflow]\nwhere = \"lower\"\nfraction = 0.5"),
        "tank.toml:5: overflow has no parameter fraction; it has rim",
        "",
    );
    refuses(
        &two("[effect.overflow]\nfixed = [\"rim\"]"),
        "tank.toml:4: rim is fixed but has no value",
        "write rim = ...",
    );
    refuses(
        &two("[effect.overflow]\nfixed = \"rim\""),
        "tank.toml:4: fixed is a list",
        "[\"rim\"]",
    );
    refuses(
        &two("[effect.overflow]\nrim = \"high\""),
        "tank.toml:4: rim has to be a finite number",
        "",
    );
    refuses(
        &two("[effect.overflow]\nrim = [1.0]"),
        "tank.toml:4: not understood",
        "a number, a place such as where =",
    );
}

#[test]
fn a_table_of_an_effect_that_is_off_waits() {
    let model = parse("plant = \"single-tank\"\n[effect.overflow]\nrim = 4.0\nfixed = [\"rim\"]");
    assert!(model.effects.is_empty() && model.start.is_empty() && model.fixed.is_empty());
}

#[test]
fn files_that_cannot_be_read() {
    let error = model_file::read(Path::new("no/such.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("no/such.toml: the model file cannot be opened"),
        "{error}"
    );

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.toml");
    std::fs::write(&path, b"plant = \"\xff\"").unwrap();
    assert!(
        model_file::read(&path)
            .unwrap_err()
            .to_string()
            .contains("not UTF-8")
    );

    std::fs::write(&path, "\u{feff}plant = \"first-order\"\r\n").unwrap();
    assert_eq!(model_file::read(&path).unwrap().plant, Plant::FirstOrder);
}

const THREE: &str = "plant = \"three-tank\"\n[known]\nmeasured = \"T3\"\n";

#[test]
fn three_tanks_are_understood() {
    let text = "plant = \"three-tank\"\neffects = [\"leak_at_height\", \"pump_lag\"]\n\
                [columns]\ninput_2 = \"u2 [V]\"\n\
                [known]\nmeasured = \"T2\"\narea = 154.0\npipe_area = 0.5\ngravity = 981\n\
                [start]\naz13 = 0.5\n\
                [effect.leak_at_height]\nwhere = \"T1\"\n\
                [effect.pump_lag]\nwhere = \"pump_2\"\n";
    let model = parse(text);
    assert_eq!(model.plant, Plant::ThreeTank);
    assert_eq!(
        model.columns.inputs.last().map(String::as_str),
        Some("u2 [V]")
    );
    assert_eq!(model.known.measured, [2]);
    assert_eq!(model.known.area, [Some(154.0); 3]);
    let orifice = model.known.orifice.unwrap();
    assert!((orifice - 0.5 * 1962.0_f64.sqrt()).abs() < 1e-12);
    let at: Vec<_> = model.effects.iter().map(|on| on.vessel).collect();
    assert_eq!(at, [0, 1]);
    let areas = parse(&format!("{THREE}area_1 = 1\narea_2 = 2\narea_3 = 3\n"));
    assert_eq!(areas.known.area, [Some(1.0), Some(3.0), Some(2.0)]);
}

#[test]
fn what_three_tanks_lack_is_said() {
    let three = |more: &str| format!("{THREE}{more}\n");
    for (text, start, mend) in [
        (
            "plant = \"three-tank\"".to_string(),
            "tank.toml: nothing says in which tank the level is measured",
            "measured = \"T1\", \"T2\" or \"T3\"",
        ),
        (
            THREE.replace("T3", "T4"),
            "tank.toml:3: measured = \"T4\" is no tank",
            "\"T2\"",
        ),
        (
            three("pipe_area = 0.5\ngravity = 981"),
            "tank.toml:4: pipe_area says nothing of the levels without the area of the tanks",
            "give area too",
        ),
        (
            three("area = 154\npipe_area = 0.5"),
            "tank.toml:5: pipe_area and gravity make flow coefficients pure numbers together",
            "gravity = 981",
        ),
        (
            three("area_1 = 154\narea_3 = 154"),
            "tank.toml:4: area_2 is missing",
            "area where all are alike",
        ),
        (
            three("area_1 = 154\narea = 154"),
            "tank.toml:4: area is that of all three tanks",
            "not both",
        ),
        (
            three("area_upper = 154\narea_lower = 154"),
            "tank.toml:4: plant three-tank has three tanks; write area",
            "instead of area_upper",
        ),
        (
            three("pipe_aera = 1"),
            "tank.toml:4: unknown key pipe_aera",
            "did you mean pipe_area?",
        ),
        (
            three("[start]\naz23 = 1"),
            "tank.toml:5: [start] has az23, which is not a parameter of this model",
            "az32",
        ),
        (
            "plant = \"single-tank\"\n[known]\ngravity = 9.81".to_string(),
            "tank.toml:3: plant single-tank has no joined tanks",
            "delete gravity",
        ),
        (
            "plant = \"single-tank\"\n[known]\nmeasured = \"T1\"".to_string(),
            "tank.toml:3: plant single-tank has one level",
            "delete measured",
        ),
        (
            "plant = \"single-tank\"\n[columns]\ninput_2 = \"u2\"".to_string(),
            "tank.toml:3: plant single-tank has one pump",
            "delete input_2",
        ),
        (
            format!("{THREE}[effect.pump_lag]\nwhere = \"pump_3\""),
            "tank.toml:5: where = \"pump_3\" is no pump",
            "\"pump_1\" or \"pump_2\"",
        ),
        (
            format!("{THREE}[effect.overflow]\nwhere = \"upper\""),
            "tank.toml:5: where = \"upper\" is no vessel",
            "\"T1\" or \"T3\" or \"T2\"",
        ),
        (
            THREE.replace("[known]", "effects = [\"coupled_tank\"]\n[known]"),
            "tank.toml:2: effect `coupled_tank` does not act on plant `three-tank`",
            "joined as they are",
        ),
        (
            THREE.replace(
                "[known]",
                "effects = [\"pump_lag\"]\n[effect.pump_lag]\nwhere = \"pump_2\"\n[known]",
            ),
            "tank.toml:2: effect `pump_lag` cannot act at pump_2, which is off",
            "input_2 under [columns]",
        ),
    ] {
        refuses(&text, start, mend);
    }
}

/// Two programs that edit one file at the same moment: neither loses what the other does.
#[test]
fn no_change_of_two_programs_is_lost() {
    let place = Place::empty();
    place.write("m.toml", "plant = \"single-tank\"\neffects = []\n");
    for _ in 0..10 {
        for way in ["add", "remove"] {
            let effects = ["overflow", "pump_deadzone", "sensor_lag", "const_leak"];
            let edits = effects.map(|effect| {
                let mut command = place.command(&format!("{way} {effect} --model m.toml"));
                (effect, command.spawn().unwrap())
            });
            for (effect, mut edit) in edits {
                assert!(edit.wait().unwrap().success(), "{way} {effect}");
            }
            let text = place.read("m.toml");
            for effect in effects {
                assert_eq!(
                    text.contains(effect),
                    way == "add",
                    "{way} {effect}: {text}"
                );
            }
        }
    }
}

const BOTH: &str = "plant = \"cascaded-tanks\"\n[columns]\noutput = [\"h1\", \"h2\"]\n[known]\nmeasured = [\"upper\", \"lower\"]\n";

#[test]
fn several_levels_and_a_disturbance_are_understood() {
    let model = parse(&(BOTH.to_string() + "disturbance = \"lower\"\n").replace(
        "[columns]",
        "effects = [\"sensor_drift\"]\n[columns]\ninput = [\"u\", \"d\"]",
    ));
    assert_eq!(model.columns.outputs, ["h1", "h2"]);
    assert_eq!(model.known.measured, [0, 1]);
    assert_eq!(model.known.disturbance, Some(1));
    // Of several sensors the last one is meant where nobody says which.
    assert_eq!(model.effects[0].vessel, 1);
    let at_upper = BOTH.replace("[columns]", "effects = [\"sensor_drift\"]\n[columns]")
        + "[effect.sensor_drift]\nwhere = \"upper\"\n";
    assert_eq!(parse(&at_upper).effects[0].vessel, 0);
    let one =
        "plant = \"single-tank\"\n[columns]\ninput_2 = \"d\"\n[known]\ndisturbance = \"tank\"\n";
    assert_eq!(parse(one).known.disturbance, Some(0));
}

#[test]
fn what_several_levels_lack_is_said() {
    for (text, start, mend) in [
        (
            BOTH.replace("measured = [\"upper\", \"lower\"]\n", ""),
            "tank.toml: [columns] names 2 outputs, but nothing says which levels they are",
            "measured = [\"upper\", \"lower\"]",
        ),
        (
            BOTH.replace("\"upper\", \"lower\"", "\"lower\", \"lower\""),
            "tank.toml:5: measured names lower twice",
            "name each tank once",
        ),
        (
            BOTH.replace("\"upper\", \"lower\"", "\"lower\""),
            "tank.toml:5: measured names 1 of the tanks, but [columns] names 2 of the outputs",
            "as many of both",
        ),
        (
            BOTH.replace("\"h2\"]", "\"h2\", \"h3\"]"),
            "tank.toml:3: [columns] names 3 outputs, but plant cascaded-tanks has 2 levels",
            "name a column for each level",
        ),
        (
            BOTH.replace("[\"h1\", \"h2\"]", "\"h1\"")
                .replace("[\"upper\", \"lower\"]", "\"upper\""),
            "tank.toml:5: the level of the lower tank is not among the outputs",
            "plant = \"single-tank\"",
        ),
        (
            BOTH.replace("[columns]", "effects = [\"sensor_drift\"]\n[columns]")
                + "[effect.sensor_drift]\nwhere = \"middle\"\n",
            "tank.toml:8: where = \"middle\" is no tank whose level is measured",
            "\"upper\" or \"lower\"",
        ),
        (
            BOTH.to_string() + "disturbance = \"lower\"\n",
            "tank.toml:6: [known] says where a measured disturbance flows in, but [columns] names no column for it",
            "input_2 = ",
        ),
        (
            BOTH.replace("[columns]", "[columns]\ninput_2 = \"d\""),
            "tank.toml:3: plant cascaded-tanks has one pump",
            "disturbance = \"upper\" or \"lower\"",
        ),
        (
            THREE.to_string() + "disturbance = \"T1\"\n",
            "tank.toml:4: plant three-tank takes no measured disturbance",
            "delete disturbance",
        ),
    ] {
        let said = model_file::parse("tank.toml", &text)
            .unwrap_err()
            .to_string();
        assert!(
            said.starts_with(start) && said.contains(mend) && !said.contains('\n'),
            "{said}"
        );
    }
}
