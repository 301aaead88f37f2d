//! How often intervals of 95 % contain the true value, on models of `examples/models` with two outputs in coloured noise, 30 % of the
//! readings missing:
//!
//! ```sh
//! cargo run --release -p ctid-tests --example model_coverage [-- --records 400 --models dc-motor,coupled-heaters]
//! ```
#![allow(clippy::unwrap_used)]

use clap::Parser;
use ctid_examples::model_records::driven_models;
use ctid_tests::coverage::{count, of_record};
use rayon::prelude::*;

/// Coverage of the intervals of `ctid compare`.
#[derive(Debug, Parser)]
struct Arguments {
    /// Number of records of each model.
    #[arg(long, default_value_t = 400)]
    records: u64,
    /// Models.
    #[arg(long, value_delimiter = ',', default_values = ["dc-motor", "coupled-heaters"])]
    models: Vec<String>,
}

fn main() {
    let arguments = Arguments::parse();
    for driven in driven_models().unwrap() {
        if !arguments.models.iter().any(|model| model == driven.name) {
            continue;
        }
        let records: Vec<_> = (0..arguments.records)
            .into_par_iter()
            .map(|seed| of_record(&driven, seed))
            .collect();
        let (mut held, mut of) = (0, 0);
        for coverage in count(&records) {
            println!(
                "{} {}: {:.1} % of {}",
                driven.name,
                coverage.name,
                100.0 * coverage.held as f64 / coverage.of as f64,
                coverage.of
            );
            held += coverage.held;
            of += coverage.of;
        }
        println!(
            "{}: {:.2} % of all",
            driven.name,
            100.0 * f64::from(u32::try_from(held).unwrap()) / of as f64
        );
    }
}
