//! Records whose cells or numbers cannot be.

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

/// Beside a record that moves, and held out, it is as good as any: it is simulated and scored.
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
            "the time steps by 2e-40 s",
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
fn units_in_a_row_of_their_own() {
    let rows = Rows::new().text();
    let (header, numbers) = rows.split_once('\n').unwrap();
    for units in ["s,V,cm", "s,-,°C", "s,,m3/h"] {
        record_refused(
            format!("{header}\n{units}\n{numbers}"),
            &[
                "bad.csv, row 2: no cell is a number",
                "write them into the header, \"t [s]\", and delete this row",
            ],
        );
    }
}

/// Two tanks whose levels are both measured.
const BOTH_LEVELS: &str = "plant = \"cascaded-tanks\"\n[known]\nmeasured = [\"upper\", \"lower\"]\narea_upper = 154.0\narea_lower = 154.0\n[columns]\n";

#[test]
fn two_outputs_in_one_column() {
    let place = place();
    place.write(
        "bad.toml",
        format!("{BOTH_LEVELS}output = [\"y [cm]\", \"y [cm]\"]\n"),
    );
    both_refuse(
        &place,
        "tour.csv --model bad.toml",
        &[
            "tour.csv, row 1, column \"y [cm]\"",
            "it is named twice as output",
            "give each its own column under [columns]",
        ],
    );
}

#[test]
fn an_output_without_any_sample() {
    for (word, said) in [("", "(empty cells)"), ("Bad", "(\"Bad\")")] {
        let mut rows = String::new();
        for (k, line) in bundled("tour.csv").lines().enumerate() {
            rows += &format!("{line},{}\n", if k == 0 { "h2 [cm]" } else { word });
        }
        let place = place();
        place.write("bad.csv", rows);
        place.write(
            "both.toml",
            format!("{BOTH_LEVELS}output = [\"y [cm]\", \"h2 [cm]\"]\n"),
        );
        both_refuse(
            &place,
            "bad.csv --model both.toml",
            &[
                "bad.csv, row 2, column \"h2 [cm]\"",
                "the samples of all ",
                said,
                "name another column",
            ],
        );
    }
}

/// Whatever the column is: the reading, the command or the time.
#[test]
fn a_record_of_missing_samples_alone() {
    for (column, header) in ["t [s]", "u [V]", "y [cm]"].iter().enumerate() {
        let mut lines = bundled("tour.csv")
            .lines()
            .map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>())
            .collect::<Vec<_>>();
        let at = lines[0].iter().position(|cell| cell == header).unwrap();
        assert_eq!(at, column);
        for line in &mut lines[1..] {
            line[at] = "No Data".into();
        }
        let text: Vec<String> = lines.iter().map(|line| line.join(",")).collect();
        record_refused(
            text.join("\n"),
            &[
                &format!("bad.csv, row 2, column \"{header}\""),
                "(\"No Data\")",
                "name another column",
            ],
        );
    }
}

/// The bundled record with dates, from an hour of a day on.
fn dated(hour: usize) -> String {
    let mut text = String::new();
    for (k, line) in bundled("tour.csv").lines().enumerate() {
        let (_, rest) = line.split_once(',').unwrap();
        let second = 2 * k.saturating_sub(1);
        let (h, m, s) = (hour + second / 3600, second / 60 % 60, second % 60);
        text += &match k {
            0 => format!("# made\ntime,{rest}\n"),
            _ => format!("2026-03-02 {h:02}:{m:02}:{s:02},{rest}\n"),
        };
    }
    text
}

#[test]
fn a_clock_that_runs_backwards_between_files() {
    let place = place();
    place.write("late.csv", dated(12));
    place.write("early.csv", dated(6));
    let model = "plant = \"single-tank\"\n";
    place.write("m.toml", model);
    both_refuse(
        &place,
        "late.csv early.csv --model m.toml",
        &[
            "early.csv, row 3, column \"time\"",
            "it begins at 2026-03-02 06:00, before late.csv ends at 2026-03-02 ",
            "give the files in the order of their dates",
        ],
    );
    place.succeeds("compare early.csv late.csv --model m.toml");
    // A model of the user's own.
    place.write(
        "block.mo",
        "model Block\n  parameter Real k(min=0) = 0.1;\n  input Real u;\n  output Real y = x;\n  Real x(start=1);\nequation\n  der(x) = u - k*x;\nend Block;\n",
    );
    let own = "model = \"block.mo\"\n[columns]\ntime = \"time\"\nu = \"u [V]\"\ny = \"y [cm]\"\n";
    place.write("own.toml", own);
    place.refuses(
        "compare late.csv early.csv --model own.toml",
        &["early.csv, row 3, column \"time\"", "order of their dates"],
    );
    place.write("own.toml", format!("{own}time_zone = \"Europe/Berln\"\n"));
    place.refuses(
        "compare early.csv late.csv --model own.toml",
        &["own.toml:6: there is no time zone \"Europe/Berln\""],
    );
}

/// Whether the record has dates or not: the model file is wrong.
#[test]
fn a_time_zone_that_does_not_exist() {
    let place = place();
    place.write("dated.csv", dated(6));
    place.write(
        "bad.toml",
        "plant = \"single-tank\"\n\n[columns]\ntime_zone = \"Europe/Berln\"\n",
    );
    for record in ["dated.csv", "tour.csv"] {
        both_refuse(
            &place,
            &format!("{record} --model bad.toml"),
            &[
                "bad.toml:4: ",
                "there is no time zone \"Europe/Berln\"; give a name such as \"Europe/Berlin\"",
            ],
        );
    }
}
