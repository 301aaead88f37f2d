//! The recursive estimator from far starts, from regressions, and along a drift.
//!
//! `cargo run --release -p fcloe --example recursive`
#![allow(clippy::unwrap_used)]

#[path = "../tests/support/online.rs"]
mod online;

use fcloe::Filter;
use online::From;

fn main() {
    println!("n = 1, 2540 samples at 20 dB: ends within 3 %, of 60 starts within a factor");
    for factor in [1.3, 2.0, 5.0] {
        let ends = |filter| online::first_order_from_afar(factor, filter);
        println!(
            "  {factor:<4} adaptive {:>2}   fixed {:>2}",
            ends(Filter::Adaptive),
            ends(Filter::Fixed)
        );
    }
    println!(
        "n = 2, m = 1, 10 160 samples at 30 dB: ends within 10 % in all parameters, of 40, and the mean error"
    );
    for from in [
        From::LeastSquares,
        From::Instruments,
        From::Pipeline,
        From::Factor(1.3),
        From::Factor(2.0),
    ] {
        for filter in [Filter::Adaptive, Filter::Fixed] {
            let ends = online::second_order_runs(from, filter);
            println!(
                "  {:<13} {:<9} {:>2} (starts {:>2})   {:5.1} % (starts {:5.1} %)",
                format!("{from:?}"),
                format!("{filter:?}"),
                ends.good,
                ends.good_starts,
                100.0 * ends.off,
                100.0 * ends.starts_off
            );
        }
    }
    println!(
        "tau growing by 30 % over 12 700 samples at 20 dB: largest error after three memories, of 20 records"
    );
    for memory in [300.0, 500.0, 800.0, 1000.0] {
        let most = (0..20)
            .map(|seed| online::drift(12_700, memory, seed))
            .fold(0.0, f64::max);
        println!("  memory {memory:>4} s   {:.1} %", 100.0 * most);
    }
}
