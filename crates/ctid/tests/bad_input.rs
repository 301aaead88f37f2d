//! Bad input, one mistake at a time, through the program: exit code 2, one line that names the place
//! and the mend, and not a byte on disk changed.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::fs;
use std::sync::OnceLock;

use common::{Place, Tanks, bundled};

/// Results that ctid wrote earlier: a run that fails may not touch them.
fn earlier_results() -> &'static [(&'static str, Vec<u8>); 2] {
    static RESULTS: OnceLock<[(&str, Vec<u8>); 2]> = OnceLock::new();
    RESULTS.get_or_init(|| {
        let place = Place::new();
        place.succeeds("compare tour.csv --model tour.toml --json out.json --report out.html");
        ["out.json", "out.html"].map(|name| (name, fs::read(place.path(name)).unwrap()))
    })
}

/// The bundled records, their model, and results that ctid wrote earlier.
fn place() -> Place {
    let place = Place::new();
    for (name, content) in earlier_results() {
        place.write(name, content);
    }
    place
}

/// `compare` and `diagnose` refuse the record or model with these words, onto new results and onto
/// earlier ones.
fn both_refuse(place: &Place, words: &str, says: &[&str]) {
    for command in ["compare", "diagnose"] {
        for results in [
            "--json out.json --report out.html",
            "--json new.json --report new.html",
        ] {
            place.refuses(&format!("{command} {words} {results}"), says);
        }
    }
}

/// A record is refused with these words, as data and as held-out data.
fn record_refused(content: impl AsRef<[u8]>, says: &[&str]) {
    let place = place();
    place.write("bad.csv", content);
    both_refuse(&place, "bad.csv --model tour.toml", says);
    both_refuse(&place, "tour.csv --model tour.toml --test bad.csv", says);
    both_refuse(&place, "tour.csv bad.csv --model tour.toml", says);
}

/// A model file is refused with these words, by `compare`, `diagnose`, `add` and `remove`.
fn model_refused(content: impl AsRef<[u8]>, says: &[&str]) {
    let place = place();
    place.write("bad.toml", content);
    both_refuse(&place, "tour.csv --model bad.toml", says);
    place.refuses("add pump_lag --model bad.toml", says);
    place.refuses("remove overflow --model bad.toml", says);
}

/// The bundled model file with one line replaced.
fn model_with(line: &str, by: &str) -> String {
    let text = bundled("tour.toml");
    assert!(text.contains(line));
    text.replace(line, by)
}

/// The cells of the bundled record; row 1 is the header, as a text editor counts.
struct Rows(Vec<Vec<String>>);

impl Rows {
    fn new() -> Self {
        let cells = |line: &str| line.split(',').map(str::to_string).collect();
        Self(bundled("tour.csv").lines().map(cells).collect())
    }

    /// One cell replaced; column 0 is the time, 1 the input, 2 the output.
    fn with(mut self, row: usize, column: usize, text: &str) -> Self {
        self.0[row - 1][column] = text.to_string();
        self
    }

    fn without(mut self, row: usize) -> Self {
        self.0.remove(row - 1);
        self
    }

    /// A whole column changed, but for its header.
    fn each(mut self, column: usize, change: impl Fn(f64) -> f64) -> Self {
        for row in &mut self.0[1..] {
            row[column] = change(row[column].parse().unwrap()).to_string();
        }
        self
    }

    fn text(&self) -> String {
        let lines: Vec<String> = self.0.iter().map(|row| row.join(",")).collect();
        lines.join("\n") + "\n"
    }
}

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
    record_refused(
        Rows::new().without(50).without(50).text(),
        &[
            "bad.csv, row 50, column \"t [s]\"",
            "2 samples are missing",
            "from 94 to 100, elsewhere by 2)",
            "split the file",
        ],
    );
    // Steps that are not exact in binary.
    record_refused(
        Rows::new()
            .each(0, |t| (t / 2.0).round() / 10.0)
            .without(50)
            .text(),
        &[
            "bad.csv, row 50, column \"t [s]\"",
            "1 sample is missing",
            "from 4.7 to 4.9, elsewhere by 0.1)",
        ],
    );
}

#[test]
fn not_a_number_in_a_cell() {
    record_refused(
        Rows::new().with(20, 2, "NaN").text(),
        &[
            "bad.csv, row 20, column \"y [cm]\"",
            "\"NaN\" is not a finite number",
            "replace it",
        ],
    );
}

#[test]
fn an_infinity_in_a_cell() {
    record_refused(
        Rows::new().with(21, 1, "-inf").text(),
        &[
            "bad.csv, row 21, column \"u [V]\"",
            "\"-inf\" is not a finite number",
            "replace it",
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
    record_refused(
        Rows::new().with(23, 2, "n/a").text(),
        &[
            "bad.csv, row 23, column \"y [cm]\"",
            "\"n/a\" is not a number",
            "correct the cell",
        ],
    );
}

#[test]
fn a_date_for_a_time() {
    record_refused(
        Rows::new().with(2, 0, "2024-05-01 12:00:00").text(),
        &[
            "bad.csv, row 2, column \"t [s]\"",
            "2024-05-01 12:00:00",
            "give the time as a number",
        ],
    );
}

#[test]
fn an_empty_cell() {
    record_refused(
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
    record_refused(
        Rows::new().each(1, |_| 4.2).text(),
        &[
            "bad.csv, column \"u [V]\"",
            "the input is 4.2 in all 900 rows",
            "record an experiment in which it moves",
        ],
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
fn a_unit_that_contradicts_the_model() {
    record_refused(
        Rows::new().with(1, 2, "y [m]").text(),
        &[
            "bad.csv, row 1, column \"y [m]\"",
            "the file says m but the model says cm",
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
            "tour.csv reaches 20",
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
                "convert one of them",
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

/// A loop of which the model file says that it cannot be stable.
fn unstable(tanks: &Tanks, controller: &str) {
    let place = place();
    place.write("loop.csv", tanks.csv());
    place.write(
        "loop.toml",
        tanks.model() + "\n[controller]\ntype = \"PI\"\nu_min = 0.0\nu_max = 10.0\n" + controller,
    );
    let settings = controller.trim_end().replace('\n', ", ");
    both_refuse(
        &place,
        "loop.csv --model loop.toml",
        &["loop.toml: ", "unstable", "check", &settings],
    );
}

#[test]
fn a_controller_of_the_wrong_sign() {
    unstable(&Tanks::single(), "gain = -2\nintegral_time = 90\n");
}

#[test]
fn a_gain_beyond_all_reason_is_told_in_few_digits() {
    let place = place();
    let tanks = Tanks::single();
    place.write("loop.csv", tanks.csv());
    let controller =
        "type = \"PI\"\nu_min = 0.0\nu_max = 10.0\ngain = -1e12\nintegral_time = 1e-9\n";
    place.write("loop.toml", tanks.model() + "\n[controller]\n" + controller);
    both_refuse(
        &place,
        "loop.csv --model loop.toml",
        &[
            "loop.toml: ",
            "unstable",
            "grows more than a thousand times a sample",
        ],
    );
}

#[test]
fn constants_with_which_nothing_can_be_simulated() {
    let place = place();
    place.write(
        "small.toml",
        bundled("tour.toml").replace("154.0", "1e-300"),
    );
    both_refuse(
        &place,
        "tour.csv --model small.toml",
        &["tour.csv: none of ", "starts", "[known]"],
    );
}

#[test]
fn a_controller_that_integrates_too_fast() {
    unstable(&Tanks::cascaded(), "gain = 2\nintegral_time = 4\n");
}

#[test]
fn a_controller_that_cannot_work() {
    let controller = |lines: &str| bundled("tour.toml") + "\n[controller]\n" + lines;
    for (lines, says) in [
        (
            "type = \"PI\"\ngain = 0.0\nintegral_time = 90",
            ["gain = 0", "other than zero"],
        ),
        (
            "type = \"PI\"\ngain = nan\nintegral_time = 90",
            ["gain = NaN", "finite number"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = -90",
            ["integral_time = -90", "positive time"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = 90\nu_min = 10\nu_max = 0",
            ["u_min = 10 is not below u_max = 0", "swap them"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = 90\nu_min = nan",
            ["u_min = NaN", "finite number"],
        ),
        (
            "type = \"PID\"\ngain = 0.6\nintegral_time = 90",
            ["controller type \"PID\"", "write type = \"PI\""],
        ),
        ("type = \"PI\"\ngain = 0.6", ["no integral_time", "write"]),
    ] {
        model_refused(controller(lines), &[&["bad.toml:"], &says[..]].concat());
    }
}

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
    let wide: Vec<u8> = "\u{feff}t,u,y\n1,2,3\n"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    record_refused(wide, &["bad.csv: ", "UTF-16", "export it as CSV"]);
    record_refused(
        b"t [s],u [V],T [\xb0C]\n",
        &["bad.csv: ", "another encoding", "UTF-8"],
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
    // All that follows is then one cell: the message stays short all the same.
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

#[test]
fn an_unknown_plant() {
    model_refused(
        model_with("\"single-tank\" ", "\"single_tank\""),
        &[
            "bad.toml:1: unknown plant \"single_tank\"",
            "did you mean single-tank?",
        ],
    );
}

#[test]
fn no_plant() {
    model_refused(
        "effects = []\n",
        &["bad.toml: no plant is named", "write plant = "],
    );
}

#[test]
fn an_unknown_effect() {
    model_refused(
        model_with("effects = []", "effects = [\"overflw\"]"),
        &[
            "bad.toml:2: unknown effect \"overflw\"",
            "did you mean overflow?",
        ],
    );
}

#[test]
fn an_effect_twice() {
    model_refused(
        model_with("effects = []", "effects = [\"overflow\", \"overflow\"]"),
        &["bad.toml:2: ", "`overflow` is on already", "remove it once"],
    );
}

#[test]
fn an_effect_of_another_plant() {
    model_refused(
        model_with("effects = []", "effects = [\"sqrt_outflow\"]"),
        &[
            "bad.toml:2: ",
            "`sqrt_outflow` does not act on plant `single-tank`",
        ],
    );
}

#[test]
fn an_unknown_key() {
    model_refused(
        model_with("area = 154.0", "aera = 154.0"),
        &["bad.toml:10: unknown key aera", "did you mean area?"],
    );
}

#[test]
fn bad_toml() {
    model_refused(
        model_with("effects = []", "effects = ["),
        &["bad.toml:", "array"],
    );
    model_refused(
        model_with("plant = \"single-tank\"", "plant = single-tank"),
        &["bad.toml:1: ", "quote"],
    );
}

#[test]
fn a_model_file_that_is_not_text() {
    model_refused(
        b"plant = \"\xff\xfe\"",
        &["bad.toml: ", "not UTF-8 text", "save it as UTF-8"],
    );
}

#[test]
fn a_negative_area() {
    model_refused(
        model_with("area = 154.0", "area = -154.0"),
        &[
            "bad.toml:10: area = -154 has to be above zero",
            "correct it",
        ],
    );
}

#[test]
fn a_word_for_a_number() {
    model_refused(
        model_with("area = 154.0", "area = \"154.0\""),
        &["bad.toml:10: ", "without quotes"],
    );
}

#[test]
fn an_unknown_start() {
    model_refused(
        bundled("tour.toml") + "\n[start]\nalfa = 11.0\n",
        &["bad.toml:13: ", "alfa", "did you mean alpha?"],
    );
}

#[test]
fn a_model_file_that_is_not_there() {
    let place = place();
    let says = [
        "none.toml: the model file cannot be opened",
        "check the path",
    ];
    both_refuse(&place, "tour.csv --model none.toml", &says);
    place.refuses("add overflow --model none.toml", &says);
    place.refuses("remove overflow --model none.toml", &says);
}

#[test]
fn a_folder_for_a_model_file() {
    let place = place();
    fs::create_dir(place.path("models")).unwrap();
    let says = ["models: ", "it is a folder", "name a file"];
    both_refuse(&place, "tour.csv --model models", &says);
    place.refuses("add overflow --model models", &says);
}

#[test]
fn record_and_model_exchanged() {
    let place = place();
    both_refuse(&place, "tour.toml --model tour.csv", &["tour.csv:1: "]);
}

#[test]
fn a_result_in_a_folder_that_is_not_there() {
    let place = place();
    for command in ["compare", "diagnose"] {
        for result in ["--json no/out.json", "--report no/out.html"] {
            place.refuses(
                &format!("{command} tour.csv --model tour.toml {result}"),
                &["no/out.", "there is no folder no", "make it first"],
            );
        }
    }
}

#[test]
fn a_folder_for_a_result() {
    let place = place();
    fs::create_dir(place.path("results")).unwrap();
    for result in ["--json", "--report"] {
        place.refuses(
            &format!("diagnose tour.csv --model tour.toml {result} results"),
            &["results: it is a folder", "give the name of a file in it"],
        );
    }
}

#[test]
fn a_result_onto_an_input() {
    let place = place();
    for command in ["compare", "diagnose"] {
        for option in ["--json", "--report"] {
            for name in ["tour.csv", "tour-test.csv", "tour.toml", "./tour.csv"] {
                place.refuses(
                    &format!(
                        "{command} tour.csv --model tour.toml --test tour-test.csv {option} {name}"
                    ),
                    &[
                        &format!("{name}: it is one of the inputs"),
                        "choose another name",
                    ],
                );
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn a_result_onto_a_link_to_an_input() {
    let place = place();
    std::os::unix::fs::symlink(place.path("tour.csv"), place.path("link.json")).unwrap();
    place.refuses(
        "diagnose tour.csv --model tour.toml --json link.json",
        &["link.json: it is one of the inputs"],
    );
}

#[test]
fn results_onto_each_other() {
    place().refuses(
        "diagnose tour.csv --model tour.toml --json result --report ./result",
        &["result: two results cannot share a file"],
    );
}

#[test]
fn a_result_onto_a_foreign_file() {
    let place = place();
    place.write("notes.json", "{\"schema\": 3, \"mine\": true}");
    place.write("notes.html", "<html><p>my notes, made with ctid</p></html>");
    for command in ["compare", "diagnose"] {
        for result in [
            "--json notes.json --report out.html",
            "--json out.json --report notes.html",
            // What ctid wrote, but not of this kind.
            "--json out.html",
            "--report out.json",
        ] {
            place.refuses(
                &format!("{command} tour.csv --model tour.toml {result}"),
                &[
                    "it is there already, and ctid did not write it",
                    "choose another name or delete it",
                ],
            );
        }
    }
}

#[test]
fn a_record_given_twice_or_fitted_and_held_out() {
    let place = place();
    both_refuse(
        &place,
        "tour.csv ./tour.csv --model tour.toml",
        &["./tour.csv: ", "given twice"],
    );
    both_refuse(
        &place,
        "tour.csv --model tour.toml --test ./tour.csv",
        &["./tour.csv: ", "both fitted and held out", "another record"],
    );
}

#[test]
fn two_records_of_one_name_are_told_apart() {
    let place = place();
    place.write("any.toml", "plant = \"single-tank\"\n");
    for (folder, unit) in [("monday", "y [cm]"), ("tuesday", "y [mm]")] {
        fs::create_dir(place.path(folder)).unwrap();
        place.write(
            &format!("{folder}/log.csv"),
            Rows::new().with(1, 2, unit).text(),
        );
    }
    both_refuse(
        &place,
        "monday/log.csv tuesday/log.csv --model any.toml",
        &[
            "tuesday/log.csv: column \"y\" is in mm",
            "monday/log.csv has it in cm",
        ],
    );
}

#[test]
fn effects_that_cannot_be_added_or_removed() {
    let place = place();
    place.write(
        "on.toml",
        model_with("effects = []", "effects = [\"overflow\"]"),
    );
    for (words, says) in [
        (
            "add overfow --model tour.toml",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
        (
            "add overflow --model on.toml",
            ["on.toml: overflow is on already", "`ctid remove overflow`"],
        ),
        (
            "add sqrt_outflow --model tour.toml",
            ["tour.toml: ", "does not act on plant `single-tank`"],
        ),
        (
            "add overflow --where upper --model tour.toml",
            ["tour.toml: ", "has one vessel"],
        ),
        (
            "remove overfow --model on.toml",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
        (
            "remove pump_lag --model on.toml",
            ["on.toml: pump_lag is not on", "effects = [\"overflow\"]"],
        ),
        (
            "effects overfow",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
    ] {
        place.refuses(words, &says);
    }
}

#[test]
fn wrong_usage() {
    let place = place();
    for (words, says) in [
        (
            "diagnos tour.csv --model tour.toml",
            ["'diagnos'", "diagnose"],
        ),
        (
            "diagnose tour.csv --modle tour.toml",
            ["'--modle'", "'--model'"],
        ),
        ("diagnose tour.csv", ["--model", "--help"]),
        ("diagnose --model tour.toml", ["DATA.csv", "--help"]),
        (
            "diagnose tour.csv --model tour.toml --max-effects 0",
            ["'0'", "--max-effects"],
        ),
        (
            "add overflow --where middle --model tour.toml",
            ["'middle'", "upper, lower"],
        ),
        ("remove overflow", ["--model", "--help"]),
    ] {
        place.refuses(words, &says);
    }
}
