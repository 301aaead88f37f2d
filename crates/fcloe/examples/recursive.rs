//! The recursive estimator from far starts, from regressions, and along a drift.
//!
//! `cargo run --release -p fcloe --example recursive`; `-- 5` takes 5 starts and records of each kind.
#![allow(clippy::unwrap_used)]

#[path = "../tests/all/support/online.rs"]
mod online;

use fcloe::Filter;
use online::{From, SecondOrder};
use rayon::prelude::*;

fn main() {
    let asked = std::env::args().nth(1).map(|runs| runs.parse::<u64>());
    let asked = asked.map(|runs| runs.unwrap().max(1));
    let (near, far, drifts) = (
        asked.unwrap_or(60),
        asked.unwrap_or(40),
        asked.unwrap_or(200),
    );
    println!("n = 1, 2540 samples at 20 dB: ends within 3 %, of {near} starts within a factor");
    for factor in [1.3, 2.0, 5.0] {
        let ends = |filter| online::first_order_from_afar(factor, filter, 0..near);
        println!(
            "  {factor:<4} adaptive {:>2}   fixed {:>2}",
            ends(Filter::Adaptive),
            ends(Filter::Fixed)
        );
    }
    println!(
        "n = 2, m = 1, 10 160 samples: ends within 10 % in all parameters, of {far}, and the mean error"
    );
    for (snr, beginning) in [(30.0, 2540), (20.0, 1270), (10.0, 1270)] {
        println!("  at {snr} dB, regressions on the first {beginning} samples");
        for from in [
            From::LeastSquares,
            From::Instruments,
            From::Pipeline,
            From::Factor(1.3),
            From::Factor(2.0),
        ] {
            for filter in [Filter::Adaptive, Filter::Fixed] {
                let ends = SecondOrder { snr, beginning }.runs(from, filter, 0..far);
                println!(
                    "    {:<13} {:<9} {:>2} (starts {:>2})   {:5.1} % (starts {:5.1} %)",
                    format!("{from:?}"),
                    format!("{filter:?}"),
                    ends.good,
                    ends.good_starts,
                    100.0 * ends.off,
                    100.0 * ends.starts_off
                );
            }
        }
    }
    println!(
        "tau growing by 30 % at 20 dB: largest error at any sample after three memories, over {drifts} records"
    );
    for (samples, memory) in [
        (12_700, 500.0),
        (12_700, 800.0),
        (12_700, 1600.0),
        (25_400, 800.0),
        (25_400, 1200.0),
    ] {
        let mut most: Vec<f64> = (0..drifts)
            .into_par_iter()
            .map(|seed| online::drift(samples, memory, seed))
            .collect();
        most.sort_by(f64::total_cmp);
        println!(
            "  over {samples} samples, memory {memory:>4} s: median {:.1} %, largest {:.1} %, within 5 % {:>3} of {drifts}",
            100.0 * most[most.len() / 2],
            100.0 * most[most.len() - 1],
            most.iter().filter(|most| **most < 0.05).count()
        );
    }
}
