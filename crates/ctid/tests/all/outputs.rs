//! Several measured levels, through the program: output of each, and errors.

use std::fmt::Write;

use crate::common::Place;

/// Two tanks in series under a command that steps, both levels read: a linear plant, with some noise.
fn record(header: &str, read: impl Fn(usize, [f64; 2]) -> [String; 2]) -> String {
    let mut text = format!("{header}\n");
    let mut levels = [8.0, 8.0];
    // A sequence that is the same on every machine.
    let mut state = 1_u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    for k in 0..240_usize {
        let command = if (k / 30).is_multiple_of(2) { 2.0 } else { 4.0 };
        let readings = levels.map(|level| level + 0.1 * noise());
        let [upper, lower] = read(k, readings);
        writeln!(text, "{},{command},{upper},{lower}", 2 * k).unwrap();
        levels[1] += 2.0 * (levels[0] - levels[1]) / 40.0;
        levels[0] += 2.0 * (4.0 * command - levels[0]) / 25.0;
    }
    text
}

/// Readings with a given number of digits.
fn digits(_: usize, readings: [f64; 2]) -> [String; 2] {
    readings.map(|reading| format!("{reading:.6}"))
}

/// The model of two linear tanks, with the names of the two outputs.
fn model(upper: &str, lower: &str) -> String {
    format!(
        "plant = \"cascaded-tanks-linear\"\n[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\n\
         output = [\"{upper}\", \"{lower}\"]\n[known]\nmeasured = [\"upper\", \"lower\"]\n"
    )
}

#[test]
fn names_of_outputs_steer_no_terminal() {
    let place = Place::empty();
    place.write(
        "a.csv",
        record(
            "t [s],u [V],\u{1b}[2Jupper [\u{7}cm],low\u{202e}er [\u{7}cm]",
            digits,
        ),
    );
    place.write("m.toml", model("\\u001b[2Jupper", "low\\u202eer"));
    for command in ["compare", "diagnose"] {
        let said = place.succeeds(&format!("{command} a.csv --model m.toml"));
        let steers = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
        assert!(!said.contains(steers), "{said:?}");
        assert!(said.contains("\\u{1b}[2Jupper") && said.contains("\\u{7}cm"));
    }
}

#[test]
fn a_held_out_record_without_one_of_the_outputs_is_refused() {
    let place = Place::empty();
    place.write("a.csv", record("t [s],u [V],upper [cm],lower [cm]", digits));
    place.write("b.csv", record("t [s],u [V],upper [cm],other [cm]", digits));
    place.write("m.toml", model("upper [cm]", "lower [cm]"));
    for command in ["compare", "diagnose"] {
        let line = format!("{command} a.csv --test b.csv --model m.toml");
        place.refuses(
            &line,
            &["b.csv, row 1", "no column \"lower [cm]\" for the output"],
        );
    }
}
