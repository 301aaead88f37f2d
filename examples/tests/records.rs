//! The records that are in the repository are the ones that the simulator makes, byte for byte.

use std::fs;
use std::path::Path;

#[test]
fn the_bundled_records_can_be_made_again() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("records");
    let made = ctid_examples::tour_records::make().unwrap();
    for (name, made) in ["tour.csv", "tour-test.csv"].iter().zip(made) {
        let bundled = fs::read_to_string(folder.join(name)).unwrap();
        let differs = bundled.lines().zip(made.lines()).position(|(a, b)| a != b);
        assert!(
            bundled == made,
            "{name} differs from what the simulator makes, first in line {:?}: `cargo run -p ctid-examples --bin make_records`",
            differs.map(|line| line + 1)
        );
    }
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
