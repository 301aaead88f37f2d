//! Where the system refuses something the program ends with exit code 2 and one line, as on any other error.
#![cfg(target_os = "linux")]

use std::process::Command;

use crate::common::Place;

/// Exit code and standard error of a run under a limit of the shell's.
fn limited(place: &Place, limit: &str, words: &str) -> (Option<i32>, String) {
    let run = format!("{limit}; exec \"$0\" {words}");
    let outcome = Command::new("sh")
        .args(["-c", &run, env!("CARGO_BIN_EXE_ctid")])
        .current_dir(place.path(""))
        .env("RAYON_NUM_THREADS", "2000")
        .output()
        .unwrap();
    (
        outcome.status.code(),
        String::from_utf8(outcome.stderr).unwrap(),
    )
}

#[test]
fn threads_that_cannot_be_started_are_an_error() {
    let place = Place::new();
    let (code, said) = limited(
        &place,
        "ulimit -v 1000000",
        "compare tour.csv --model tour.toml",
    );
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("RAYON_NUM_THREADS=1"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

/// The page is far larger than the files that are allowed.
#[test]
fn a_file_larger_than_allowed_is_an_error() {
    let place = Place::new();
    let (code, said) = limited(
        &place,
        "RAYON_NUM_THREADS=2; ulimit -f 8",
        "compare tour.csv --model tour.toml --report out.html",
    );
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("out.html: cannot be written"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(!place.path("out.html").exists());
}
