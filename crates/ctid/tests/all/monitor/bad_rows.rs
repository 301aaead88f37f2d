//! Rows that are not used, and their messages.

use super::{HEADER, MODEL, assert_says, fed, place, rows, text};

#[test]
fn a_reading_far_above_the_tank_is_refused() {
    let place = place();
    place.write("m.toml", MODEL.to_string() + "tank_height = 60.0\n");
    let clean = text(HEADER, &rows(1100, 9999));
    let bad = clean.replacen("\n2,", "\n1,15,5,160\n2,", 1);
    assert_ne!(clean, bad);
    let outcome = fed(&place, "", bad);
    let said =
        "row 3: column \"y [cm]\": 160 is far above the tank, tank_height = 60; check the sensor";
    assert_says(&outcome, said);
}

#[test]
fn bad_rows_are_said_skipped_and_not_flooded_with() {
    let rows = rows(1400, 1100);
    let clean = text(HEADER, &rows);
    let mut bad = String::new();
    for (k, line) in clean.lines().enumerate() {
        bad += line;
        bad += "\n";
        match k {
            100 => bad += "text,15,5,16\n",
            101 => bad += "203,15,,16\n",
            102 => bad += "1,15,5,16\n",
            1200..1300 => bad += "2403,15\n",
            _ => {}
        }
    }
    let place = place();
    let outcome = fed(&place, "", &bad);
    assert_eq!(outcome.code, Some(0));
    assert_eq!(outcome.out, fed(&place, "", &clean).out);
    for said in [
        "standard input, row 102: column \"t [s]\": \"text\" is not a number",
        "standard input, row 104: column \"u [V]\": the cell is empty",
        "standard input, row 106: column \"t [s]\": the time goes back from 202 s to 1 s",
        "2 fields where 4 are read",
        "; the row is skipped",
    ] {
        assert_says(&outcome, said);
    }
    assert!(outcome.err.lines().count() < 40, "{}", outcome.err);
    assert_says(&outcome, "103 of them with something wrong");
}

/// A reader that connects to a running line receives the end of a row first. Empty, no number, not finite, or a word: the rows' commands
/// are used, and the simulation continues.
#[test]
fn a_row_without_a_reading_is_said_and_its_command_used() {
    let rows = rows(2000, 9999);
    let words = ["", "NaN", "missing", "-", "inf"];
    let mut lines = HEADER.to_string();
    let mut lost = 0;
    for k in 0..rows.len() {
        let [t, u, y] = rows[k];
        if k > 0 && u != rows[k - 1][1] {
            lines += &format!("{t},15,{u},{}\n", words[lost % words.len()]);
            lost += 1;
        } else {
            lines += &format!("{t},15,{u},{y:.4}\n");
        }
    }
    let outcome = fed(&place(), "", &lines);
    assert_eq!((outcome.code, outcome.out.as_str()), (Some(0), ""));
    assert_says(
        &outcome,
        "column \"y [cm]\": the cell is empty; check the program that writes the rows; the reading is lost, the command of the row is used",
    );
    assert_says(
        &outcome,
        "column \"y [cm]\": \"NaN\" stands for a missing sample; the reading is lost",
    );
    assert_says(
        &outcome,
        "column \"y [cm]\": \"missing\" stands for a missing sample; the reading is lost",
    );
    assert_says(&outcome, &format!("{lost} of them with something wrong"));
}

/// Each of the first digits of the state's numbers, changed to another: the file is valid JSON with other numbers.
#[test]
fn a_state_in_which_a_digit_has_changed_is_refused() {
    let place = place();
    let text = text(HEADER, &rows(1500, 9999));
    assert_eq!(fed(&place, "--state s.json", &text).code, Some(0));
    let state = place.read("s.json");
    let from = state.find("\"kept\"").unwrap();
    let digits: Vec<usize> = state[from..]
        .char_indices()
        .filter(|(_, c)| c.is_ascii_digit())
        .map(|(at, _)| from + at)
        .step_by(state.len() / 8)
        .collect();
    assert!(!digits.is_empty());
    for at in digits {
        let mut spoilt = state.clone();
        let other = if &state[at..=at] == "7" { "8" } else { "7" };
        spoilt.replace_range(at..=at, other);
        place.write("s.json", spoilt);
        let outcome = fed(&place, "--state s.json", &text);
        assert_eq!(outcome.code, Some(2));
        assert_says(
            &outcome,
            "s.json: it is damaged: its numbers do not agree with its checksum; use another state file with --state FILE, or delete this one to start again",
        );
    }
}

#[test]
fn a_line_ends_at_a_carriage_return_as_in_a_file() {
    let outcome = fed(&place(), "", "0,1,2\n1,1,3\r2,1,3\n");
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "the rows have ended after 3 lines");
}

#[test]
fn a_header_that_comes_again_in_other_units_than_the_model_names_ends_it() {
    let place = place();
    place.write(
        "m.toml",
        format!("{MODEL}[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\noutput = \"y [cm]\"\n"),
    );
    for header in [
        "t [s],r [cm],u [V],y [bar]",
        "t [parsec],r [cm],u [V],y [cm]",
    ] {
        let outcome = fed(
            &place,
            "",
            format!("{HEADER}0,15,5,16\n1,15,5,16\n{header}\n2,15,5,160\n"),
        );
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert_says(&outcome, "standard input, row 4, column");
    }
}

#[test]
fn a_stream_may_begin_in_the_middle_of_a_row() {
    let place = place();
    let lines = text("", &rows(1100, 9999));
    for part in ["5,4.5,14.8\n", ".5,14.8\n", "8\n"] {
        let outcome = fed(&place, "", part.to_string() + &lines);
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        assert_says(&outcome, "t, r, u, y");
        assert_says(&outcome, "learned from");
        assert_says(&outcome, "1 of them with something wrong");
    }
}

#[test]
fn a_gap_is_said_with_its_row() {
    let mut rows = rows(1500, 9999);
    rows.drain(1200..1203);
    let outcome = fed(&place(), "", text(HEADER, &rows));
    let said = "standard input, row 1202, column \"t [s]\": 3 rows are missing (the time steps from 2398 to 2406 s)";
    assert_says(&outcome, said);
    assert_eq!(outcome.out, "");
}

#[test]
fn what_is_no_row_at_all_is_refused() {
    let place = place();
    let refused = |bytes: &str, says: &str| {
        let outcome = fed(&place, "", bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(
            outcome.err.contains("error: ") && outcome.err.contains(says),
            "{}",
            outcome.err
        );
        assert_eq!(outcome.out, "");
    };
    refused(
        "",
        "standard input is empty; rows such as 0,15,4.5,14.8 (t, r, u, y) are needed",
    );
    refused("\n# nothing\n\n", "standard input is empty");
    refused("1,2\n1,2\n1,2\n", "2 numbers and no header");
    refused(
        "time,level\n1,2\n",
        "no column beginning with \"u\" for the input",
    );
    refused(
        "time,level\n",
        "no column beginning with \"u\" for the input",
    );
    refused(
        "time,level,state\n0,2.3,RUN\n1,2.4,RUN\n",
        "row 1: no column beginning with \"u\" for the input",
    );
    refused(
        "t [s],u [V],y [cm]\ns,V,mm\n0,1,2\n",
        "row 2, column \"y [cm]\"",
    );
    place.write("m.toml", MODEL.replace("single-tank", "single-tonk"));
    refused("0,1,2,3\n", "unknown plant");
    place.write(
        "m.toml",
        "plant = \"single-tank\"\neffects = [\"sensor_drift\"]\n",
    );
    refused("0,1,2,3\n", "ctid remove sensor_drift --model m.toml");
}
