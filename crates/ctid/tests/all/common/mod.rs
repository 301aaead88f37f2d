//! The program as a process: a folder to run it in, its output, and its changes of files.

#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use plants::{EffectInfo, Known, Placed, Plant, Scales, Simulator, Structure, Term};
use serde_json::Value;
use tempfile::TempDir;

/// Far longer than any run of these tests.
const MOST_TIME: Duration = Duration::from_secs(150);

/// The bundled records and their model file.
pub const BUNDLED: [&str; 3] = ["tour.csv", "tour-test.csv", "tour.toml"];

/// A bundled file.
pub fn bundled(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/records");
    fs::read_to_string(folder.join(name)).unwrap()
}

/// A folder to run the program in.
pub struct Place {
    folder: TempDir,
}

/// End of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Exit code; `None` where the program was killed.
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Place {
    /// An empty folder.
    pub fn empty() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
        }
    }

    /// A folder with the bundled records and their model file.
    pub fn new() -> Self {
        let place = Self::empty();
        for name in BUNDLED {
            place.write(name, bundled(name));
        }
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// The program, to be run in this folder, its output caught.
    pub fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ctid"));
        command
            .args(words.split_whitespace())
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Two cores are shared by many runs: one thread each, unless a test is about threads.
            .env("RAYON_NUM_THREADS", "1");
        // Nor may a result depend on the load of the computer.
        let searches = ["compare ", "diagnose ", "design "]
            .iter()
            .any(|command| words.starts_with(command));
        if searches && !words.contains("--effort") {
            command.args(["--effort", "thorough"]);
        }
        command
    }

    /// Runs the program in this folder.
    pub fn ctid(&self, words: &str) -> Outcome {
        outcome(self.command(words))
    }

    /// Runs the program, which has to end successfully; returns its output.
    pub fn succeeds(&self, words: &str) -> String {
        let outcome = self.ctid(words);
        assert_eq!(outcome.code, Some(0), "ctid {words}: {}", outcome.err);
        assert_eq!(outcome.err, "", "ctid {words}");
        outcome.out
    }

    /// Runs `diagnose` or `compare`; returns the JSON.
    pub fn result(&self, words: &str) -> Value {
        self.succeeds(&format!("{words} --json result.json"));
        let json = self.json("result.json");
        fs::remove_file(self.path("result.json")).unwrap();
        json
    }

    /// Every file and folder below this one, with its bytes.
    pub fn snapshot(&self) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.folder.path().to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let bytes = if path.is_dir() {
                    folders.push(path.clone());
                    None
                } else {
                    Some(fs::read(&path).unwrap())
                };
                found.insert(path, bytes);
            }
        }
        found
    }

    /// Runs the program, which has to refuse: exit code 2, one line on standard error that says all
    /// of this, nothing on standard output, and every file as it was. Returns the line.
    pub fn refuses(&self, words: &str, says: &[&str]) -> String {
        let before = self.snapshot();
        let outcome = self.ctid(words);
        assert_eq!(outcome.code, Some(2), "ctid {words}: {outcome:?}");
        assert_eq!(outcome.out, "", "ctid {words}");
        let line = outcome
            .err
            .strip_suffix('\n')
            .unwrap_or_else(|| panic!("ctid {words}: no end of line: {}", outcome.err));
        assert!(
            line.starts_with("error: ") && !line.contains(['\n', '\r']),
            "ctid {words}: not one line that begins with `error: `: {line}"
        );
        for word in says {
            assert!(
                line.contains(word),
                "ctid {words}: {line}\n does not say {word}"
            );
        }
        let after = self.snapshot();
        let names = |files: &BTreeMap<PathBuf, Option<Vec<u8>>>| -> Vec<PathBuf> {
            files.keys().cloned().collect()
        };
        assert_eq!(names(&before), names(&after), "ctid {words}");
        for (path, bytes) in &before {
            assert!(
                after[path] == *bytes,
                "ctid {words}: {} was changed",
                path.display()
            );
        }
        line.to_string()
    }
}

/// Runs a command to its end.
pub fn outcome(mut command: Command) -> Outcome {
    let mut child = command.spawn().unwrap();
    let out = child.stdout.take().map(drain);
    let err = child.stderr.take().map(drain);
    let code = wait(&mut child);
    let text = |reader: Option<thread::JoinHandle<Vec<u8>>>| {
        String::from_utf8(reader.map_or(Vec::new(), |reader| reader.join().unwrap())).unwrap()
    };
    Outcome {
        code,
        out: text(out),
        err: text(err),
    }
}

/// A pipe that is not read would block the program.
fn drain(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).unwrap();
        bytes
    })
}

/// The exit code; a program that does not end is a failure after a time limit.
fn wait(child: &mut Child) -> Option<i32> {
    let began = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if began.elapsed() > MOST_TIME {
            child.kill().unwrap();
            panic!("the program did not end within {MOST_TIME:?}");
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// A result without the entries that differ from run to run.
pub fn lasting(mut result: Value) -> Value {
    let seconds = result.as_object_mut().unwrap().remove("seconds");
    assert!(seconds.is_some_and(|seconds| seconds.is_number()));
    result
}

/// Pseudo-random numbers (SplitMix64): the same on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// Uniform from 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normally distributed, to the accuracy of twelve uniform numbers.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    pub fn pick<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }
}

/// Tanks to record from: 154 cm^2 each, the command steps between 3.5 and 6.5 V every 60 to 180 s.
pub struct Tanks {
    pub plant: Plant,
    /// The plant's own parameters.
    pub theta: Vec<f64>,
    /// Level of each vessel at the beginning \[cm\].
    pub levels: Vec<f64>,
    /// Hidden effects of the plant: effect, vessel, parameters; in the order of the chain.
    pub hidden: Vec<(&'static str, usize, Vec<f64>)>,
    /// Terms of the plant that no effect describes.
    pub terms: Vec<Term>,
    pub rows: usize,
    /// Standard deviation of the sensor's noise \[cm\].
    pub noise: f64,
    pub seed: u64,
}

/// Sampling interval \[s\].
pub const INTERVAL: f64 = 2.0;

impl Tanks {
    pub fn single() -> Self {
        Self {
            plant: Plant::SingleTank,
            theta: vec![10.0, 12.5],
            levels: vec![16.0],
            hidden: Vec::new(),
            terms: Vec::new(),
            rows: 700,
            noise: 0.05,
            seed: 1,
        }
    }

    pub fn cascaded() -> Self {
        Self {
            plant: Plant::CascadedTanks,
            theta: vec![10.0, 11.2, 12.5],
            levels: vec![20.0, 16.0],
            ..Self::single()
        }
    }

    /// Commands and readings, one each for every sample.
    pub fn run(&self) -> (Vec<f64>, Vec<f64>) {
        let known = Known {
            area: [
                Some(154.0),
                (self.plant.vessels() > 1).then_some(154.0),
                None,
            ],
            ..Known::default()
        };
        let duration = INTERVAL * self.rows as f64;
        let scales = Scales::from_ranges((3.5, 6.5), (5.0, 30.0), INTERVAL, duration);
        let mut structure = Structure::new(self.plant, known, scales);
        let mut theta = self.theta.clone();
        for (id, vessel, parameters) in &self.hidden {
            let (effect, vessel) = (EffectInfo::find(id).unwrap(), *vessel);
            structure = structure.with(Placed { effect, vessel }).unwrap();
            theta.extend(parameters);
        }
        for term in &self.terms {
            structure = structure.with_term(term.clone()).unwrap();
            theta.push(1.0);
        }
        // At rest until the first step.
        let (mut u, mut until) = (5.0, 30);
        let mut simulator = Simulator::new(&structure, &theta, &self.levels, u).unwrap();
        simulator.set_substeps(4);
        let mut random = Random(self.seed);
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for k in 0..self.rows {
            if k == until {
                u = ((3.5 + 3.0 * random.uniform()) * 100.0).round() / 100.0;
                until += 30 + random.below(60);
            }
            inputs.push(u);
            outputs.push(simulator.read(0) + self.noise * random.normal());
            simulator.advance(plants::Command::held(u), INTERVAL);
        }
        (inputs, outputs)
    }

    /// The record as CSV.
    pub fn csv(&self) -> String {
        let (inputs, outputs) = self.run();
        csv(&inputs, &outputs)
    }

    /// The model file of the plant without the hidden effects.
    pub fn model(&self) -> String {
        let known = match self.plant.vessels() {
            1 => "area = 154.0\n",
            _ => "area_upper = 154.0\narea_lower = 154.0\n",
        };
        let plant = self.plant.id();
        format!("plant = \"{plant}\"\neffects = []\n\n[known]\n{known}")
    }
}

/// A record as CSV.
pub fn csv(inputs: &[f64], outputs: &[f64]) -> String {
    let mut text = String::from("t [s],u [V],y [cm]\n");
    for (k, (u, y)) in inputs.iter().zip(outputs).enumerate() {
        writeln!(text, "{},{u:.4},{y:.4}", k as f64 * INTERVAL).unwrap();
    }
    text
}
