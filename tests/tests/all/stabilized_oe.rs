//! The stabilized output error on tanks: where the model is right it agrees with a batch fit, and where it is not its estimates drift
//! with the level.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use ct_constrained::Bounds;
use ct_rls::{ContinuousRls, ExactHold, RecursiveEstimator, Weights};
use ct_signals::{Columns, ReadOptions, Record, noise, read_csv};
use ctid_tests::{Drive, Rig};
use greybox::{Fit, FitOptions, Setup, fit};
use nalgebra::{SMatrix, SVector};
use plants::{Known, Plant};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{BlockDiagonal, IoSample, StabilizedOe, StateVariableFilters};

/// `a_1, a_2, b_0, d` of two lags in series with an offset.
type Theta = SVector<f64, 4>;

/// How far the past is taken in.
#[derive(Clone, Copy)]
enum Memory {
    /// s
    Fixed(f64),
    /// A third of the record so far.
    Growing,
}

/// The estimates after every sample, started from two lags of `time` s and the ranges of the signals, with bounds on `c^` that are
/// positive real for all plants within 30 % of that.
fn run(record: &Record, time: f64, memory: Memory) -> Vec<Theta> {
    let (u, y) = (record.inputs[0].range(), record.outputs[0].range());
    let gain = (y.1 - y.0) / (u.1 - u.0);
    let start = Theta::from([2.0 * time, time * time, gain, y.0 - gain * u.0]);
    let size = Theta::from([time, time * time, gain, y.1 - y.0]);
    let remember = Weights::least_squares(0.0).unwrap();
    let p1 = SMatrix::from_diagonal(&size.component_mul(&size));
    let theta = ContinuousRls::<4, ExactHold>::with_integrator(start, p1, remember).unwrap();
    let c = SVector::from([2.0 * time, time * time]);
    let p2 = SMatrix::from_diagonal(&(c * 1e-2).component_mul(&(c * 1e-2)));
    let filter = ContinuousRls::<2, ExactHold>::with_integrator(c, p2, remember).unwrap();
    let around = |low: f64, high: f64| Bounds::new((c * low).into(), (c * high).into()).unwrap();
    let mut estimator = StabilizedOe::new(
        BlockDiagonal::new(theta, filter),
        StateVariableFilters::new(1.0 / time).unwrap(),
    )
    .unwrap()
    .with_offset()
    .with_filter_bounds(around(0.9, 1.2))
    .unwrap()
    .with_model_state([record.outputs[0].values[0], 0.0])
    .unwrap();
    let checked = estimator.check_filter_bounds(&around(0.7, 1.3)).unwrap();
    assert!(checked.hold(), "{checked}");

    let mut thetas = Vec::new();
    for (k, times) in record.time.windows(2).enumerate() {
        let eta = match memory {
            Memory::Fixed(memory) => 1.0 / memory,
            Memory::Growing => 3.0 / (times[0] - record.time[0] + 300.0),
        };
        let weights = Weights::least_squares(eta).unwrap();
        estimator.gain_mut().blocks_mut().0.set_weights(weights);
        let sample = IoSample {
            u: record.inputs[0].values[k],
            y: record.outputs[0].values[k],
        };
        assert!(
            estimator
                .update(&sample, times[1] - times[0])
                .outcome
                .used()
        );
        thetas.push(*estimator.theta());
    }
    estimator.health().unwrap();
    thetas
}

/// Batch fit of two lags to all samples, with its residual assumed white.
fn batch(record: &Record, known: &Known) -> (Fit, Vec<Vec<f64>>, [usize; 4]) {
    let records = std::slice::from_ref(record);
    let plant = Plant::CascadedTanksLinear;
    let setup =
        Setup::from_records(plant, known.clone(), &[], records, Default::default()).unwrap();
    let options = FitOptions {
        noise_order: 0,
        ..FitOptions::default()
    };
    let found = fit(&setup, &options).unwrap();
    let at = |name: &str| setup.names().iter().position(|n| n == name).unwrap();
    let output = setup.simulate(&found.x).unwrap().output;
    (found, output, ["tau1", "tau2", "K", "offset"].map(at))
}

/// The same as `a_1, a_2, b_0, d`, with standard errors.
fn as_theta(found: &Fit, [t1, t2, k, d]: [usize; 4]) -> (Theta, Theta) {
    let (places, correlations) = found.correlations().unwrap();
    let errors = found.std_errors();
    let covariance = |i: usize, j: usize| {
        let place = |x: usize| places.iter().position(|&p| p == x).unwrap();
        correlations[place(i)][place(j)] * errors[i].unwrap() * errors[j].unwrap()
    };
    let x = &found.x;
    let sum = covariance(t1, t1) + covariance(t2, t2) + 2.0 * covariance(t1, t2);
    let product = x[t2].powi(2) * covariance(t1, t1)
        + x[t1].powi(2) * covariance(t2, t2)
        + 2.0 * x[t1] * x[t2] * covariance(t1, t2);
    (
        Theta::from([x[t1] + x[t2], x[t1] * x[t2], x[k], x[d]]),
        Theta::from([sum, product, covariance(k, k), covariance(d, d)]).map(f64::sqrt),
    )
}

fn linear_rig() -> Rig {
    Rig {
        plant: Plant::CascadedTanksLinear,
        theta: vec![6.4, 60.0, 40.0, -16.0],
        levels: vec![16.0, 16.0],
        drive: Drive::Open,
        samples: 4000,
        noise: 0.3,
        ..Rig::single_tank()
    }
}

/// With weights that favour the late samples the recursive estimates have, by the spread of such weights, 1.3 times the standard errors
/// of the batch fit, if nothing else is lost.
#[test]
fn where_the_model_is_right_it_agrees_with_a_batch_fit() {
    let rig = linear_rig();
    let (mut squares, mut sum, seeds) = (Theta::zeros(), Theta::zeros(), 12);
    for seed in 0..seeds {
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
        let (found, _, places) = batch(&record, &rig.known());
        let (fitted, errors) = as_theta(&found, places);
        let thetas = run(&record, 45.0, Memory::Growing);
        let away = (thetas.last().unwrap() - fitted).component_div(&errors);
        println!("in standard errors: {:.2?}", away.as_slice());
        assert!(away.amax() < 4.0, "{away}");
        squares += away.component_mul(&away);
        sum += away;
    }
    let n = seeds as f64;
    let root_mean_square = (squares / n).map(f64::sqrt);
    assert!(root_mean_square.max() < 1.8, "{root_mean_square}");
    // no bias: the mean is within three of its own standard errors
    let bias = (sum / n).component_div(&(root_mean_square / n.sqrt()));
    assert!(bias.amax() < 3.0, "{bias}");
}

/// An outflow by the square root has a gain and time constants that grow as the root of the level does; lags in series do not.
#[test]
fn where_it_is_not_the_estimates_drift_with_the_level() {
    let at = |rig: &Rig, command: (f64, f64), time: f64| {
        let middle = 0.5 * (command.0 + command.1);
        // where the level stands in the middle
        let level = match rig.plant {
            Plant::CascadedTanksLinear => 6.4 * middle - 16.0,
            _ => (rig.theta[0] * middle / rig.theta[2]).powi(2),
        };
        let rig = Rig {
            command,
            levels: vec![level; 2],
            ..rig.clone()
        };
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(5));
        let thetas = run(&record, time, Memory::Growing);
        let theta = *thetas.last().unwrap();
        (level, theta)
    };
    let root = Rig {
        samples: 4000,
        theta: vec![10.0, 11.2, 12.5],
        ..Rig::cascaded_tanks()
    };
    let (low, high) = ((3.6, 4.4), (6.1, 6.9));
    let ((low_level, low_root), (high_level, high_root)) =
        (at(&root, low, 75.0), at(&root, high, 110.0));
    let ratio = high_root.component_div(&low_root);
    let ((_, low_linear), (_, high_linear)) =
        (at(&linear_rig(), low, 45.0), at(&linear_rig(), high, 45.0));
    let linear = high_linear.component_div(&low_linear);
    println!(
        "root {:.3?}, linear {:.3?}",
        ratio.as_slice(),
        linear.as_slice()
    );
    // a_1, a_2, b_0: time constants and gain go with the root of the level
    let expected = (high_level / low_level).sqrt();
    for (found, expected) in ratio.iter().zip([expected, expected * expected, expected]) {
        assert!((found / expected - 1.0).abs() < 0.05, "{ratio}");
    }
    for found in &linear.as_slice()[..3] {
        assert!((found - 1.0).abs() < 0.02, "{linear}");
    }
}

/// The measured Cascaded Tanks.
fn measured() -> Record {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/data/cascaded_tanks/estimation.csv");
    let reading = read_csv(&file, &Columns::default(), &ReadOptions::default());
    reading.unwrap().record
}

/// Standard deviation of the gain's estimate over the record, relative to its mean, once the start is forgotten.
fn drift(record: &Record, time: f64, memory: f64) -> f64 {
    let thetas = run(record, time, Memory::Fixed(memory));
    let settled = (3.0 * memory / (record.time[1] - record.time[0])) as usize;
    let gains: Vec<f64> = thetas[settled..].iter().map(|theta| theta[2]).collect();
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    (gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / n).sqrt() / mean
}

/// Measured tanks with an overflow and outflows by the square root, beside two lags that were fitted to them, under the same input and the
/// sensor's noise: the gain of the first drifts, that of the second stays.
#[test]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn on_measured_tanks_the_estimates_drift() {
    let record = measured();
    let (found, output, places) = batch(&record, &Known::default());
    let (fitted, _) = as_theta(&found, places);
    let time = fitted[1].sqrt();
    for (memory, times) in [(400.0, 4.0), (600.0, 6.0)] {
        let real = drift(&record, time, memory);
        let mut lags = record.clone();
        for seed in 0..3 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let noise = noise::white(output[0].len(), 0.03, &mut rng);
            lags.outputs[0].values = output[0].iter().zip(noise).map(|(y, e)| y + e).collect();
            let same = drift(&lags, time, memory);
            println!("memory {memory} s: measured {real:.3}, lags {same:.3}");
            assert!(real > times * same, "{real} {same}");
        }
    }
}
