//! The records that are in the repository are the ones that the simulator makes, byte for byte.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use ctid_examples::model_records;

fn assert_same(path: &Path, made: &str) {
    let bundled = fs::read_to_string(path).unwrap();
    let differs = bundled.lines().zip(made.lines()).position(|(a, b)| a != b);
    assert!(
        bundled == made,
        "{} differs from what the simulator makes, first in line {:?}: `cargo run -p ctid-examples --bin make_records`",
        path.display(),
        differs.map(|line| line + 1)
    );
}

#[test]
fn the_bundled_records_can_be_made_again() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("records");
    let made = ctid_examples::tour_records::make().unwrap();
    for (name, made) in ["tour.csv", "tour-test.csv"].iter().zip(made) {
        assert_same(&folder.join(name), &made);
    }
}

#[test]
fn the_records_of_the_models_can_be_made_again() {
    let made = model_records::make().unwrap();
    for record in &made {
        let path = model_records::folder().join(record.name);
        assert_same(&path.with_extension("csv"), &record.csv);
    }
    // Every model of the folder has one.
    let texts = fs::read_dir(model_records::folder()).unwrap();
    let is_text = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "mo");
    let mut names: Vec<String> = texts
        .map(|entry| entry.unwrap().path())
        .filter(is_text)
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut of: Vec<&str> = made.iter().map(|record| record.name).collect();
    of.sort_unstable();
    assert_eq!(names, of);
}

/// The tour's point: the rim is met often enough to be seen, and not all the time.
#[test]
fn the_rim_is_met_now_and_then() {
    let made = ctid_examples::tour_records::make().unwrap();
    for record in made {
        let levels: Vec<f64> = record
            .lines()
            .skip(1)
            .map(|row| row.rsplit(',').next().unwrap().parse().unwrap())
            .collect();
        let at_rim = levels.iter().filter(|level| **level > 19.8).count();
        let share = at_rim as f64 / levels.len() as f64;
        assert!((0.10..0.25).contains(&share), "{share}");
        assert!(levels.iter().all(|level| (3.0..22.0).contains(level)));
    }
}
