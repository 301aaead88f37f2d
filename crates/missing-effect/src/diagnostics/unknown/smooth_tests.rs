//! The smoother against a Kalman filter with the Rauch-Tung-Striebel smoother, and the coverage of its band.
#![allow(clippy::unwrap_used)]

use std::ops::RangeInclusive;

use ct_signals::{Channel, Record, noise};
use greybox::{Noise, PriorValue, Setup, Stopping, fit_from};
use nalgebra::{Matrix3, Vector3};
use plants::{Command, Known, Place, Plant, Simulator, Term, Variable};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{
    shape::{fit, shape},
    smooth::{Spot, carrier, smooth},
};
use crate::fit::node::Node;

/// Samples, so that ten lie between two instants of the path.
const N: usize = 951;
const STEP: usize = 10;
const INSTANTS: usize = 96;
const H: f64 = 2.0;
/// K, tau, offset.
const THETA: [f64; 3] = [4.0, 90.0, 2.0];
const NOISE: f64 = 0.05;
const VESSEL: Spot = Spot {
    place: Place::Vessel,
    vessel: 0,
};

/// A record of a linear tank with a forcing in its balance, in units of the level.
fn record(forcing: &[f64], rng: &mut ChaCha8Rng) -> Record {
    let instants: Vec<f64> = (0..INSTANTS).map(|i| H * (STEP * i) as f64).collect();
    let u = (0..N)
        .map(|k| if (k / 120) % 2 == 0 { 3.0 } else { 4.0 })
        .collect();
    run(carrier(VESSEL, &instants, forcing), u, rng)
}

/// A record of a linear tank with a term that has fixed ordinates.
fn run(term: Term, u: Vec<f64>, rng: &mut ChaCha8Rng) -> Record {
    let time: Vec<f64> = (0..N).map(|k| H * k as f64).collect();
    let e = noise::white(N, NOISE, rng);
    let mut record = Record {
        name: "r".to_string(),
        outputs: vec![Channel::new("y", "cm", vec![0.0; N])],
        inputs: vec![Channel::new("u", "V", u.clone())],
        time,
        ..Record::default()
    };
    // A structure needs some output; the simulation does not depend on its values.
    record.outputs[0].values = (0..N).map(|k| 10.0 + (k % 7) as f64).collect();
    let records = [record.clone()];
    let setup = setup(&records);
    let structure = setup.structure.with_term(term.clone()).unwrap();
    let theta: Vec<f64> = THETA.iter().chain(&term.ordinates).copied().collect();
    let mut simulator = Simulator::<f64>::new(&structure, &theta, &[14.0], u[0]).unwrap();
    for k in 0..N {
        record.outputs[0].values[k] = simulator.read(0) + e[k];
        simulator.advance(Command::held(u[k]), H);
    }
    record
}

fn setup(records: &[Record]) -> Setup<'_> {
    let plant = Plant::SingleTankLinear;
    Setup::from_records(plant, Known::default(), &[], records, Default::default()).unwrap()
}

/// A forcing at the instants.
type Forcing = fn(&mut ChaCha8Rng) -> Vec<f64>;

/// The plant at its true parameters.
fn node(records: &[Record]) -> Node<'_> {
    let setup = setup(records);
    let x: Vec<f64> = THETA.iter().copied().chain([14.0]).collect();
    let stop = Stopping {
        evaluations: 1,
        cost: 1.0,
    };
    let mut fit = fit_from(&setup, std::slice::from_ref(&x), &Noise::white(1), stop).unwrap();
    fit.x = x;
    Node {
        setup,
        fit,
        added: Vec::new(),
    }
}

/// A random walk of intensity `q` in instants that lie `dt` apart.
fn walk(q: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let steps = noise::white(INSTANTS, (q * H * STEP as f64).sqrt(), rng);
    let mut w = 0.0;
    steps
        .into_iter()
        .map(|step| {
            w += step;
            w
        })
        .collect()
}

/// The states `[level, w_i, w_(i+1)]` filtered forwards and smoothed backwards: mean and variance of the path.
fn kalman(residual: &[f64], q: f64, variance: f64, diffuse: f64) -> Vec<(f64, f64)> {
    let tau = THETA[1];
    let decay = (-H / tau).exp();
    let dt = H * STEP as f64;
    let step = |k: usize| {
        let share = (k % STEP) as f64 / STEP as f64;
        // A forcing a + b s: the level takes a (1 - E) + b (h - tau (1 - E)).
        let (a, b) = (1.0 - decay, (H - tau * (1.0 - decay)) / dt);
        let mut f = Matrix3::new(
            decay,
            a * (1.0 - share) - b,
            a * share + b, //
            0.0,
            1.0,
            0.0, //
            0.0,
            0.0,
            1.0,
        );
        let mut noise = Matrix3::zeros();
        if (k + 1).is_multiple_of(STEP) {
            f[(1, 1)] = 0.0;
            f[(1, 2)] = 1.0;
            noise[(2, 2)] = q * dt;
        }
        (f, noise)
    };
    let mut mean = Vector3::zeros();
    let mut p = Matrix3::new(
        diffuse,
        0.0,
        0.0, //
        0.0,
        diffuse,
        diffuse, //
        0.0,
        diffuse,
        diffuse + q * dt,
    );
    let mut filtered = Vec::new();
    let mut predicted = Vec::new();
    for (k, r) in residual.iter().enumerate() {
        predicted.push((mean, p));
        let gain = p.column(0) / (p[(0, 0)] + variance);
        mean += gain * (r - mean[0]);
        // Joseph's form, since the first covariance is huge.
        let mut shrink = Matrix3::identity();
        shrink.set_column(0, &(shrink.column(0) - gain));
        p = shrink * p * shrink.transpose() + gain * gain.transpose() * variance;
        filtered.push((mean, p));
        let (f, noise) = step(k);
        mean = f * mean;
        p = f * p * f.transpose() + noise;
    }
    let (mut mean, mut p) = filtered[residual.len() - 1];
    let mut path = vec![(mean[1], p[(1, 1)])];
    for k in (0..residual.len() - 1).rev() {
        let (own, own_p) = filtered[k];
        let (next, next_p) = predicted[k + 1];
        let gain = own_p * step(k).0.transpose() * next_p.try_inverse().unwrap();
        mean = own + gain * (mean - next);
        p = own_p + gain * (p - next_p) * gain.transpose();
        if k % STEP == 0 {
            path.push((mean[1], p[(1, 1)]));
        }
    }
    path.reverse();
    path
}

#[test]
fn it_is_the_kalman_smoother() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let w = walk(0.002, &mut rng);
    let records = [record(&w, &mut rng)];
    let node = node(&records);
    let smoothed = smooth(&node, VESSEL).unwrap().unwrap();
    let residual = node.setup.residuals(&node.fit.x).unwrap().remove(0);
    let q = smoothed.variance / smoothed.lambda;
    // A larger first covariance would be lost by rounding in the filter, a smaller one would affect the result.
    let reference = kalman(&residual, q, smoothed.variance, 1e3);
    let path = &smoothed.paths[0];
    assert_eq!(reference.len(), path.value.len());
    let size = path.value.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut worst = (0.0_f64, 0.0_f64);
    for (i, (mean, variance)) in reference.iter().enumerate() {
        worst.0 = worst.0.max((mean - path.value[i]).abs() / size);
        worst.1 = worst
            .1
            .max((variance / path.covariance[(i, i)] - 1.0).abs());
    }
    println!("mean to {:.1e}, variance to {:.1e}", worst.0, worst.1);
    assert!(worst.0 < 1e-5 && worst.1 < 1e-4, "{worst:?}");
    // The noise and the intensity are those that were simulated.
    assert!((smoothed.variance.sqrt() / NOISE - 1.0).abs() < 0.1);
    assert!((0.5..2.0).contains(&(q / 0.002)), "{q}");
}

#[test]
fn the_band_holds_the_truth_as_often_as_it_says() {
    use rayon::prelude::*;
    // A forcing that is a random walk, and two that are not: for a smoother forcing the band is too wide; for a step it is too narrow only
    // at the step.
    let forcings: [(&str, RangeInclusive<f64>, Forcing); 3] = [
        ("random walk", 0.92..=0.98, |rng| walk(0.002, rng)),
        ("swing", 0.92..=1.0, |_| {
            (0..INSTANTS).map(|i| (0.15 * i as f64).sin()).collect()
        }),
        ("step", 0.92..=1.0, |_| {
            (0..INSTANTS).map(|i| f64::from(u8::from(i > 40))).collect()
        }),
    ];
    for (name, room, forcing) in forcings {
        let (inside, all) = (0..24_u64)
            .into_par_iter()
            .map(|seed| {
                let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
                let w = forcing(&mut rng);
                let records = [record(&w, &mut rng)];
                let smoothed = smooth(&node(&records), VESSEL).unwrap().unwrap();
                let path = &smoothed.paths[0];
                let inside = w
                    .iter()
                    .enumerate()
                    .filter(|&(i, w)| {
                        (w - path.value[i]).abs() < 1.96 * path.covariance[(i, i)].sqrt()
                    })
                    .count();
                (inside, w.len())
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let share = inside as f64 / all as f64;
        println!("{name}: {:.1} % of {all}", 100.0 * share);
        assert!(room.contains(&share), "{name}: {share}");
    }
}

#[test]
fn where_nothing_is_missing_nothing_moves() {
    let mut still = 0;
    for seed in 0..12 {
        let mut rng = ChaCha8Rng::seed_from_u64(500 + seed);
        let records = [record(&[0.0; INSTANTS], &mut rng)];
        let smoothed = smooth(&node(&records), VESSEL).unwrap().unwrap();
        still += usize::from(smoothed.gain < super::MOVES);
    }
    assert_eq!(still, 12);
}

#[test]
fn the_band_of_a_shape_holds_the_truth_as_often_as_it_says() {
    use rayon::prelude::*;
    let levels: Vec<f64> = (0..120).map(|i| 0.25 * f64::from(i)).collect();
    let wave = |h: f64| 0.6 * (0.7 * h).sin();
    let values: Vec<f64> = levels.iter().map(|h| wave(*h)).collect();
    let (inside, all, named) = (0..24_u64)
        .into_par_iter()
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(900 + seed);
            let u = ct_signals::excitation::steps(N, 20..=60, 1.5, 4.5, &mut rng).unwrap();
            let term = Term {
                variable: Variable::Level,
                ..carrier(VESSEL, &levels, &values)
            };
            let records = [run(term, u, &mut rng)];
            let node = node(&records);
            let smoothed = smooth(&node, VESSEL).unwrap().unwrap();
            let path = &smoothed.paths[0].residual;
            let shape = shape(&node, &smoothed, Variable::Level, path)
                .unwrap()
                .unwrap();
            // The true function too without the part that the plant's own parameters explain.
            let truth = nalgebra::DVector::from_iterator(
                shape.knots.len(),
                shape.knots.iter().map(|h| wave(*h)),
            );
            let truth = &shape.covariance * (&shape.information * truth);
            let inside = (0..truth.len())
                .filter(|&i| {
                    (truth[i] - shape.ordinates[i]).abs() < 1.96 * shape.covariance[(i, i)].sqrt()
                })
                .count();
            (inside, truth.len(), usize::from(shape.share > 0.9))
        })
        .reduce(|| (0, 0, 0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
    let share = inside as f64 / all as f64;
    println!(
        "shape: {:.1} % of {all}, named {named} of 24",
        100.0 * share
    );
    assert!(share > 0.9, "{share}");
    assert!(named >= 22, "{named}");
}

/// A side measurement is included in the fit of a polyline too: an ordinate of an unknown term in the balance has the same effect as the
/// offset, and only the side measurement distinguishes them.
#[test]
fn a_side_measurement_holds_its_parameter_in_the_fit_of_a_shape() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let records = [record(&[0.0; INSTANTS], &mut rng)];
    let node = node(&records);
    let own = node.setup.parameter_count();
    let term = Term {
        name: "unknown".to_string(),
        place: VESSEL.place,
        vessel: VESSEL.vessel,
        variable: Variable::Level,
        knots: vec![10.0, 14.0, 18.0],
        ordinates: vec![0.0; 3],
        fitted: plants::Fitted::Ordinates,
    };
    let offset = node.setup.names()[..own]
        .iter()
        .position(|name| name == "offset")
        .unwrap();
    let fitted = |prior: Option<PriorValue>| {
        let priors = prior.map(|prior| ("offset".to_string(), prior));
        let setup = node
            .setup
            .clone()
            .with_priors(&priors.into_iter().collect());
        let setup = setup.unwrap();
        let structure = setup.structure.with_term(term.clone()).unwrap();
        let setup = setup.with_structure(structure).unwrap();
        let mut start = node.fit.x.clone();
        start.splice(own..own, [0.0; 3]);
        let fit = fit(&setup, start, own..own + 3, 1.0, &node.fit.weights).unwrap();
        fit.x[offset]
    };
    let read = PriorValue {
        value: THETA[2] + 0.5,
        std_error: 0.01,
    };
    let (without, with) = (fitted(None), fitted(Some(read)));
    assert!((without - THETA[2]).abs() < 0.3, "{without}");
    assert!((with - read.value).abs() < 0.02, "{with}");
}
