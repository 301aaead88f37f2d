//! Invalid inputs are rejected in one line with the numbers and the correction.

use ct_signals::excitation;
use rivc::{Data, Delay, Noise, Plant, Settings, Structure, estimate};

use crate::support::{data, even, held, respond};

fn record(n: usize) -> Data {
    let u = held(excitation::prbs(n, 10, -1.0, 1.0, 9).unwrap());
    let time = even(n, 1.0);
    let y = respond(&[2.0], &[1.0, 8.0], &time, &u, 0.0);
    data(time, vec![u], y)
}

fn refusal(records: &[Data], structure: &Structure, noise: Noise) -> String {
    let message = match estimate(records, structure, &Settings::new(noise)) {
        Ok(found) => panic!("not refused: {found:?}"),
        Err(error) => error.to_string(),
    };
    assert!(!message.contains('\n'), "{message}");
    message
}

fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn structures() {
    let records = [record(400)];
    let of = |structure: &Structure| refusal(&records, structure, Noise::White);
    says(&of(&Structure::new(0, [0])), &["n = 0", "n >= 1"]);
    says(&of(&Structure::new(1, [2])), &["degree 2", "at most 1"]);
    says(&of(&Structure::new(9, [0])), &["9", "at most 8"]);
    says(&of(&Structure::new(1, [])), &["no input"]);
    says(
        &of(&Structure::new(1, [0, 0])),
        &["inputs", "1 entries", "2 are needed"],
    );
    let late = |delay| Structure::new(1, [0]).with_delay(0, delay);
    says(&of(&late(Delay::Known(-1.0))), &["-1", "at least 0"]);
    says(&of(&late(Delay::Estimated { most: f64::NAN })), &["NaN"]);
    says(&of(&late(Delay::Known(500.0))), &["500", "leaves 0 of 400"]);
    says(
        &of(&late(Delay::Estimated { most: 395.0 })),
        &["395", "leaves 5 of 400"],
    );
    let direct = Structure::new(1, [1]).with_delay(0, Delay::Estimated { most: 5.0 });
    says(&of(&direct), &["m = n = 1", "at most 0"]);
}

#[test]
fn records() {
    let first = Structure::new(1, [0]);
    let of = |record: Data| refusal(&[record], &first, Noise::White);
    says(&refusal(&[], &first, Noise::White), &["no record"]);
    says(&of(record(10)), &["10 samples", "12 are needed"]);
    let mut bad = record(400);
    bad.output[7] = f64::INFINITY;
    says(&of(bad), &["the output is inf at sample 7"]);
    let mut bad = record(400);
    bad.output.fill(f64::NAN);
    says(&of(bad), &["the output has no measured samples"]);
    let mut bad = record(400);
    bad.output[3..].fill(f64::NAN);
    says(&of(bad), &["3 samples besides 397", "reading is missing"]);
    let mut bad = record(400);
    bad.time[7] = 6.0;
    says(&of(bad), &["from 6 to 6 at sample 7"]);
    let mut bad = record(400);
    bad.output.pop();
    says(&of(bad), &["the output has 399 entries", "400"]);
    let mut bad = record(400);
    bad.inputs[0].values.fill(3.0);
    says(&of(bad), &["input 1 is constant at 3"]);
    let mut bad = record(400);
    bad.output.fill(3.0);
    says(&of(bad), &["the output is constant at 3"]);
}

/// In samples are counted the model of the noise and that of the loop; SRIVC in open loop counts none.
#[test]
fn uneven_times() {
    let first = Structure::new(1, [0]);
    let mut uneven = record(400);
    uneven.time[5] += 0.3;
    says(
        &refusal(&[uneven.clone()], &first, Noise::Autoregressive),
        &["model of the noise", "sample 5"],
    );
    uneven.reference = Some(uneven.inputs[0].values.clone());
    says(
        &refusal(&[uneven], &first, Noise::White),
        &["model of the loop"],
    );
}

/// Rounded times are even enough for methods that count samples.
#[test]
fn rounded_times_are_even_enough() {
    let mut rounded = record(400);
    for (k, t) in rounded.time.iter_mut().enumerate() {
        *t += 0.02 * (k as f64).sin();
    }
    let first = Structure::new(1, [0]);
    let found = estimate(&[rounded], &first, &Settings::new(Noise::Autoregressive)).unwrap();
    assert!((found.plant.a[1] - 8.0).abs() < 0.2, "{found:?}");
}

/// Empty records, short ones and plants without coefficients.
#[test]
fn nothing_is_no_panic() {
    let first = Structure::new(1, [0]);
    let empty = data(vec![], vec![held(vec![])], vec![]);
    let one = data(vec![0.0], vec![held(vec![1.0])], vec![1.0]);
    for bad in [&empty, &one] {
        let message = refusal(&[record(400), bad.clone()], &first, Noise::White);
        says(&message, &["too few"]);
        assert!(Plant::new(vec![1.0, 8.0], vec![2.0]).fitted(bad).is_err());
    }
    let mut plant = Plant::new(vec![1.0, 8.0], vec![2.0]);
    plant.delays[0] = 1e300;
    assert!(plant.fitted(&record(400)).is_ok());
    plant.b[0].clear();
    says(
        &plant.fitted(&record(400)).unwrap_err().to_string(),
        &["no coefficient"],
    );
}

#[test]
fn loops() {
    let first = Structure::new(1, [0]);
    let mut in_loop = record(400);
    in_loop.reference = Some(in_loop.inputs[0].values.clone());
    let message = refusal(&[in_loop.clone(), record(400)], &first, Noise::White);
    says(&message, &["no reference", "or none"]);
    in_loop.reference = Some(vec![1.0; 400]);
    says(
        &refusal(&[in_loop], &first, Noise::White),
        &["the reference is constant at 1"],
    );
}

/// The input moves too little for the order: one step in a first-order plant carries no third order.
#[test]
fn orders_that_a_record_cannot_carry() {
    let time = even(400, 1.0);
    let u = held(
        time.iter()
            .map(|t| f64::from(u8::from(*t >= 0.0)))
            .collect(),
    );
    let mut u = u;
    u.values[0] = 0.0;
    let y = respond(&[2.0], &[1.0, 8.0], &time, &u, 0.0);
    let message = refusal(
        &[data(time, vec![u], y)],
        &Structure::new(4, [3]),
        Noise::White,
    );
    says(&message, &["lower the orders"]);
}
