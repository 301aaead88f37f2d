//! The program as a process: this executable, called again. What it must keep, whatever it is given.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{self, Child, Command, ExitCode, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;
use wait4::Wait4;

use super::Ended;

/// The word after which an executable is the program.
const AS_PROGRAM: &str = "--as-ctid";
/// Processor time of a run at most \[s\].
const MOST_SECONDS: f64 = 20.0;
/// Memory of a run at most \[MB\].
const MOST_MEGABYTES: f64 = 500.0;
/// Characters of an error at most.
const LONGEST_ERROR: usize = 300;
/// A process that still runs then stands still: the longest run has ended long before, also on a busy machine.
const PATIENCE: Duration = Duration::from_secs(150);

/// Where this executable was called as the program, runs it to its exit code. Call it first.
#[must_use]
pub fn as_program() -> Option<ExitCode> {
    let mut words = env::args_os().skip(1);
    if words.next()? != AS_PROGRAM {
        return None;
    }
    thread::spawn(|| {
        thread::sleep(PATIENCE);
        process::abort();
    });
    Some(ctid::program(
        [OsString::from("ctid")].into_iter().chain(words),
    ))
}

/// A folder with files, to run the program in.
pub(super) struct Folder(TempDir);

/// Files by name.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Without a folder there is nothing to say of the program.
fn must<T, E: std::fmt::Display>(result: Result<T, E>, what: &str) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("error: {what}: {error}");
        process::exit(1)
    })
}

impl Folder {
    pub fn new() -> Self {
        Self(must(tempfile::tempdir(), "no folder for a case"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        must(fs::write(self.path(name), content), "no file for a case");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_default()
    }

    fn files(&self) -> Files {
        let entries = must(fs::read_dir(self.0.path()), "no folder for a case");
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        paths
            .map(|path| (path.clone(), fs::read(path).unwrap_or_default()))
            .collect()
    }

    /// The program, to be run in this folder.
    pub fn command<'a>(&self, words: impl IntoIterator<Item = &'a str>) -> Command {
        let mut command = Command::new(must(env::current_exe(), "no executable"));
        command
            .arg(AS_PROGRAM)
            .args(words)
            .current_dir(self.0.path())
            .env("RAYON_NUM_THREADS", "1")
            .stdin(Stdio::null());
        command
    }

    /// Runs the program on `words`, its standard input from the file `input`, and says how it ended. Of the files `outputs` it
    /// may write some, where it refuses only what it wrote before it came to the row that it refuses; the others stay as they are.
    pub fn run(&self, words: &str, input: Option<&str>, outputs: &[&str]) -> Ended {
        let before = self.files();
        let mut command = self.command(words.split_whitespace());
        if let Some(name) = input {
            command.stdin(must(File::open(self.path(name)), "no file for a case"));
        }
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = must(command.spawn(), "the program cannot be started");
        let printed = [
            child.stdout.take().map(|pipe| drained(pipe)),
            child.stderr.take().map(|pipe| drained(pipe)),
        ];
        let (code, seconds, megabytes) = waited(child);
        let [out, err] =
            printed.map(|pipe| pipe.and_then(|pipe| pipe.join().ok()).unwrap_or_default());
        let mut ended = Ended {
            accepted: code == Some(0),
            seconds,
            megabytes,
            refusal: err.lines().last().unwrap_or_default().to_string(),
            fault: None,
        };
        let after = self.files();
        let may_write = ended.accepted || input.is_some();
        ended.fault = (|| {
            said(code, &out, &err)?;
            kept(&ended)?;
            for (path, bytes) in &before {
                let named = |name: &&str| path.ends_with(name);
                let may = may_write && outputs.iter().any(|name| named(name));
                if !may && after.get(path) != Some(bytes) {
                    return Err(format!("{} was changed", path.display()));
                }
            }
            let new = after.keys().filter(|path| !before.contains_key(*path));
            for path in new {
                if !may_write || !outputs.iter().any(|name| path.ends_with(name)) {
                    return Err(format!("{} was written", path.display()));
                }
                if path
                    .extension()
                    .is_some_and(|extension| extension == "json")
                {
                    result(path, &after[path])?;
                }
            }
            Ok(())
        })()
        .err()
        .map(|fault| format!("ctid {words}: {fault}"));
        ended
    }
}

/// A pipe that nobody empties would stop the program.
fn drained(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Exit code, processor time \[s\], memory \[MB\].
pub(super) fn waited(mut child: Child) -> (Option<i32>, f64, f64) {
    let used = must(child.wait4(), "the program cannot be waited for");
    let seconds = (used.rusage.utime + used.rusage.stime).as_secs_f64();
    (
        used.status.code(),
        seconds,
        used.rusage.maxrss as f64 / (1024.0 * 1024.0),
    )
}

/// What every process keeps.
fn kept(ended: &Ended) -> Result<(), String> {
    if ended.seconds > MOST_SECONDS {
        return Err(format!("{:.0} s of processor time", ended.seconds));
    }
    if ended.megabytes > MOST_MEGABYTES {
        return Err(format!("{:.0} MB", ended.megabytes));
    }
    Ok(())
}

/// What it may print.
fn said(code: Option<i32>, out: &str, err: &str) -> Result<(), String> {
    if err.contains("panicked") {
        return Err(err.to_string());
    }
    match code {
        Some(0) => {
            // The numbers of a table or of a line of JSON, and not the names of columns.
            let not_finite = |word: &str| {
                ["NaN", "inf", "-inf"].contains(&word.trim_matches([',', ';', '(', ')']))
            };
            if let Some(line) = out
                .lines()
                .find(|line| line.split_whitespace().any(not_finite))
            {
                return Err(format!("it prints: {line}"));
            }
        }
        Some(2) => {
            let Some(line) = err
                .lines()
                .last()
                .filter(|line| line.starts_with("error: "))
            else {
                return Err(format!("it ends with code 2 and says {err:?}"));
            };
            message(line)?;
        }
        _ => return Err(format!("it ends with {code:?} and says {err:?}")),
    }
    let unclean = out
        .chars()
        .chain(err.chars())
        .find(|&c| c != '\n' && unprintable(c));
    unclean.map_or(Ok(()), |c| Err(format!("it prints {c:?}")))
}

/// A message for people is short, and shows no character that moves the others.
pub(super) fn message(text: &str) -> Result<(), String> {
    if let Some(c) = text.chars().find(|&c| unprintable(c)) {
        return Err(format!("{c:?} in a message: {text:?}"));
    }
    if text.chars().count() > LONGEST_ERROR {
        return Err(format!(
            "a message of {} characters: {text}",
            text.chars().count()
        ));
    }
    Ok(())
}

/// Control characters, and those that turn the direction of a text.
fn unprintable(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Keys of results that hold a number wherever they are.
const NUMBERS: [&str; 3] = ["rmse", "value", "noise_floor"];

/// A result in JSON holds numbers where it has to.
fn result(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let name = path.display();
    let json: Value = serde_json::from_slice(bytes).map_err(|error| format!("{name}: {error}"))?;
    let mut rest = vec![&json];
    while let Some(value) = rest.pop() {
        match value {
            Value::Array(items) => rest.extend(items),
            Value::Object(entries) => {
                if let Some(key) = NUMBERS
                    .iter()
                    .find(|key| entries.get(**key).is_some_and(Value::is_null))
                {
                    return Err(format!("{name}: {key} is no number: {value}"));
                }
                rest.extend(entries.values());
            }
            _ => {}
        }
    }
    Ok(())
}
