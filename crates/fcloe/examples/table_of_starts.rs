//! 121 starts, gain and time constant each from a fifth to five times the true one: where does condition (14) hold, and
//! from where does the recursion converge?
//!
//! `cargo run --release -p fcloe --example table_of_starts`
#![allow(clippy::unwrap_used)]

use ct_lti::Hold;
use ct_signals::excitation;
use fcloe::{
    Controller, Filter, Noise, PlantModel, RecursiveSettings, TableOfStarts, Verdict,
    continuous_loop, factors_to_five, noise_at_snr,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const TOLERANCE: f64 = 0.05;

/// r and y at 20 dB.
fn record(
    plant: &PlantModel,
    controller: &Controller,
    bit: usize,
    n: usize,
) -> (Vec<f64>, Vec<f64>) {
    let r = excitation::prbs(n, bit, -1.0, 1.0, 7).unwrap();
    let simulate = |noise| continuous_loop(plant, controller, 1.0, &r, Hold::Zero, noise).unwrap();
    let clean = simulate(Noise::None).y;
    let w = noise_at_snr(&clean, 20.0, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
    let y = simulate(Noise::InLoop(&w)).y;
    (r, y)
}

fn main() {
    let plant = PlantModel::first_order(6.0, 110.0).unwrap();
    let factors = factors_to_five(11);
    println!("starts that end within {TOLERANCE} of the true parameters, of those where Re(P^/P)");
    println!(
        "{:<22} {:<9} {:>7} {:>12} {:>12} {:>12}",
        "controller", "filter", "samples", "> 1/2", "> 0", "<= 0"
    );
    for (kp, ki, bit) in [(0.2292, 0.0021, 10), (0.5515, 0.074, 10), (0.02, 0.01, 20)] {
        let controller = Controller::pi(kp, ki).unwrap();
        for (filter, n) in [(Filter::Fixed, 1270 * bit), (Filter::Adaptive, 254 * bit)] {
            let (r, y) = record(&plant, &controller, bit, n);
            let settings = RecursiveSettings::new(100.0, -0.98_f64.ln(), 1000.0, 0.2);
            let table = TableOfStarts::run(
                &plant,
                &controller,
                (1.0, &r, &y),
                (&factors, &factors),
                settings.with_filter(filter),
            )
            .unwrap();
            let cell = |verdict| {
                let (good, all) = table.converged(verdict, TOLERANCE);
                format!("{good:>4} of {all:>3}")
            };
            println!(
                "{:<22} {:<9} {n:>7} {:>12} {:>12} {:>12}",
                format!("{kp} + {ki}/p"),
                format!("{filter:?}"),
                cell(Verdict::Holds),
                cell(Verdict::Positive),
                cell(Verdict::Negative)
            );
        }
    }
}
