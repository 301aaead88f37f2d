//! Three tanks, and several levels of two.

use ctid::model_file;
use plants::Plant;

use super::{parse, refuses};

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
            "tank.toml:3: measured = \"T4\" is not a tank",
            "\"T2\"",
        ),
        (
            three("pipe_area = 0.5\ngravity = 981"),
            "tank.toml:4: pipe_area has no effect on the levels without the area of the tanks",
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
            "tank.toml:5: where = \"pump_3\" is not a pump",
            "\"pump_1\" or \"pump_2\"",
        ),
        (
            format!("{THREE}[effect.overflow]\nwhere = \"upper\""),
            "tank.toml:5: where = \"upper\" is not a vessel",
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
    // With several sensors, the default is the last one.
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
            "tank.toml:8: where = \"middle\" is not a tank whose level is measured",
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
