//! Records that contradict each other or the model.

use super::*;
use ct_signals::Channel;

fn record(name: &str, rows: usize, unit: &str) -> Record {
    let values = |scale: f64| (0..rows).map(|k| scale * (1.0 + (k % 7) as f64)).collect();
    Record {
        name: name.to_string(),
        time: (0..rows).map(|k| k as f64).collect(),
        inputs: vec![Channel::new("u", "V", values(1.0))],
        outputs: vec![Channel::new("y", unit, values(2.0))],
        ..Record::default()
    }
}

fn refused(model: &str, records: Vec<Record>, test: Vec<Record>) -> String {
    let model = model_file::parse("tank.toml", model).unwrap();
    problem("tank.toml", model, records, test)
        .unwrap_err()
        .to_string()
}

#[test]
fn records_in_different_units_are_refused() {
    let plant = "plant = \"single-tank\"";
    assert_eq!(
        refused(
            plant,
            vec![record("a.csv", 50, "cm")],
            vec![record("b.csv", 50, "m")]
        ),
        "b.csv: column \"y\" is in m, but a.csv has it in cm; write the unit in its header, and name under [columns] the one to which both are converted"
    );
    let message = refused(
        plant,
        vec![record("a.csv", 50, "cm"), record("b.csv", 50, "")],
        vec![],
    );
    assert!(
        message.contains("is without a unit, but a.csv has it in cm"),
        "{message}"
    );
}

#[test]
fn a_level_above_the_tank_is_refused() {
    let message = refused(
        "plant = \"single-tank\"\n[known]\ntank_height = 0.6",
        vec![record("a.csv", 50, "cm")],
        vec![],
    );
    assert!(
        message
            .starts_with("tank.toml: tank_height = 0.6, but column \"y\" of a.csv reaches 14.0 cm"),
        "{message}"
    );
    let taken = |height: f64, effects: &str| {
        let text = format!(
            "plant = \"single-tank\"\neffects = [{effects}]\n[known]\ntank_height = {height}"
        );
        let model = model_file::parse("tank.toml", &text).unwrap();
        problem("tank.toml", model, vec![record("a.csv", 50, "cm")], vec![]).is_ok()
    };
    // The readings reach 14 cm.
    assert!(taken(13.9, "") && !taken(13.8, "") && !taken(13.8, "\"overflow\""));
    assert!(taken(9.4, "\"sensor_offset\"") && !taken(9.3, "\"sensor_offset\""));
}

#[test]
fn a_command_beyond_its_range_is_refused() {
    let model = |range: f64| format!("plant = \"single-tank\"\n[known]\ninput_range = {range}");
    let records = || vec![record("a.csv", 50, "cm")];
    assert_eq!(
        refused(&model(1.0), records(), vec![]),
        "tank.toml: input_range = 1, but column \"u\" of a.csv reaches 7.00 V; give the full range of the command in its \
             unit, or delete the line"
    );
    // The command runs from 1 to 7 V.
    let taken = |range: f64, sign: f64| {
        let mut records = records();
        records[0].inputs[0]
            .values
            .iter_mut()
            .for_each(|u| *u *= sign);
        let model = model_file::parse("tank.toml", &model(range)).unwrap();
        problem("tank.toml", model, records, vec![]).is_ok()
    };
    for sign in [1.0, -1.0] {
        assert!(taken(7.0, sign) && taken(6.95, sign) && !taken(6.9, sign));
    }
}

#[test]
fn a_level_below_the_outlet_is_refused_where_its_root_is_taken() {
    let lowered = |by: f64| {
        let mut record = record("a.csv", 50, "cm");
        record.outputs[0].values.iter_mut().for_each(|y| *y -= by);
        record
    };
    assert_eq!(
        refused(
            "plant = \"single-tank\"",
            vec![record("b.csv", 50, "cm")],
            vec![lowered(30.0)]
        ),
        "a.csv: column \"y\" falls to -28.0 cm, but single-tank has an outflow that depends on the square root of the level, which is not \
             below zero: add the height of the sensor's zero above the outlet to the readings, choose a linear plant, or, \
             where the offset is to be fitted, run `ctid add sensor_offset`"
    );
    let taken = |model: &str, by: f64| {
        let model = model_file::parse("tank.toml", model).unwrap();
        problem("tank.toml", model, vec![lowered(by)], vec![]).is_ok()
    };
    // The readings run from 2 to 14 cm.
    assert!(!taken("plant = \"single-tank\"", 3.3));
    assert!(taken("plant = \"single-tank\"", 3.1));
    assert!(taken("plant = \"single-tank-linear\"", 30.0));
    assert!(taken(
        "plant = \"single-tank\"\neffects = [\"sensor_offset\"]",
        4.0
    ));
}

#[test]
fn too_few_rows_are_refused() {
    let model = "plant = \"cascaded-tanks\"\neffects = [\"overflow\"]";
    let message = refused(model, vec![record("a.csv", 30, "cm")], vec![]);
    assert!(
        message.starts_with("a.csv: 30 rows of data, but 35 are needed to fit 7 parameters"),
        "{message}"
    );
    let message = refused(
        model,
        vec![record("a.csv", 20, "cm"), record("b.csv", 20, "cm")],
        vec![],
    );
    assert!(
        message.starts_with("a.csv and b.csv: 40 rows of data, but 45 are needed to fit 9"),
        "{message}"
    );
}

#[test]
fn a_record_is_given_once() {
    let files = |data: &[&str], test: &[&str]| Files {
        data: data.iter().map(PathBuf::from).collect(),
        test: test.iter().map(PathBuf::from).collect(),
        model: "tank.toml".into(),
        options: ReadOptions::default(),
    };
    let message = |files: Files| files.read().unwrap_err().to_string();
    assert!(message(files(&["a.csv"], &["./a.csv"])).contains("both fitted and held out"));
    assert!(message(files(&["a.csv", "a.csv"], &[])).contains("given twice"));
}
