//! The model file: its content, and one message for each error.

#![allow(clippy::unwrap_used)]

mod refused;
mod several;

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

/// The message has this start, and contains this text later.
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

/// The catalogue has this name; the file format does not.
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
        "tank.toml:4: where = \"middle\" is not a vessel",
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

/// Two programs that edit one file at the same moment: no change is lost.
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
