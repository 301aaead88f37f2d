//! Files are complete even if the system fails: each call for them fails once, with one of two errors in turn, and the program is killed at
//! each of them. Afterwards the folder has the complete old file or the complete new one.
//!
//! The calls fail by `strace`; where it cannot be used the tests are ignored.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::Place;

/// The calls that create, fill and rename files.
const CALLS: &str = "openat,write,pwrite64,fsync,fdatasync,ftruncate,fchmod,fchown,fsetxattr,flistxattr,flock,link,linkat,rename,renameat,renameat2,unlink,unlinkat,chmod,mkdir";
const ERRORS: [&str; 2] = ["ENOSPC", "EIO"];

/// A call that may fail: its name, and its number among the calls of this name in its thread.
type Call = (String, usize);

/// A command, its standard input, the files that it writes, and what stands in them before it: nothing, or what it wrote earlier.
struct Written {
    words: &'static str,
    input: &'static str,
    files: &'static [&'static str],
    /// Arguments of a run before, without failures.
    before: &'static str,
    /// Arguments of a run after, which writes the same files.
    after: &'static str,
}

struct Run {
    code: Option<i32>,
    err: String,
    /// The calls in the folder, in order.
    calls: Vec<Call>,
}

fn traced(place: &Place, words: &str, input: &str, inject: Option<&str>) -> Run {
    let log = tempfile::NamedTempFile::new().unwrap();
    let program = place.command(words);
    let mut command = Command::new("strace");
    command
        .args(["-f", "-y", "-qq", "-e", &format!("trace={CALLS}"), "-o"])
        .arg(log.path());
    if let Some(inject) = inject {
        command.args(["-e", &format!("inject={inject}")]);
    }
    command
        .arg(program.get_program())
        .args(program.get_args())
        .current_dir(place.path(""))
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command.stdin(match input {
        "" => Stdio::null(),
        name => fs::File::open(place.path(name)).unwrap().into(),
    });
    let outcome = command.output().unwrap();
    let text = fs::read_to_string(log.path()).unwrap();
    Run {
        code: outcome.status.code(),
        err: String::from_utf8_lossy(&outcome.stderr).into_owned(),
        calls: calls(&text, &place.path("")),
    }
}

/// The calls of a log that touch the folder.
fn calls(log: &str, folder: &Path) -> Vec<Call> {
    let folder = folder.canonicalize().unwrap().display().to_string();
    let folder = folder.trim_end_matches('/');
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut found = Vec::new();
    for line in log.lines() {
        let Some((thread, call)) = line.split_once(' ') else {
            continue;
        };
        let Some((name, arguments)) = call.trim_start().split_once('(') else {
            continue;
        };
        if !name
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        {
            continue;
        }
        let count = counts.entry((thread, name)).or_default();
        *count += 1;
        // Paths outside the program's folder are relative to no handle: only these calls have none.
        let by_name = ["rename", "link", "unlink", "chmod", "mkdir"].contains(&name);
        let reads = name == "openat" && !arguments.contains("O_CREAT");
        if (by_name || arguments.contains(folder)) && !reads {
            found.push((name.to_string(), *count));
        }
    }
    found
}

/// Whether a file is complete.
fn is_whole(name: &str, bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    match name.rsplit('.').next() {
        Some("json") => serde_json::from_str::<Value>(&text).is_ok(),
        Some("html") => text.trim_end().ends_with("</html>"),
        Some("toml") => text.ends_with("# the last line\n"),
        _ => text.ends_with('\n'),
    }
}

/// The place of every run: small files, and what earlier runs wrote.
fn place(written: &Written) -> Place {
    let place = Place::new();
    let record = place.read("tour.csv");
    let few: Vec<&str> = record
        .lines()
        .take(if written.input.is_empty() { 60 } else { 300 })
        .collect();
    place.write("few.csv", few.join("\n") + "\n");
    place.write("m.toml", place.read("tour.toml") + "\n# the last line\n");
    if !written.before.is_empty() {
        let program = place.command(written.before);
        let mut command = program;
        if !written.input.is_empty() {
            command.stdin(fs::File::open(place.path(written.input)).unwrap());
        }
        let outcome = crate::common::outcome(command);
        assert_eq!(outcome.code, Some(0), "{}: {}", written.before, outcome.err);
    }
    place
}

/// Every call of a command fails once, and ends the command once.
fn withstands(written: &Written) {
    let words = written.words;
    let whole = traced(&place(written), words, written.input, None);
    assert_eq!(whole.code, Some(0), "{words}: {}", whole.err);
    let calls: BTreeSet<Call> = whole.calls.into_iter().collect();
    assert!(
        calls.len() >= 5,
        "{words}: it writes files with {calls:?} alone"
    );
    let mut refused = 0;
    for ((name, count), error) in calls.iter().zip(ERRORS.iter().cycle()) {
        for how in [format!("error={error}"), "signal=KILL".to_string()] {
            let place = place(written);
            let before = place.snapshot();
            let inject = format!("{name}:{how}:when={count}");
            let run = traced(&place, words, written.input, Some(&inject));
            let what = format!("{words}, {inject}: {:?} {}", run.code, run.err);
            let killed = how.ends_with("KILL");
            match run.code {
                Some(2) if !killed => {
                    refused += 1;
                    assert!(
                        run.err
                            .lines()
                            .last()
                            .unwrap_or_default()
                            .starts_with("error: "),
                        "{what}"
                    );
                }
                Some(0) => assert!(!killed || run.err.is_empty(), "{what}"),
                None if killed => {}
                _ => panic!("{what}"),
            }
            let after = place.snapshot();
            for (path, bytes) in &before {
                let name = path.file_name().unwrap().to_str().unwrap();
                if !written.files.contains(&name) {
                    assert!(after.get(path) == Some(bytes), "{what}: {name} was changed");
                }
            }
            for name in written.files {
                let path = place.path(name);
                let Some(Some(bytes)) = after.get(&path) else {
                    assert!(!before.contains_key(&path), "{what}: {name} is gone");
                    assert_ne!(run.code, Some(0), "{what}: {name} is not there");
                    continue;
                };
                assert!(is_whole(name, bytes), "{what}: {name} is not whole");
            }
            // The next run does it all, and nothing of this one is left.
            let again = traced(&place, written.after, written.input, None);
            assert_eq!(again.code, Some(0), "{what}; and then {}", again.err);
            let left: Vec<_> = place
                .snapshot()
                .into_keys()
                .filter(|path| path.to_string_lossy().contains(".part"))
                .collect();
            assert!(left.is_empty(), "{what}: {left:?} is left");
        }
    }
    // Otherwise none of the failed calls mattered.
    assert!(
        refused >= 4,
        "{words}: {refused} of {} failures were errors",
        calls.len()
    );
    println!(
        "{words}: {} calls, each failed once and killed the program once; {refused} failures were errors",
        calls.len()
    );
}

#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn results_that_are_new() {
    withstands(&Written {
        words: "compare few.csv --model m.toml --json out.json --report out.html",
        input: "",
        files: &["out.json", "out.html"],
        before: "",
        after: "compare few.csv --model m.toml --json out.json --report out.html",
    });
}

#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn results_in_the_place_of_earlier_ones() {
    withstands(&Written {
        words: "compare few.csv --model m.toml --json out.json --report out.html",
        input: "",
        files: &["out.json", "out.html"],
        before: "compare few.csv --model m.toml --json out.json --report out.html",
        after: "compare few.csv --model m.toml --json out.json --report out.html",
    });
}

#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn an_experiment() {
    withstands(&Written {
        words: "design few.csv --model m.toml --between overflow leak_at_height --out next.csv --json out.json",
        input: "",
        files: &["next.csv", "out.json"],
        before: "",
        after: "design few.csv --model m.toml --between overflow leak_at_height --out other.csv --json out.json",
    });
}

#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn a_model_file_that_is_edited() {
    withstands(&Written {
        words: "add overflow --model m.toml",
        input: "",
        files: &["m.toml"],
        before: "",
        after: "add pump_lag --model m.toml",
    });
}

#[test]
#[cfg_attr(not(strace), ignore = "strace cannot make calls fail here")]
fn a_state_that_is_saved() {
    withstands(&Written {
        words: "monitor --model m.toml --learn 100 --state state.json",
        input: "few.csv",
        files: &["state.json"],
        before: "",
        after: "monitor --model m.toml --learn 100 --state state.json",
    });
}
