//! Records with invalid cells or numbers.

mod several;

use super::{Rows, both_refuse, place, record_refused, record_refused_strictly};
use crate::common::bundled;

#[test]
fn a_missing_column() {
    record_refused(
        Rows::new().with(1, 2, "level [cm]").text(),
        &[
            "bad.csv, row 1",
            "no column \"y [cm]\" for the output",
            "\"t [s]\", \"u [V]\", \"level [cm]\"",
            "output = ",
            "[columns]",
        ],
    );
}

#[test]
fn a_repeated_time() {
    record_refused(
        Rows::new().with(10, 0, "14").text(),
        &[
            "bad.csv, row 10, column \"t [s]\"",
            "14 is repeated",
            "remove one",
        ],
    );
}

#[test]
fn a_backward_time() {
    record_refused(
        Rows::new().with(10, 0, "5").text(),
        &[
            "bad.csv, row 10, column \"t [s]\"",
            "back from 14 to 5",
            "sort the rows",
        ],
    );
}

#[test]
fn a_gap() {
    record_refused_strictly(
        Rows::new().without(50).without(50).text(),
        &[
            "bad.csv, row 50, column \"t [s]\"",
            "2 samples are missing",
            "from 94 to 100, elsewhere by 2 s)",
            "leave out --strict",
        ],
    );
    // Steps that are not exact in binary.
    record_refused_strictly(
        Rows::new()
            .each(0, |t| (t / 2.0).round() / 10.0)
            .without(50)
            .text(),
        &[
            "bad.csv, row 50, column \"t [s]\"",
            "1 sample is missing",
            "from 4.7 to 4.9, elsewhere by 0.1 s)",
        ],
    );
}

#[test]
fn not_a_number_in_a_cell() {
    record_refused_strictly(
        Rows::new().with(20, 2, "NaN").text(),
        &[
            "bad.csv, row 20, column \"y [cm]\"",
            "\"NaN\" is not a finite number",
            "leave out --strict",
        ],
    );
}

#[test]
fn an_infinity_in_a_cell() {
    record_refused_strictly(
        Rows::new().with(21, 1, "-inf").text(),
        &[
            "bad.csv, row 21, column \"u [V]\"",
            "\"-inf\" is not a finite number",
            "leave out --strict",
        ],
    );
}

#[test]
fn a_number_too_large_for_a_computer() {
    record_refused(
        Rows::new().with(22, 1, "1e999").text(),
        &[
            "bad.csv, row 22, column \"u [V]\"",
            "\"1e999\" is not a finite number",
        ],
    );
}

#[test]
fn text_in_a_cell() {
    record_refused_strictly(
        Rows::new().with(23, 2, "n/a").text(),
        &[
            "bad.csv, row 23, column \"y [cm]\"",
            "\"n/a\" is not a number",
            "correct the cell",
        ],
    );
    record_refused(
        Rows::new().with(23, 2, "open").text(),
        &[
            "bad.csv, row 23, column \"y [cm]\"",
            "\"open\" is not a number",
            "missing = [",
        ],
    );
}

#[test]
fn a_date_for_a_time() {
    record_refused(
        Rows::new().with(2, 0, "2024-05-01 12:00:00").text(),
        &[
            "bad.csv, row 3, column \"t [s]\"",
            "2024-05-01 12:00:00",
            "write all times alike",
        ],
    );
}

#[test]
fn an_empty_cell() {
    record_refused_strictly(
        Rows::new().with(24, 1, "").text(),
        &[
            "bad.csv, row 24, column \"u [V]\"",
            "the cell is empty",
            "fill it in",
        ],
    );
}

#[test]
fn a_constant_input() {
    let place = place();
    place.write("bad.csv", Rows::new().each(1, |_| 4.2).text());
    both_refuse(
        &place,
        "bad.csv --model tour.toml --test tour-test.csv",
        &[
            "bad.csv, column \"u [V]\"",
            "the input is 4.2 in all 900 rows",
            "record an experiment in which it moves",
        ],
    );
}

/// Together with a record that changes, or held out, a constant record is valid: it is simulated and scored.
#[test]
fn a_constant_input_beside_another_record() {
    let place = crate::common::Place::new();
    let mut still = String::from("t [s],u [V],y [cm]\n");
    for k in 0..60 {
        still += &format!("{},4,{}\n", 2 * k, 12.0 + 0.05 * f64::from(k * 7 % 5));
    }
    place.write("still.csv", &still);
    place.write("other.csv", &still);
    for records in [
        "tour.csv --test still.csv",
        "tour.csv still.csv",
        "still.csv tour.csv --test other.csv",
    ] {
        let json = place.result(&format!("compare {records} --model tour.toml"));
        let rmse = json["steps"][0]["rmse"].as_f64();
        assert!(rmse.is_some_and(|rmse| rmse > 0.0), "{records}: {json}");
        let held_out = json["steps"][0]["rmse_test"].as_f64();
        assert_eq!(held_out.is_some(), records.contains("--test"), "{json}");
    }
    place.refuses(
        "compare still.csv other.csv --model tour.toml",
        &["still.csv", "\"u [V]\"", "4 in all 60 rows"],
    );
}

#[test]
fn a_constant_output() {
    record_refused(
        Rows::new().each(2, |_| 7.5).text(),
        &[
            "bad.csv, column \"y [cm]\"",
            "the output is 7.5 in all 900 rows",
            "check the sensor",
        ],
    );
}

#[test]
fn numbers_beyond_all_measure() {
    record_refused(
        Rows::new().with(25, 2, "1e300").text(),
        &[
            "bad.csv, row 25, column \"y [cm]\"",
            "1e300 is too large",
            "correct the cell",
        ],
    );
    record_refused(
        Rows::new().each(2, |y| 1e-150 * y).text(),
        &[
            "bad.csv, column \"y [cm]\"",
            "e-149, which is too small",
            "a smaller unit",
        ],
    );
    record_refused(
        Rows::new().each(0, |t| 1e-40 * t).text(),
        &[
            "bad.csv, column \"t [s]\"",
            "the sampling interval is 2e-40 s",
            "check the column and its unit",
        ],
    );
}

#[test]
fn a_saturated_record() {
    record_refused(
        Rows::new().each(2, |y| y.min(12.0)).text(),
        &[
            "bad.csv, column \"y [cm]\"",
            "of 900 samples sit exactly at a limit",
            "at 12 cm",
            "keep the experiment within the sensor's range",
        ],
    );
}

#[test]
fn too_few_rows_for_any_model() {
    let lines: Vec<String> = bundled("tour.csv")
        .lines()
        .take(1 + 15)
        .map(str::to_string)
        .collect();
    record_refused(
        lines.join("\n"),
        &["bad.csv: 15 rows", "20 are needed", "give a longer record"],
    );
}

#[test]
fn too_few_rows_for_the_parameters() {
    let place = place();
    let mut rows = Rows::new();
    rows.0.drain(1..31);
    rows.0.truncate(1 + 30);
    place.write("bad.csv", rows.text());
    place.write(
        "two.toml",
        "plant = \"cascaded-tanks\"\neffects = [\"overflow\"]\n",
    );
    both_refuse(
        &place,
        "bad.csv --model two.toml",
        &[
            "bad.csv: 30 rows",
            "35 are needed to fit 7 parameters",
            "give a longer record",
        ],
    );
}

#[test]
fn a_row_of_units_that_are_not_understood_or_not_those_of_the_header() {
    let rows = Rows::new().text();
    let (header, numbers) = rows.split_once('\n').unwrap();
    let with = |units: &str| format!("{header}\n{units}\n{numbers}");
    record_refused(
        with("s,counts,cm"),
        &[
            "bad.csv, row 2: no cell is a number",
            "write them into the header, \"t [s]\", and delete this row",
        ],
    );
    for units in ["s,-,°C", "s,,m3/h"] {
        record_refused(
            with(units),
            &[
                "bad.csv, row 2, column \"y [cm]\"",
                "this row of units says",
            ],
        );
    }
}
