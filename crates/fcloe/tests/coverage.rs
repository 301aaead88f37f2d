//! Intervals of 95 % hold the truth in 95 % of simulated runs, whether the noise circulates in the loop or not, which
//! the fit is not told. The whole of it, 400 runs each, is the example `coverage`.
#![allow(clippy::unwrap_used)]

#[path = "support/rig.rs"]
mod rig;

use rig::Rig;

const RUNS: u64 = 100;

/// Outside of these in one of 2000 draws of 100 with p = 0.95.
fn plausible(hits: usize) -> bool {
    (87..=100).contains(&hits)
}

fn check(rig: &Rig) -> (Vec<usize>, Vec<usize>) {
    let (hits, white, placed) = rig.coverage(RUNS);
    println!(
        "{}: {hits:?}, as if white {white:?}, placed {placed}",
        rig.name
    );
    assert!(hits.iter().all(|hits| plausible(*hits)), "{hits:?}");
    // Where levels are estimated, less is known of the low frequencies that tell the two paths apart.
    assert!(
        placed >= if rig.unknown_levels { 75 } else { 90 },
        "{placed}"
    );
    (hits, white)
}

#[test]
fn noise_in_the_loop() {
    check(&Rig::first_order(true));
    check(&Rig::second_order(true));
    check(&Rig::direct_term(true));
    // Here a white residual's intervals are too narrow.
    let (_, white) = check(&Rig::filtered_pid(true));
    assert!(white.iter().any(|hits| !plausible(*hits)), "{white:?}");
}

#[test]
fn noise_on_the_record() {
    check(&Rig::first_order(false));
    check(&Rig::second_order(false));
    check(&Rig::direct_term(false));
    check(&Rig::filtered_pid(false));
}

/// The levels are estimated too; without a controller, under coloured noise.
#[test]
fn estimated_levels_and_open_loop() {
    check(&Rig::second_order(false).with_unknown_levels());
    check(&Rig::second_order(true).with_unknown_levels());
    check(&Rig::open_loop());
}
