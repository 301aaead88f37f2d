//! A plant in a loop with a slow disturbance: fitted from its own input, and as a whole loop from the reference.
//!
//! The controller responds to the disturbance, so the input is correlated with it. A fit that takes the input as given is therefore biased,
//! and its intervals contain the true value too seldom. The reference is independent of the disturbance. (A white disturbance does no harm:
//! the input depends on past values of the disturbance only, and these are independent of the present one.)
//!
//! `cargo run --release -p ctid-examples --bin noisy_loop`

use ct_lti::Hold;
use ct_signals::{excitation, noise};
use fcloe::{
    Controller, Error, LoopRecord, Noise, Offsets, PlantModel, Problem, Settings, continuous_loop,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const GAIN: f64 = 6.0;
/// Seconds.
const TAU: f64 = 110.0;
const RUNS: u64 = 100;

/// Estimates of the time constant and the gain over all runs, and how often their 95 % intervals contain the true value.
#[derive(Default)]
struct Score {
    sums: [f64; 2],
    hits: [u64; 2],
}

impl Score {
    fn add(&mut self, record: LoopRecord, controller: &Controller) -> Result<(), Error> {
        let start = PlantModel::first_order(4.0, 80.0)?;
        let problem = Problem::new(&[record], controller, start.orders())?;
        let fit = problem.fit(&start, &Settings::default())?;
        let half_widths = problem.uncertainty(&fit, None)?.half_widths(0.95)?;
        for (i, truth) in [TAU, GAIN].into_iter().enumerate() {
            let found = fit.plant.theta()[i];
            self.sums[i] += found;
            self.hits[i] += u64::from((found - truth).abs() <= half_widths[i]);
        }
        Ok(())
    }

    fn show(&self, name: &str) {
        let [tau, gain] = self.sums.map(|sum| sum / RUNS as f64);
        let [of_tau, of_gain] = self.hits;
        println!("{name:26} {gain:8.3} {of_gain:8} {tau:12.2} {of_tau:8}");
    }
}

fn main() -> Result<(), Error> {
    let plant = PlantModel::first_order(GAIN, TAU)?;
    let controller = Controller::pi(0.2292, 0.0021)?;
    let r = excitation::prbs(3000, 300, -1.0, 1.0, 6)?;
    let (mut alone, mut whole) = (Score::default(), Score::default());
    for seed in 0..RUNS {
        // Its correlation lasts about 20 samples.
        let w = noise::ar1(r.len(), 0.4, 0.95, &mut ChaCha8Rng::seed_from_u64(seed));
        let disturbed = Noise::InLoop(&w);
        let data = continuous_loop(&plant, &controller, 1.0, &r, Hold::Zero, disturbed)?;
        let (u, y) = (data.u, data.y);
        let from_u = LoopRecord::open_loop(1.0, u.clone(), y.clone(), Offsets::Deviations);
        alone.add(from_u, &Controller::none())?;
        let from_r = LoopRecord::closed_loop(1.0, r.clone(), Some(u), y, Offsets::Deviations);
        whole.add(from_r, &controller)?;
    }
    println!(
        "mean estimates over {RUNS} records, and how many 95 % intervals contain the true value\n"
    );
    println!(
        "{:26} {:>8} {:>8} {:>12} {:>8}",
        "", "K", "hold", "tau [s]", "hold"
    );
    println!("{:26} {GAIN:8.3} {:8} {TAU:12.2}", "truth", "");
    alone.show("the plant from its input");
    whole.show("the loop from r");
    Ok(())
}
