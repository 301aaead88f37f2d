//! The process: its state on disk, signals, closed pipes, lines without an end.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::Child;
use std::thread;
use std::time::Duration;

use super::{HEADER, MODEL, begun, fed, place, rows, text};

#[test]
fn a_state_goes_on_where_it_was() {
    let rows = rows(2200, 1600);
    let place = place();
    let whole = fed(&place, "", text(HEADER, &rows));
    let mut parts = String::new();
    for (from, to) in [(0, 500), (500, 1300), (1300, 1640), (1640, 2200)] {
        // The log is given from a little before where it ended: what was seen is skipped.
        let again = if from == 1300 { 1290 } else { from };
        let outcome = fed(&place, "--state s.json", text(HEADER, &rows[again..to]));
        assert_eq!(outcome.code, Some(0), "{}", outcome.err);
        assert_eq!(
            outcome.err.contains("goes on from"),
            from > 0,
            "{}",
            outcome.err
        );
        let before = "10 rows up to here were seen before";
        assert_eq!(
            outcome.err.contains(before),
            from == 1300,
            "{}",
            outcome.err
        );
        parts += &outcome.out;
    }
    assert!(!whole.out.is_empty());
    assert_eq!(parts, whole.out);

    let refused = |words: &str, bytes: &str, says: &str| {
        let kept = place.snapshot();
        let outcome = fed(&place, words, bytes);
        assert_eq!(outcome.code, Some(2), "{}", outcome.err);
        assert!(outcome.err.contains(says), "{}", outcome.err);
        assert_eq!(place.snapshot(), kept);
    };
    refused(
        "--state s.json",
        "t [s],u [mV],y [mm]\n",
        "the saved state is in command [V], reading [cm]",
    );
    refused("--state m.toml", "0,1,2,3\n", "it is the model file");
    place.write("notes.txt", "mine");
    refused(
        "--state notes.txt",
        "0,1,2,3\n",
        "it is not a state file of `ctid monitor`",
    );
    refused("--state no/s.json", "0,1,2,3\n", "choose another folder");
    place.write("m.toml", MODEL.replace("154", "155"));
    refused(
        "--state s.json",
        "0,1,2,3\n",
        "the state belongs to another model: area: 154 then, 155 now; use another state file",
    );
}

/// Interrupted or terminated without a new row, the program saves its state and ends with success; killed, the last state file is complete.
#[test]
#[cfg(unix)]
fn a_signal_ends_it_with_its_state_saved() {
    let rows = rows(1500, 9999);
    for (signal, code) in [("INT", Some(0)), ("TERM", Some(0)), ("KILL", None)] {
        let place = place();
        let (mut child, mut input) = begun(&place, "--state s.json --estimates");
        input.write_all(text(HEADER, &rows).as_bytes()).unwrap();
        input.flush().unwrap();
        // The first estimates: the rows have come.
        let mut first = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut first).unwrap();
        thread::sleep(Duration::from_millis(300));
        let kill = std::process::Command::new("kill")
            .args([format!("-{signal}"), child.id().to_string()])
            .status()
            .unwrap();
        assert!(kill.success());
        let mut err = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut err)
            .unwrap();
        assert_eq!(child.wait().unwrap().code(), code, "{signal}: {err}");
        assert_eq!(place.path("s.json").exists(), code.is_some());
        let left: Vec<_> = place.snapshot().into_keys().collect();
        assert_eq!(left.len(), if code.is_some() { 2 } else { 1 }, "{left:?}");
        if code.is_some() {
            assert!(err.contains("stopped after 1501 lines"), "{err}");
            let more = fed(&place, "--state s.json", text(HEADER, &rows[1490..]));
            assert_eq!(more.code, Some(0), "{}", more.err);
        }
        drop(input);
    }
}

/// The reader of the alarms has closed the pipe: the program saves and ends.
#[test]
fn a_closed_pipe_ends_it() {
    let place = place();
    let (mut child, mut input) = begun(&place, "--state s.json --estimates --interval 2");
    drop(child.stdout.take());
    let bytes = text(HEADER, &rows(2000, 9999));
    let writer = thread::spawn(move || {
        let _ = input.write_all(bytes.as_bytes());
        input
    });
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(err.contains("standard output was closed"), "{err}");
    assert!(place.path("s.json").exists());
    drop(writer.join().unwrap());
}

/// A line without an end is not stored: the memory is constant.
#[test]
#[cfg(target_os = "linux")]
fn a_line_without_an_end_is_thrown_away() {
    let place = place();
    let (mut child, mut input) = begun(&place, "");
    input
        .write_all(text(HEADER, &rows(1200, 9999)).as_bytes())
        .unwrap();
    let before = peak(&child);
    let part = vec![b'7'; 1 << 20];
    for _ in 0..200 {
        input.write_all(&part).unwrap();
    }
    let after = peak(&child);
    input.write_all(b"\n").unwrap();
    drop(input);
    let mut err = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert!(child.wait().unwrap().success(), "{err}");
    assert!(
        err.contains("row 1202: more than 65536 bytes without an end of line"),
        "{err}"
    );
    // Half of the line: the monitor may still have to learn from the rows before it.
    assert!(after < before + 100_000, "{before} kB, then {after} kB");
}

/// Largest resident size so far \[kB\].
#[cfg(target_os = "linux")]
fn peak(child: &Child) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmHWM"))
        .unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}
