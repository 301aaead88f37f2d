//! Intervals of 95 % of a user's own model contain the true value in 95 % of records: two outputs in coloured noise, 30 % of the readings
//! missing. `cargo run --release -p ctid-tests --example model_coverage` takes 400 records of two models.
#![allow(clippy::unwrap_used)]

use ctid_examples::model_records::driven_models;
use ctid_tests::coverage::{count, of_record};
use rayon::prelude::*;

#[test]
fn intervals_hold_the_truth() {
    let driven = driven_models().unwrap();
    let motor = driven.iter().find(|d| d.name == "dc-motor").unwrap();
    let records: Vec<_> = (0..60)
        .into_par_iter()
        .map(|seed| of_record(motor, seed))
        .collect();
    let all = count(&records);
    assert_eq!(all.len(), 8);
    let held: usize = all.iter().map(|coverage| coverage.held).sum();
    let of: usize = all.iter().map(|coverage| coverage.of).sum();
    // An initial speed may be at a bound of its own, and have no interval.
    assert!(of > 8 * records.len() * 19 / 20, "{all:?}");
    // Sixty records, and the numbers of one record hang together.
    let share = held as f64 / of as f64;
    assert!((0.90..=0.99).contains(&share), "{share}: {all:?}");
    for coverage in &all {
        assert!(coverage.held * 100 >= coverage.of * 85, "{coverage:?}");
    }
}
