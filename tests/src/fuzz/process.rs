//! The program as a process: this executable, called again; and the checks of what it prints, writes and uses.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Read;
use std::path::PathBuf;
use std::process::{self, Child, Command, ExitCode, Stdio};
use std::thread;
use std::time::Duration;

use ct_model::ModelSpec;
use ct_signals::escaped;
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
/// A process that still runs then hangs: the longest run ends long before, on a busy machine too.
const PATIENCE: Duration = Duration::from_secs(150);

/// If this executable was started as the program, runs the program to its exit code. Call it first.
#[must_use]
pub fn as_program() -> Option<ExitCode> {
    let mut arguments = env::args_os().skip(1);
    if arguments.next()? != AS_PROGRAM {
        return None;
    }
    thread::spawn(|| {
        thread::sleep(PATIENCE);
        process::abort();
    });
    Some(ctid::program(
        [OsString::from("ctid")].into_iter().chain(arguments),
    ))
}

/// A folder with files, to run the program in.
pub(super) struct Folder {
    folder: TempDir,
    /// Threads that the program may use.
    threads: usize,
}

/// Files by name.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Without a folder the test cannot run.
fn must<T, E: std::fmt::Display>(result: Result<T, E>, what: &str) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("error: {what}: {error}");
        process::exit(1)
    })
}

impl Folder {
    pub fn new() -> Self {
        Self::with_threads(1)
    }

    pub fn with_threads(threads: usize) -> Self {
        Self {
            folder: must(tempfile::tempdir(), "no folder for a case"),
            threads,
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        must(fs::write(self.path(name), content), "no file for a case");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_default()
    }

    fn files(&self) -> Files {
        let entries = must(fs::read_dir(self.folder.path()), "no folder for a case");
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
            .current_dir(self.folder.path())
            .env("RAYON_NUM_THREADS", self.threads.to_string())
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
            child.stdout.take().map(drained),
            child.stderr.take().map(drained),
        ];
        let (code, seconds, megabytes) = waited(&mut child);
        let [out, err] =
            printed.map(|pipe| pipe.and_then(|pipe| pipe.join().ok()).unwrap_or_default());
        let mut ended = Ended {
            accepted: code == Some(0),
            seconds,
            megabytes,
            refusal: shortened(err.lines().last().unwrap_or_default()),
            fault: None,
        };
        let after = self.files();
        let may_write = ended.accepted || input.is_some();
        ended.fault = (|| {
            check_output(code, &out, &err, input.is_some())?;
            check_limits(&ended)?;
            for (path, bytes) in &before {
                let named = |name: &&str| path.ends_with(name);
                let may = may_write && outputs.iter().any(named);
                if !may && after.get(path) != Some(bytes) {
                    return Err(format!("{} was changed", path.display()));
                }
            }
            let new = after.keys().filter(|path| !before.contains_key(*path));
            for path in new {
                if !may_write || !outputs.iter().any(|name| path.ends_with(name)) {
                    return Err(format!("{} was written", path.display()));
                }
                result(&path.to_string_lossy(), &after[path])?;
            }
            Ok(())
        })()
        .err()
        .map(|fault| format!("ctid {words}: {fault}"));
        ended
    }
}

/// The stored part of an error message.
pub(super) fn shortened(text: &str) -> String {
    text.chars().take(LONGEST_ERROR).collect()
}

/// A pipe that nobody empties would stop the program.
pub(super) fn drained(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Exit code, processor time \[s\], memory \[MB\].
pub(super) fn waited(child: &mut Child) -> (Option<i32>, f64, f64) {
    let used = must(child.wait4(), "the program cannot be waited for");
    let seconds = (used.rusage.utime + used.rusage.stime).as_secs_f64();
    (
        used.status.code(),
        seconds,
        used.rusage.maxrss as f64 / (1024.0 * 1024.0),
    )
}

/// The limits on processor time and memory.
pub(super) fn check_limits(ended: &Ended) -> Result<(), String> {
    if ended.seconds > MOST_SECONDS {
        return Err(format!("{:.0} s of processor time", ended.seconds));
    }
    if ended.megabytes > MOST_MEGABYTES {
        return Err(format!("{:.0} MB", ended.megabytes));
    }
    Ok(())
}

/// Checks the output: the monitor may print results before an error, and notes on standard error.
fn check_output(code: Option<i32>, out: &str, err: &str, stream: bool) -> Result<(), String> {
    if err.contains("panicked") {
        return Err(err.to_string());
    }
    match code {
        Some(0) if stream || err.is_empty() => {}
        Some(2) => {
            let Some(line) = err
                .lines()
                .last()
                .filter(|line| line.starts_with("error: "))
            else {
                return Err(format!("it ends with code 2 and says {err:?}"));
            };
            message(line)?;
            if !stream && (err.lines().count() > 1 || !out.is_empty()) {
                return Err(format!("it says more than its error: {out:?} {err:?}"));
            }
        }
        _ => return Err(format!("it ends with {code:?} and says {err:?}")),
    }
    if stream {
        for line in out.lines() {
            let json: Value =
                serde_json::from_str(line).map_err(|error| format!("{error}: {line}"))?;
            numbers(&json).map_err(|key| format!("{key} is no number: {line}"))?;
        }
    } else if let Some(line) = out.lines().find(|line| not_finite(line)) {
        return Err(format!("it prints: {line}"));
    }
    for line in out.lines().chain(err.lines()) {
        if escaped(line) != line {
            return Err(format!("it prints {line:?}"));
        }
    }
    Ok(())
}

/// Whether a number of a text is none.
fn not_finite(line: &str) -> bool {
    let mut words = line.split(|c: char| !c.is_alphanumeric());
    words.any(|word| ["NaN", "inf"].contains(&word))
}

/// Checks that a message for people is short, and contains no control characters or invisible characters.
pub(super) fn message(text: &str) -> Result<(), String> {
    if escaped(text) != text {
        return Err(format!("a character that cannot be seen in {text:?}"));
    }
    match text.chars().count() {
        count if count > LONGEST_ERROR => Err(format!("a message of {count} characters: {text}")),
        _ => Ok(()),
    }
}

/// Keys of results that contain a number wherever they occur.
const NUMBERS: [&str; 16] = [
    "rmse",
    "value",
    "noise_floor",
    "bic",
    "power",
    "decides",
    "low",
    "high",
    "level",
    "innovation",
    "time",
    "score",
    "from",
    "to",
    "seconds",
    "bic_ahead",
];

/// Checks that keys for numbers contain numbers: NaN would be written as null. Returns the failing key.
fn numbers(json: &Value) -> Result<(), &'static str> {
    let mut rest = vec![json];
    while let Some(value) = rest.pop() {
        match value {
            Value::Array(items) => rest.extend(items),
            Value::Object(entries) => {
                if let Some(key) = NUMBERS
                    .iter()
                    .find(|key| entries.get(**key).is_some_and(Value::is_null))
                {
                    return Err(key);
                }
                rest.extend(entries.values());
            }
            _ => {}
        }
    }
    Ok(())
}

/// Checks the numbers of a written file, and that a written model can be read.
pub(super) fn result(name: &str, bytes: &[u8]) -> Result<(), String> {
    if name.ends_with(".json") {
        let json: Value =
            serde_json::from_slice(bytes).map_err(|error| format!("{name}: {error}"))?;
        numbers(&json).map_err(|key| format!("{name}: {key} is no number"))?;
    }
    if name.ends_with(".mo") {
        let text = String::from_utf8_lossy(bytes);
        ModelSpec::parse(&text).map_err(|error| format!("{name}:{error}"))?;
    }
    if name.ends_with(".csv") {
        let text = String::from_utf8_lossy(bytes);
        if let Some(line) = text.lines().find(|line| not_finite(line)) {
            return Err(format!("{name}: {line}"));
        }
    }
    Ok(())
}
