//! Coverage of 95 % intervals, with noise in the loop and output noise. 4000 runs of each, or the given number; a share of 400 is uncertain
//! by 0.011, one of 4000 by 0.003.
//!
//! `cargo run --release -p fcloe --example coverage [-- RUNS]`
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../tests/all/support/rig.rs"]
mod rig;

use rig::Rig;

fn main() {
    let asked = std::env::args().nth(1).map(|runs| runs.parse());
    let runs = asked.unwrap_or(Ok(4000)).expect("a number of runs");
    println!(
        "share of {runs} runs whose 95 % interval contains the true value, for each of a1.., b0.."
    );
    for in_loop in [true, false] {
        println!(
            "noise {}",
            if in_loop {
                "in the loop"
            } else {
                "on the record"
            }
        );
        let show = |rig| show(&rig, runs);
        show(Rig::first_order(in_loop));
        show(Rig::second_order(in_loop));
        show(Rig::second_order(in_loop).with_unknown_levels());
        show(Rig::second_order(in_loop).with_missing_readings());
        show(Rig::filtered_pid(in_loop));
        show(Rig::direct_term(in_loop));
    }
    println!("noise on the record");
    show(&Rig::open_loop(), runs);
}

fn show(rig: &Rig, runs: u64) {
    let found = rig.coverage(runs);
    let share = |hits: &[usize]| -> String {
        let share = hits
            .iter()
            .map(|h| format!("{:6.3}", *h as f64 / runs as f64));
        share.collect::<Vec<_>>().join(" ")
    };
    let missing = match rig.missing {
        true => ", 30 % of the readings and a block of 10 rows missing",
        false => "",
    };
    println!("  {}{missing}", rig.name);
    println!("    with the residual's noise model {}", share(&found.hits));
    println!("    as if it were white        {}", share(&found.white));
    println!(
        "    noise placed rightly in    {:6.3}",
        found.placed as f64 / runs as f64
    );
    println!(
        "    claimed over found variance {:6.2?}",
        found.variance_ratios
    );
}
