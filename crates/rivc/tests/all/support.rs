//! Simulated experiments.

use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rivc::{Data, Input};

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// `B/A` of an input that is delayed, at times, from rest before the first: fine pieces in between, so that nothing of the crate is used.
pub fn respond(b: &[f64], a: &[f64], time: &[f64], u: &Input, delay: f64) -> Vec<f64> {
    let system = TransferFunction::from_coefficients(b, a).unwrap();
    let mut simulator = Simulator::new(StateSpace::controllable(&system).unwrap(), Hold::First);
    let value = |t: f64, after: bool| {
        let small = if after { 1e-9 } else { -1e-9 };
        let i = time.partition_point(|s| *s <= t + small);
        let Some(i) = i.checked_sub(1) else {
            return u.values[0];
        };
        match (u.hold, time.get(i + 1)) {
            (Hold::First, Some(next)) => {
                let share = ((t - time[i]) / (next - time[i])).clamp(0.0, 1.0);
                u.values[i] + share * (u.values[i + 1] - u.values[i])
            }
            _ => u.values[i],
        }
    };
    let mut instants: Vec<f64> = time
        .iter()
        .flat_map(|t| [*t, t + delay])
        .filter(|t| *t <= time[time.len() - 1] + 1e-9)
        .collect();
    instants.sort_by(f64::total_cmp);
    instants.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let mut y = Vec::new();
    let mut k = 0;
    // The input has steps at instants: a short interval before each approximates a step.
    let mut output = simulator
        .update(value(instants[0] - delay, true), 0.0)
        .unwrap();
    for (i, &t) in instants.iter().enumerate() {
        if i > 0 {
            let before = value(t - delay, false);
            output = simulator.update(before, t - instants[i - 1]).unwrap();
            let after = value(t - delay, true);
            if after != before {
                output = simulator.update(after, 1e-11).unwrap();
            }
        }
        if k < time.len() && (t - time[k]).abs() < 1e-9 {
            y.push(output);
            k += 1;
        }
    }
    y
}

pub fn held(values: Vec<f64>) -> Input {
    Input {
        values,
        hold: Hold::Zero,
    }
}

pub fn data(time: Vec<f64>, inputs: Vec<Input>, output: Vec<f64>) -> Data {
    Data {
        name: "simulated".into(),
        time,
        inputs,
        output,
        reference: None,
        continues: false,
    }
}

pub fn even(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|k| k as f64 * step).collect()
}

pub fn add(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
