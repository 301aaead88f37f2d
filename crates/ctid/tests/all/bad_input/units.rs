//! Contradictory units, and columns without a clear role.

use super::{Rows, both_refuse, model_with, place, record_refused};

#[test]
fn a_unit_that_contradicts_the_model() {
    record_refused(
        Rows::new().with(1, 2, "y [bar]").text(),
        &[
            "bad.csv, row 1, column \"y [bar]\"",
            "the file says bar but the model says cm",
            "convert the column",
        ],
    );
}

#[test]
fn a_tank_in_another_unit_than_the_level() {
    let place = place();
    place.write(
        "metre.toml",
        model_with("area = 154.0", "tank_height = 0.25\narea = 154.0"),
    );
    both_refuse(
        &place,
        "tour.csv --model metre.toml",
        &[
            "metre.toml: tank_height = 0.25",
            "column \"y\" of tour.csv reaches 20",
            "cm",
            "give the height in the output's unit",
        ],
    );
}

#[test]
fn records_in_different_units() {
    let place = place();
    place.write("any.toml", "plant = \"single-tank\"\n");
    place.write("bad.csv", Rows::new().with(1, 1, "u [mV]").text());
    for words in ["tour.csv bad.csv", "tour.csv --test bad.csv"] {
        both_refuse(
            &place,
            &format!("{words} --model any.toml"),
            &[
                "bad.csv: column \"u\" is in mV",
                "tour.csv has it in V",
                "name under [columns] the one to which both are converted",
            ],
        );
    }
}

#[test]
fn a_time_in_no_unit_of_time() {
    let place = place();
    place.write("any.toml", "plant = \"single-tank\"\n");
    place.write("bad.csv", Rows::new().with(1, 0, "t [V]").text());
    both_refuse(
        &place,
        "bad.csv --model any.toml",
        &[
            "bad.csv, row 1, column \"t [V]\"",
            "V is not a unit of time",
            "use us, ms, s, min, h or d",
        ],
    );
}

#[test]
fn a_time_in_another_unit_than_the_model_says() {
    let place = place();
    place.write("bad.csv", Rows::new().with(1, 0, "t [min]").text());
    // The header decides: its times are minutes, whatever the model names the column.
    let said = place.succeeds("compare bad.csv --model tour.toml");
    assert!(said.contains("30.0 h"), "{said}");
}

#[test]
fn a_column_of_almost_that_name() {
    let place = place();
    place.write(
        "slip.toml",
        model_with("input = \"u [V]\"", "input = \"U [V]\""),
    );
    both_refuse(
        &place,
        "tour.csv --model slip.toml",
        &["did you mean \"u [V]\"? Set input = \"...\" under [columns]"],
    );
}

#[test]
fn a_command_beyond_its_range() {
    let place = place();
    place.write(
        "range.toml",
        model_with("area = 154.0", "input_range = 1\narea = 154.0"),
    );
    both_refuse(
        &place,
        "tour.csv --model range.toml",
        &[
            "range.toml: input_range = 1",
            "column \"u\" of tour.csv reaches",
            "give the full range",
        ],
    );
}

#[test]
fn two_columns_that_could_each_be_the_output() {
    let place = place();
    place.write("any.toml", "plant = \"single-tank\"\n");
    let mut rows = Rows::new();
    for row in &mut rows.0 {
        row.push(row[2].clone());
    }
    place.write("bad.csv", rows.with(1, 2, "y_1").with(1, 3, "y_2").text());
    both_refuse(
        &place,
        "bad.csv --model any.toml",
        &[
            "bad.csv, row 1",
            "\"y_1\", \"y_2\" could each be the output",
            "output = ",
        ],
    );
}

#[test]
fn a_column_for_two_roles() {
    let place = place();
    place.write(
        "same.toml",
        model_with("output = \"y [cm]\"", "output = \"u [V]\""),
    );
    both_refuse(
        &place,
        "tour.csv --model same.toml",
        &[
            "tour.csv, row 1, column \"u [V]\"",
            "both as input and as output",
            "[columns]",
        ],
    );
}
