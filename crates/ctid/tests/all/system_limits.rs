//! If the system refuses a call, the program ends with exit code 2 and one line, as for any other error.
#![cfg(target_os = "linux")]

use std::process::Command;

use crate::common::Place;

/// Exit code and standard error.
fn outcome(place: &Place, command: &mut Command) -> (Option<i32>, String) {
    let outcome = command.current_dir(place.path("")).output().unwrap();
    let err = String::from_utf8(outcome.stderr).unwrap();
    (outcome.status.code(), err)
}

/// The second thread fails by `strace`: with a memory limit the program might fail anywhere.
#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn threads_that_cannot_be_started_are_an_error() {
    let place = Place::new();
    let program = place.command("compare tour.csv --model tour.toml");
    let mut traced = Command::new("strace");
    traced
        .args(["-qq", "-o", "/dev/null", "-e", "trace=clone,clone3"])
        .args(["-e", "inject=clone,clone3:error=EAGAIN:when=2+"])
        .arg(program.get_program())
        .args(program.get_args())
        .env("RAYON_NUM_THREADS", "4");
    let (code, said) = outcome(&place, &mut traced);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("RAYON_NUM_THREADS=1"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

/// The page is far larger than the allowed file size.
#[test]
fn a_file_larger_than_allowed_is_an_error() {
    let place = Place::new();
    let words = "compare tour.csv --model tour.toml --report out.html";
    let mut limited = Command::new("sh");
    limited
        .args(["-c", &format!("ulimit -f 8; exec \"$0\" {words}")])
        .arg(env!("CARGO_BIN_EXE_ctid"))
        .env("RAYON_NUM_THREADS", "2");
    let (code, said) = outcome(&place, &mut limited);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("out.html: cannot be written"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(!place.path("out.html").exists());
}
