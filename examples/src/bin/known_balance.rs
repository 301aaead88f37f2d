//! A tank whose mass balance is known: its parameters with and without what is known of them.
//!
//! The level above its operating point follows `dh/dt = -a h + b_in u_in - b_out u_out`: two pumps, and a drain with the time
//! constant `1/a`. Both pumps push the same volume per volt, for water pumped round in a circle leaves the level
//! alone: `b_in = b_out` (an equality). The drain cannot run backwards: `a >= 0` (an inequality).
//!
//! The operator starts one pump as he stops the other, the level is read with noise, and the record is short. So the level
//! shows what the two pumps do together, and hardly what each of them does; and the slow drain is lost in the noise.
//!
//! Derivatives come from a state variable filter `1/(s + f)`, the same for all signals: with `x_f` the filtered `x`,
//! the filtered derivative is `f (x - x_f)`.

use ct_constrained::{ConstrainedRls, Row, project};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use ct_signals::noise;
use nalgebra::{SMatrix, SVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// 1/s, cm/(V s), cm/(V s): a time constant of 2000 s.
const TRUTH: [f64; 3] = [0.0005, 0.05, 0.05];
/// Sampling period, s.
const DT: f64 = 1.0;
/// Samples of one record.
const N: usize = 300;
/// Corner of the state variable filter, 1/s.
const CORNER: f64 = 0.02;
/// Standard deviation of the level's noise, cm.
const NOISE: f64 = 3.0;
/// Records.
const RUNS: u64 = 200;

/// The samples `d/dt h_f = [-h_f, u_in_f, -u_out_f]' [a, b_in, b_out]` of one record.
fn record(seed: u64) -> Vec<Sample<3>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = noise::white(N, NOISE, &mut rng);
    let trim = noise::white(N, 0.2, &mut rng);
    let (decay, filter) = ((-TRUTH[0] * DT).exp(), (-CORNER * DT).exp());
    let (mut level, mut filtered) = (0.0, [0.0; 3]);
    let mut samples = Vec::new();
    for (k, noise) in noise.iter().enumerate() {
        // one up, the other down, each with a little trim of its own
        let opposed = if (k / 60) % 2 == 0 { 1.0 } else { -1.0 };
        let held = k / 20 * 20;
        let inflow = opposed + trim[held];
        let outflow = -opposed + trim[held + 10];
        let reading = level + noise;
        let derivative = CORNER * (reading - filtered[0]);
        samples.push(Sample::new(
            [-filtered[0], filtered[1], -filtered[2]],
            derivative,
        ));
        for (state, signal) in filtered.iter_mut().zip([reading, inflow, outflow]) {
            *state = filter * *state + (1.0 - filter) * signal;
        }
        let steady = (TRUTH[1] * inflow - TRUTH[2] * outflow) / TRUTH[0];
        level = decay * level + (1.0 - decay) * steady;
    }
    samples
}

/// Knowledge given to the estimator.
#[derive(Clone, Copy)]
enum Known {
    Nothing,
    Balance,
    Penalty,
    Projection,
}

fn estimate(seed: u64, known: Known) -> Result<SVector<f64, 3>, ct_constrained::Error> {
    // nothing is forgotten: the parameters do not vary, and the record is short
    let rls = ContinuousRls::new(
        SVector::zeros(),
        SMatrix::identity() * 1e2,
        Weights::least_squares(0.0)?,
    )?;
    let balance = |weight| Row::equal([0.0, 1.0, -1.0], 0.0, weight);
    let sign = |weight| Row::at_least([1.0, 0.0, 0.0], 0.0, weight);
    let rows = match known {
        Known::Nothing => [balance(0.0)?, sign(0.0)?],
        Known::Balance => [balance(1e3)?, sign(0.0)?],
        Known::Penalty => [balance(1e3)?, sign(1e3)?],
        Known::Projection => [balance(1e3)?, sign(0.0)?],
    };
    let mut estimator = ConstrainedRls::new(rls, rows)?;
    let samples = record(seed);
    for pair in samples.windows(2) {
        estimator.update(&pair[0].midway(&pair[1]), DT);
    }
    if matches!(known, Known::Projection) {
        project(estimator.rls_mut(), &[sign(0.0)?])?;
    }
    Ok(*estimator.theta())
}

fn main() -> Result<(), ct_constrained::Error> {
    println!(
        "truth: a = {} 1/s, b_in = b_out = {} cm/(V s)",
        TRUTH[0], TRUTH[1]
    );
    println!("mean (standard deviation) of {RUNS} records of {N} samples\n");
    println!(
        "known                  | a [1/s]            | b_in               | b_out              | a < 0"
    );
    println!(
        "-----------------------|--------------------|--------------------|--------------------|------"
    );
    for (name, known) in [
        ("nothing", Known::Nothing),
        ("balance", Known::Balance),
        ("balance, a >= 0 softly", Known::Penalty),
        ("balance, a >= 0", Known::Projection),
    ] {
        let estimates = (0..RUNS)
            .map(|seed| estimate(seed, known))
            .collect::<Result<Vec<_>, _>>()?;
        let cells: Vec<String> = (0..3)
            .map(|i| {
                let mean = estimates.iter().map(|e| e[i]).sum::<f64>() / RUNS as f64;
                let variance = estimates.iter().map(|e| (e[i] - mean).powi(2)).sum::<f64>()
                    / (RUNS - 1) as f64;
                format!("{:8.5} ({:.5})", mean, variance.sqrt())
            })
            .collect();
        let negative = estimates.iter().filter(|e| e[0] < -1e-12).count();
        println!(
            "{name:22} | {:18} | {:18} | {:18} | {negative}",
            cells[0], cells[1], cells[2]
        );
    }
    println!();
    println!(
        "The balance reduces the variance of the pumps' gains. The sign constraint keeps the drain's flow from becoming negative: the penalty"
    );
    println!(
        "acts gradually and on all estimates, also on early ones that later data would have corrected, which biases a upwards; the projection"
    );
    println!("acts once, at the end.");
    Ok(())
}
