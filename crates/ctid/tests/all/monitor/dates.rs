//! Rows with dates.

use serde_json::Value;

use super::{HEADER, assert_says, events, fed, place, rows, text};

/// The same rows with dates of Berlin, from shortly before the start of summer time.
pub(super) fn dated(rows: &[[f64; 3]]) -> String {
    let mut text = "time,u [V],y [cm]\n".to_string();
    for [t, u, y] in rows {
        let mut second = 3600 + 1800 + *t as u64;
        if second >= 2 * 3600 {
            second += 3600;
        }
        let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
        text += &format!("2026-03-29 {h:02}:{m:02}:{s:02},{u},{y:.4}\n");
    }
    text
}

const BERLIN: &str =
    "plant = \"single-tank\"\n[columns]\ntime_zone = \"Europe/Berlin\"\n[known]\narea = 154.0\n";

/// The monitor has the same results as with times in seconds, prints dates, and continues with the same clock.
#[test]
fn dates_are_read_and_said_also_after_a_restart() {
    let rows = rows(2200, 1600);
    let place = place();
    let plain = fed(&place, "", text(HEADER, &rows));
    place.write("m.toml", BERLIN);
    let whole = fed(&place, "", dated(&rows));
    assert_eq!(whole.code, Some(0), "{}", whole.err);
    let pairs = || events(&plain.out).into_iter().zip(events(&whole.out));
    assert!(pairs().count() > 0 && plain.out.lines().count() == whole.out.lines().count());
    for (seconds, dates) in pairs() {
        for key in ["event", "time", "since", "effects", "evidence", "score"] {
            assert_eq!(seconds[key], dates[key], "{key}");
        }
        let of_day = |time: &Value| {
            let second = 2 * 3600 + 1800 + time.as_f64().unwrap() as u64;
            let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
            format!("{h:02}:{m:02}:{s:02}")
        };
        let at = of_day(&dates["time"]);
        assert_eq!(dates["date"], format!("2026-03-29T{at}+02:00"));
        let since = of_day(&dates["since"]);
        assert_eq!(dates["since_date"], format!("2026-03-29T{since}+02:00"));
        let sentence = dates["sentence"].as_str().unwrap();
        let said = format!(" since 2026-03-29 {since}");
        assert!(
            sentence.contains(said.trim_end_matches(":00")),
            "{sentence}"
        );
        assert!(seconds.get("date").is_none());
    }
    assert!(!whole.err.contains("t = "), "{}", whole.err);

    let mut parts = String::new();
    for (from, to) in [(0, 500), (490, 1300), (0, 1640), (1640, 2200)] {
        let outcome = fed(&place, "--state s.json", dated(&rows[from..to]));
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        parts += &outcome.out;
    }
    assert_eq!(parts, whole.out);

    let refused = |bytes: &str, says: &str| {
        let kept = place.snapshot();
        let outcome = fed(&place, "--state s.json", bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(outcome.err.contains(says), "{}", outcome.err);
        assert_eq!(place.snapshot(), kept);
    };
    let header = "time,u [V],y [cm]\n";
    refused(
        &format!("{header}9999,4,12\n"),
        "row 2, column \"time\": the times are numbers, and the saved state has dates",
    );
    refused(
        &format!("{header}23:59:59,4,12\n"),
        "times of day do not say where a saved state goes on; give dates, or leave out --state",
    );
    place.write("m.toml", BERLIN.replace("Berlin", "London"));
    refused(
        &dated(&rows),
        "the times are dates of Europe/London, and the saved state has dates of Europe/Berlin",
    );
}

#[test]
fn dates_that_no_row_can_make_plain_end_it() {
    let place = place();
    let outcome = fed(&place, "", "time,u [V],y [cm]\n03/04/2026 10:00,4,12\n");
    assert_eq!(outcome.code, Some(2), "{}", outcome.err);
    assert_says(
        &outcome,
        "standard input, row 2, column \"time\": \"03/04/2026 10:00\" is ambiguous",
    );
    // A row that is cut in the middle does not determine the format.
    let lines = "5:00,4.5,14.8\n2026-03-29 10:00:02,4,12\n2026-03-29 10:00:04,4,12\n";
    let outcome = fed(&place, "", lines);
    assert_eq!(outcome.code, Some(0), "{}", outcome.err);
    assert_says(&outcome, "1 of them with something wrong");
    // The times go back, and the message quotes the time as written.
    let lines = "2026-03-29 10:00:02,4,12\n2026-03-29 10:00:04,4,12\n2026-03-29 10:00:03,4,12\n";
    let outcome = fed(&place, "", lines);
    assert_says(
        &outcome,
        "row 3: column \"time\": the time goes back from 2026-03-29 10:00:04 to 2026-03-29 10:00:03; rows have to come in the order of time",
    );
}
