//! Several outputs, several files, and clocks.

use super::super::{both_refuse, place, record_refused};
use crate::common::bundled;

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

/// For each column: the reading, the command or the time.
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
    // A user's own model.
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

/// The model file is wrong, for records with and without dates.
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
