//! Intervals of 95 % hold the truth in 95 % of simulated runs, whether the noise circulates in the loop or not, which
//! the fit is not told. The whole of it, 4000 runs each, is the example
//! `coverage`.

#[path = "support/rig.rs"]
mod rig;

use rig::{Coverage, Rig};

const RUNS: u64 = 400;

/// Outside of these, on either side, in one of 200 draws of 400 with p = 0.95.
fn plausible(hits: usize) -> bool {
    (368..=391).contains(&hits)
}

/// The variance of 400 estimates is uncertain by 7 %.
fn honest(variance_ratio: f64) -> bool {
    (variance_ratio - 1.0).abs() < 0.2
}

fn check(rig: &Rig) -> Coverage {
    let found = rig.coverage(RUNS);
    println!("{}: {found:.2?}", rig.name);
    let Coverage { hits, placed, .. } = &found;
    assert!(hits.iter().all(|hits| plausible(*hits)), "{found:?}");
    assert!(
        found.variance_ratios.iter().all(|ratio| honest(*ratio)),
        "{found:?}"
    );
    // Where levels are estimated, less is known of the low frequencies that tell the two paths apart.
    assert!(
        *placed >= if rig.unknown_levels { 300 } else { 360 },
        "{placed}"
    );
    found
}

#[test]
fn noise_in_the_loop() {
    check(&Rig::first_order(true));
    check(&Rig::second_order(true));
    check(&Rig::direct_term(true));
    // Here a white residual's intervals are too narrow.
    let white = check(&Rig::filtered_pid(true)).white;
    assert!(white.iter().any(|hits| *hits < 368), "{white:?}");
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
