//! Do 95 % intervals hold the truth in 95 % of the runs, with noise in the loop and on the record? 400 runs of each.
//!
//! `cargo run --release -p fcloe --example coverage`
#![allow(clippy::unwrap_used)]

#[path = "../tests/support/rig.rs"]
mod rig;

use rig::Rig;

const RUNS: u64 = 400;

fn main() {
    println!("share of {RUNS} runs whose 95 % interval holds the truth, for each of a1.., b0..");
    for in_loop in [true, false] {
        println!(
            "noise {}",
            if in_loop {
                "in the loop"
            } else {
                "on the record"
            }
        );
        show(&Rig::first_order(in_loop));
        show(&Rig::second_order(in_loop));
        show(&Rig::second_order(in_loop).with_unknown_levels());
        show(&Rig::filtered_pid(in_loop));
    }
    println!("noise on the record");
    show(&Rig::open_loop());
}

fn show(rig: &Rig) {
    let (hits, white, placed) = rig.coverage(RUNS);
    let share = |hits: &[usize]| -> String {
        let share = hits
            .iter()
            .map(|h| format!("{:6.3}", *h as f64 / RUNS as f64));
        share.collect::<Vec<_>>().join(" ")
    };
    println!("  {}", rig.name);
    println!("    with the residual's colour {}", share(&hits));
    println!("    as if it were white        {}", share(&white));
    println!(
        "    noise placed rightly in    {:6.3}",
        placed as f64 / RUNS as f64
    );
}
