//! Good files, damaged at random: the program ends with a result or with one line of refusal, never
//! with a panic, and its result holds numbers.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::common::{Place, Random, Tanks, bundled};

/// What may stand in a cell of a logger's file, or be typed there.
const CELLS: &[&str] = &[
    "",
    " ",
    "0",
    "-0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "1e400",
    "99999999999999999999",
    "nan",
    "Infinity",
    "#N/A",
    "TRUE",
    "1.2.3",
    "1,5",
    "0x1F",
    "\"",
    "\"\"",
    ";",
    "\t",
    "\u{661}",
    "12:30",
    "5.",
    ".5",
    "+5",
    "1_000",
];

/// What may be typed into a model file.
const WORDS: &[&str] = &[
    "",
    "[",
    "]",
    "[[",
    "{",
    "=",
    "\"",
    "'''",
    "#",
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "1e-308",
    "99999999999999999999",
    "true",
    "1979-05-27",
    "\"upper\"",
    "[\"overflow\"]",
    "[\"pump_lag\", \"transport_delay\"]",
    "\"cascaded-tanks\"",
    "\"single-tank-linear\"",
    "\"first-order\"",
    "hold = \"first\"",
    "[known]",
    "[effect.overflow]",
    "[effect]\noverflow = 1",
    "[effect.transport_delay]\nwhere = \"lower\"",
    "[start]\nalpha = 1e300",
    "[start]\npump_gain = 1e-300",
    "[controller]\ntype = \"PI\"\ngain = 1e300\nintegral_time = 1e-300",
    "[controller]\ntype = \"PI\"\ngain = 0.5\nintegral_time = 100",
    "tank_height = 1e-9",
    "input_range = 1e-9",
    "input_range = 1e300",
    "reference = \"y [cm]\"",
    "plant.x = 1",
];

/// One to three things done to a file.
fn damaged(text: &str, words: &[&str], separator: char, random: &mut Random) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(3) {
        bytes = match random.below(4) {
            0 => damaged_bytes(bytes, random),
            1 => damaged_lines(&bytes, random),
            _ => damaged_words(&bytes, words, separator, random),
        };
    }
    bytes
}

fn damaged_bytes(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let at = random.below(bytes.len());
    match random.below(5) {
        0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
        1 if at < bytes.len() => {
            bytes.remove(at);
        }
        2 => bytes.insert(at, random.next() as u8),
        3 => bytes.insert(at, b"\0\r\n\"',;#[]="[random.below(11)]),
        _ => bytes.truncate(at),
    }
    bytes
}

fn damaged_lines(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = bytes.split(|&b| b == b'\n').collect();
    let (a, b) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(4) {
        0 => {
            lines.remove(a);
        }
        1 => lines.insert(b, lines[a]),
        2 => lines.swap(a, b),
        _ => {
            // A block is lost.
            lines.drain(a.min(b)..a.max(b));
        }
    }
    lines.join(&b'\n')
}

/// Words between separators: cells of a record, sides of an equation.
fn damaged_words(bytes: &[u8], words: &[&str], separator: char, random: &mut Random) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines: Vec<String> = text.split('\n').map(str::to_string).collect();
    let at = random.below(lines.len());
    let word = random.pick(words);
    if random.below(4) == 0 {
        lines.insert(at, word.to_string());
    } else if random.below(4) == 0 {
        // One cell of every line.
        let column = random.below(3);
        for line in &mut lines {
            *line = replaced(line, separator, column, word);
        }
    } else {
        let column = random.below(3);
        lines[at] = replaced(&lines[at], separator, column, word);
    }
    lines.join("\n").into_bytes()
}

fn replaced(line: &str, separator: char, column: usize, word: &str) -> String {
    let mut cells: Vec<&str> = line.split(separator).collect();
    if let Some(cell) = cells.get_mut(column) {
        *cell = word;
    }
    cells.join(&separator.to_string())
}

/// The program ends as it should; whether it gave a result.
fn ends_well(place: &Place, words: &str, what: &dyn Fn() -> String) -> bool {
    let outcome = place.ctid(words);
    assert!(
        !outcome.err.contains("panicked"),
        "{}: {}",
        what(),
        outcome.err
    );
    match outcome.code {
        Some(0) => {
            assert_eq!(outcome.err, "", "{}", what());
            true
        }
        Some(2) => {
            assert_eq!(outcome.err.lines().count(), 1, "{}: {outcome:?}", what());
            assert!(
                outcome.err.starts_with("error: ") && outcome.err.len() < 1000,
                "{}: {outcome:?}",
                what()
            );
            assert_eq!(outcome.out, "", "{}", what());
            false
        }
        _ => panic!("{}: {outcome:?}", what()),
    }
}

/// Runs cases `0..cases` on all cores; the number for which `case` says yes.
fn count(cases: u64, case: impl Fn(u64) -> bool + Sync) -> usize {
    let (next, yes) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let workers = thread::available_parallelism().map_or(2, usize::from);
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed) as u64;
                    if number >= cases {
                        break;
                    }
                    if case(number) {
                        yes.fetch_add(1, Ordering::Relaxed);
                    }
                }
            });
        }
    });
    yes.into_inner()
}

fn tanks() -> Tanks {
    Tanks {
        rows: 250,
        ..Tanks::single()
    }
}

/// Both commands on the files of a place; the error of a result is a number.
fn both_end_well(place: &Place, number: u64, what: &dyn Fn() -> String) -> bool {
    let command = if number.is_multiple_of(4) {
        "diagnose"
    } else {
        "compare"
    };
    let words = format!("{command} data.csv --model model.toml --json out.json --report out.html");
    if !ends_well(place, &words, what) {
        assert_eq!(place.snapshot().len(), 2, "{}", what());
        return false;
    }
    let json = place.json("out.json");
    for step in json["steps"].as_array().unwrap() {
        assert!(step["rmse"].is_f64(), "{}: {step}", what());
        for parameter in step["parameters"].as_array().unwrap() {
            assert!(parameter["value"].is_f64(), "{}: {parameter}", what());
        }
    }
    assert!(json["noise_floor"].is_f64(), "{}", what());
    true
}

#[test]
fn a_damaged_record_is_read_or_refused() {
    const CASES: u64 = 200;
    let (record, model) = (tanks().csv(), tanks().model());
    let read = count(CASES, |number| {
        let mut random = Random(1_000 + number);
        let bytes = damaged(&record, CELLS, ',', &mut random);
        let place = Place::empty();
        place.write("data.csv", &bytes);
        place.write("model.toml", &model);
        let what = || format!("case {number}\n{}", String::from_utf8_lossy(&bytes));
        both_end_well(&place, number, &what)
    });
    // Else the damage would be too little or too much to say anything.
    assert!((10..190).contains(&read), "{read} of {CASES} were read");
}

#[test]
fn a_damaged_model_file_is_read_or_refused() {
    const CASES: u64 = 200;
    let record = tanks().csv();
    let text = bundled("tour.toml").replace("effects = []", "effects = [\"pump_lag\"]")
        + "\n[start]\nalpha = 12.0\n\n[effect.pump_lag]\ntime_constant = 5.0\n";
    let read = count(CASES, |number| {
        let mut random = Random(2_000 + number);
        let bytes = damaged(&text, WORDS, '=', &mut random);
        let place = Place::empty();
        place.write("data.csv", &record);
        place.write("model.toml", &bytes);
        let what = || format!("case {number}\n{}", String::from_utf8_lossy(&bytes));
        both_end_well(&place, number, &what)
    });
    assert!((10..190).contains(&read), "{read} of {CASES} were read");
}

#[test]
fn a_damaged_model_file_is_edited_or_left_alone() {
    const CASES: u64 = 200;
    let text = bundled("tour.toml").replace("effects = []", "effects = [\n  \"overflow\", # so\n]")
        + "\n[effect.transport_delay]\n";
    let edited = count(CASES, |number| {
        let mut random = Random(3_000 + number);
        let bytes = damaged(&text, WORDS, '=', &mut random);
        let place = Place::empty();
        place.write("model.toml", &bytes);
        let what = || format!("case {number}\n{}", String::from_utf8_lossy(&bytes));
        let read = |place: &Place| std::fs::read(place.path("model.toml")).unwrap();
        if !ends_well(&place, "add transport_delay --model model.toml", &what) {
            assert_eq!(read(&place), bytes, "{}", what());
            return false;
        }
        assert_ne!(read(&place), bytes, "{}", what());
        // What was written can be read, and taken back.
        assert!(
            ends_well(&place, "remove transport_delay --model model.toml", &what),
            "{}",
            what()
        );
        true
    });
    assert!(
        (10..190).contains(&edited),
        "{edited} of {CASES} were edited"
    );
}
