//! Files that are no records.

use std::fs;

use super::{Rows, both_refuse, place, record_refused};
use crate::common::bundled;

#[test]
fn a_record_that_is_not_there() {
    let place = place();
    for words in ["none.csv", "tour.csv none.csv", "tour.csv --test none.csv"] {
        both_refuse(
            &place,
            &format!("{words} --model tour.toml"),
            &["none.csv: cannot be opened", "check the path"],
        );
    }
}

#[test]
fn a_folder_for_a_record() {
    let place = place();
    fs::create_dir(place.path("data")).unwrap();
    both_refuse(
        &place,
        "data --model tour.toml",
        &["data: ", "it is a folder", "name a file"],
    );
}

#[test]
fn an_empty_record() {
    record_refused("", &["bad.csv: the file is empty", "a header such as"]);
    record_refused("\n# nothing yet\n\n", &["bad.csv: the file is empty"]);
}

#[test]
fn a_record_without_a_header() {
    let text = bundled("tour.csv");
    let (_, rows) = text.split_once('\n').unwrap();
    record_refused(
        rows,
        &[
            "bad.csv, row 1",
            "holds numbers (0.0000, 3.3500, 9.0970)",
            "put a header",
        ],
    );
}

#[test]
fn a_binary_record() {
    record_refused(
        [0x7f, b'E', b'L', b'F', 0, 1, 2, 0xff],
        &["bad.csv: ", "binary data", "export it as CSV"],
    );
    record_refused(
        *b"PK\x03\x04\x14\x00",
        &["bad.csv: ", "spreadsheet", "export it as CSV"],
    );
}

#[test]
fn a_wrong_number_of_fields() {
    let mut rows = Rows::new();
    rows.0[29].pop();
    record_refused(
        rows.text(),
        &[
            "bad.csv, row 30",
            "2 fields, but the header has 3",
            "a missing or a surplus comma",
        ],
    );
    // A decimal comma between commas.
    record_refused(
        Rows::new().with(31, 2, "9,5").text(),
        &["bad.csv, row 31", "4 fields", "commas inside numbers"],
    );
}

#[test]
fn two_decimal_marks() {
    record_refused(
        Rows::new()
            .with(12, 2, "9,5")
            .text()
            .replace(',', ";")
            .replace("9;5", "9,5"),
        &[
            "bad.csv, row 12, column \"y [cm]\"",
            "\"9,5\" has a decimal comma",
            "use one of them throughout",
        ],
    );
}

#[test]
fn a_quote_that_is_never_closed() {
    // The rest of the file is then one cell: the message is short nevertheless.
    let text = Rows::new().with(40, 2, "\"9.5").text();
    let place = place();
    place.write("bad.csv", text);
    let line = place.refuses(
        "diagnose bad.csv --model tour.toml",
        &["bad.csv, row ", "column \"y [cm]\"", "is not a number"],
    );
    assert!(line.len() < 400, "{} bytes: {line}", line.len());
}

#[test]
fn control_characters_of_a_file_are_not_sent_to_the_terminal() {
    let place = place();
    place.write("bad.csv", Rows::new().with(5, 2, "\u{1b}[31m9\u{7}").text());
    let line = place.refuses(
        "diagnose bad.csv --model tour.toml",
        &["bad.csv, row 5, column \"y [cm]\"", "is not a number"],
    );
    assert!(!line.chars().any(char::is_control), "{line:?}");
}
