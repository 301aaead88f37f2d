//! Intervals contain the true value as often as they say. `RECORDS=400` runs more records than a test needs.

use crate::support::{add, data, even, held, respond, rng};
use ct_signals::{ArModel, excitation, noise};
use fcloe::{Controller, PlantModel, sampled_loop};
use rand::{Rng, RngExt};
use rayon::prelude::*;
use rivc::{Data, Delay, Kind, Noise, Settings, Structure, estimate};

/// Records of each setting.
fn records() -> u64 {
    std::env::var("RECORDS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(50)
}

fn coloured(n: usize, rms: f64, ar: &[f64], rng: &mut impl Rng) -> Vec<f64> {
    let model = ArModel::from_coefficients(ar, 1.0).unwrap();
    let sigma = rms / model.stationary_std();
    let e = noise::white(n + 500, sigma, rng);
    let mut v: Vec<f64> = Vec::new();
    for (k, e) in e.iter().enumerate() {
        let past = ar.iter().enumerate().filter(|(i, _)| *i < k);
        v.push(e + past.map(|(i, a)| a * v[k - 1 - i]).sum::<f64>());
    }
    v.split_off(500)
}

fn spread(y: &[f64]) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    (y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt()
}

/// Estimates of many records against the truth: share within 1.96 standard errors, mean error over its own error, ratio of the standard
/// errors to the spread.
fn check(
    name: &str,
    structure: &Structure,
    noise: Noise,
    truth: &[(Kind, f64)],
    record: impl Fn(u64) -> Vec<Data> + Sync,
) {
    let settings = Settings::new(noise);
    let found: Vec<_> = (0..records())
        .into_par_iter()
        .map(|seed| estimate(&record(seed), structure, &settings).unwrap())
        .collect();
    let n = found.len() as f64;
    // Four standard deviations of a share of 95 % each way, and one record.
    let band = 4.0 * (0.95_f64 * 0.05 / n).sqrt() + 1.0 / n;
    for (kind, truth) in truth {
        let errors: Vec<(f64, f64)> = found
            .iter()
            .map(|found| {
                let parameter = found.parameter(*kind).unwrap();
                (parameter.value - truth, parameter.std_error.unwrap())
            })
            .collect();
        let covered = errors.iter().filter(|(e, s)| e.abs() <= 1.96 * s).count() as f64 / n;
        let bias = errors.iter().map(|e| e.0).sum::<f64>() / n;
        let spread = (errors.iter().map(|e| (e.0 - bias).powi(2)).sum::<f64>() / n).sqrt();
        let told = (errors.iter().map(|e| e.1 * e.1).sum::<f64>() / n).sqrt();
        let worst = errors
            .iter()
            .map(|(e, s)| (e / s).abs())
            .fold(0.0, f64::max);
        let converged = found.iter().filter(|found| found.converged).count();
        println!(
            "{name} {} {kind:?}: {:.1} % covered, bias {:.2} of its error, errors {:.3} of the spread, worst {worst:.2}, spread {:.2} %, {converged} converged",
            found[0].method,
            100.0 * covered,
            bias / (spread / n.sqrt()),
            told / spread,
            100.0 * spread / truth,
        );
        assert!((covered - 0.95).abs() <= band, "{name} {kind:?}: {covered}");
        // The share contains no information about errors that are too large; half the records' standard deviation is off by 1/sqrt(2 n).
        let band = 4.0 / (2.0 * n).sqrt();
        assert!(
            (told / spread - 1.0).abs() <= band,
            "{name} {kind:?}: {told} {spread}"
        );
        assert_eq!(converged, found.len());
    }
}

const A: fn(usize) -> Kind = |power| Kind::A { power };
const B: fn(usize) -> Kind = |power| Kind::B { input: 0, power };

/// 20 dB, white and coloured, n = 2.
#[test]
fn open_loop() {
    let (a, b) = ([1.0, 12.0, 30.0], [2.0, 3.0]);
    let truth = [(A(1), 12.0), (A(2), 30.0), (B(0), 2.0), (B(1), 3.0)];
    let time = even(1000, 1.0);
    let u = held(excitation::prbs(1000, 10, -1.0, 1.0, 9).unwrap());
    let clean = respond(&b, &a, &time, &u, 0.0);
    let rms = 0.1 * spread(&clean);
    for (name, ar) in [
        ("white", &[][..]),
        ("AR(2)", &[1.3, -0.5]),
        ("AR(1)", &[0.9]),
    ] {
        let record = |seed| {
            let v = coloured(clean.len(), rms, ar, &mut rng(seed));
            vec![data(time.clone(), vec![u.clone()], add(&clean, &v))]
        };
        for noise in [Noise::White, Noise::Autoregressive] {
            check(name, &Structure::new(2, [1]), noise, &truth, record);
        }
    }
}

/// Delays of 3.4 samples, and of 3, where the criterion has a kink; 20 dB.
#[test]
fn delay() {
    for (late, colours) in [
        (3.4, &[("white", &[][..]), ("AR(1)", &[0.9])][..]),
        (3.0, &[("white, 3", &[][..])]),
    ] {
        delayed_by(late, colours);
    }
}

fn delayed_by(late: f64, colours: &[(&str, &[f64])]) {
    let (a, b) = ([1.0, 8.0], [2.0]);
    let truth = [(A(1), 8.0), (B(0), 2.0), (Kind::Delay { input: 0 }, late)];
    let time = even(1000, 1.0);
    let u = held(excitation::prbs(1000, 20, -1.0, 1.0, 9).unwrap());
    let clean = respond(&b, &a, &time, &u, late);
    let rms = 0.1 * spread(&clean);
    let structure = Structure::new(1, [0]).with_delay(0, Delay::Estimated { most: 20.0 });
    for (name, ar) in colours {
        let record = |seed| {
            let v = coloured(clean.len(), rms, ar, &mut rng(seed));
            vec![data(time.clone(), vec![u.clone()], add(&clean, &v))]
        };
        check(name, &structure, Noise::Autoregressive, &truth, record);
    }
}

/// An integrating tank and a plant of the second order in a loop with a sampled PI; the noise circulates.
#[test]
fn closed_loop() {
    let controller = Controller::pi(0.6, 0.02).unwrap();
    let n = 2000;
    let r = excitation::prbs(n, 40, -1.0, 1.0, 9).unwrap();
    let second = PlantModel::new(&[12.0, 30.0], &[1.5]).unwrap();
    // The library of loops has no integrators: a slow pole stands for one, 1e9 times slower than the record is long.
    let slow = 1e9;
    let integrator = PlantModel::new(&[slow, 4.0 * slow], &[0.2 * slow]).unwrap();
    for (name, plant, structure, truth) in [
        (
            "integrator",
            integrator,
            Structure::new(2, [0]).with_integrator(),
            vec![(A(2), 4.0), (B(0), 0.2)],
        ),
        (
            "second order",
            second,
            Structure::new(2, [0]),
            vec![(A(1), 12.0), (A(2), 30.0), (B(0), 1.5)],
        ),
    ] {
        let clean =
            sampled_loop(&plant, &controller, 1.0, 1, &r, fcloe::Noise::None, None).unwrap();
        let rms = 0.1 * spread(&clean.y);
        for (colour, ar) in [("white", &[][..]), ("AR(1)", &[0.8])] {
            let record = |seed| {
                let w = coloured(n, rms, ar, &mut rng(seed));
                let in_loop = fcloe::Noise::InLoop(&w);
                let found = sampled_loop(&plant, &controller, 1.0, 1, &r, in_loop, None).unwrap();
                vec![Data {
                    reference: Some(r.clone()),
                    ..data(even(n, 1.0), vec![held(found.u)], found.y)
                }]
            };
            for noise in [Noise::White, Noise::Autoregressive] {
                check(
                    &format!("{name}, {colour}"),
                    &structure,
                    noise,
                    &truth,
                    record,
                );
            }
        }
    }
}

/// A long quiet record with a short one with a hundred times the noise, and records with different steps, one of them with coloured noise:
/// each has a separate variance and autoregression.
#[test]
fn unequal_records() {
    let (a, b) = ([1.0, 10.0], [2.0]);
    let truth = [(A(1), 10.0), (B(0), 2.0)];
    let cases = [
        (
            "sizes",
            [(1000, 1.0, 1.0, 0.02, &[][..]), (200, 1.0, 10.0, 2.0, &[])],
        ),
        (
            "steps",
            [(1000, 0.2, 1.0, 0.1, &[][..]), (300, 2.0, 5.0, 1.0, &[0.9])],
        ),
    ];
    for (name, parts) in cases {
        let clean: Vec<_> = parts
            .iter()
            .map(|(n, step, size, ..)| {
                let u = excitation::prbs(*n, 10, -size, *size, 9).unwrap();
                let time = even(*n, *step);
                let y = respond(&b, &a, &time, &held(u.clone()), 0.0);
                (time, u, y)
            })
            .collect();
        let records = |seed: u64| -> Vec<Data> {
            let mut rng = rng(seed);
            let parts = parts.iter().zip(&clean);
            parts
                .map(|((n, _, _, rms, ar), (time, u, y))| {
                    let v = coloured(*n, *rms, ar, &mut rng);
                    data(time.clone(), vec![held(u.clone())], add(y, &v))
                })
                .collect()
        };
        for noise in [Noise::White, Noise::Autoregressive] {
            check(name, &Structure::new(1, [0]), noise, &truth, records);
        }
    }
}

/// 30 % of the readings are missing at random, and a block of 10 rows.
fn without_some(y: Vec<f64>, rng: &mut impl RngExt) -> Vec<f64> {
    let block = y.len() / 2..y.len() / 2 + 10;
    let rows = y.into_iter().enumerate();
    rows.map(|(k, y)| match rng.random_bool(0.3) || block.contains(&k) {
        true => f64::NAN,
        false => y,
    })
    .collect()
}

/// Missing readings, in open loop and in a loop: the residual's spectrum is that of the readings that are there.
#[test]
fn missing_readings() {
    let (a, b) = ([1.0, 12.0, 30.0], [2.0, 3.0]);
    let truth = [(A(1), 12.0), (A(2), 30.0), (B(0), 2.0), (B(1), 3.0)];
    let time = even(1000, 1.0);
    let u = held(excitation::prbs(1000, 10, -1.0, 1.0, 9).unwrap());
    let clean = respond(&b, &a, &time, &u, 0.0);
    let rms = 0.1 * spread(&clean);
    for (name, ar) in [
        ("white, missing", &[][..]),
        ("AR(2), missing", &[1.3, -0.5]),
    ] {
        let record = |seed| {
            let mut rng = rng(seed);
            let v = coloured(clean.len(), rms, ar, &mut rng);
            let y = without_some(add(&clean, &v), &mut rng);
            vec![data(time.clone(), vec![u.clone()], y)]
        };
        for noise in [Noise::White, Noise::Autoregressive] {
            check(name, &Structure::new(2, [1]), noise, &truth, record);
        }
    }
    let controller = Controller::pi(0.6, 0.02).unwrap();
    let n = 2000;
    let r = excitation::prbs(n, 40, -1.0, 1.0, 9).unwrap();
    let plant = PlantModel::new(&[12.0, 30.0], &[1.5]).unwrap();
    let clean = sampled_loop(&plant, &controller, 1.0, 1, &r, fcloe::Noise::None, None).unwrap();
    let rms = 0.1 * spread(&clean.y);
    let truth = [(A(1), 12.0), (A(2), 30.0), (B(0), 1.5)];
    let record = |seed| {
        let mut rng = rng(seed);
        let w = coloured(n, rms, &[0.8], &mut rng);
        let in_loop = fcloe::Noise::InLoop(&w);
        let found = sampled_loop(&plant, &controller, 1.0, 1, &r, in_loop, None).unwrap();
        vec![Data {
            reference: Some(r.clone()),
            ..data(
                even(n, 1.0),
                vec![held(found.u)],
                without_some(found.y, &mut rng),
            )
        }]
    };
    for noise in [Noise::White, Noise::Autoregressive] {
        check(
            "in a loop, missing",
            &Structure::new(2, [0]),
            noise,
            &truth,
            record,
        );
    }
}

/// A record in three parts, one of them short, between which the input is not known: one offset, one noise.
#[test]
fn parts_of_a_record() {
    let (a, b) = ([1.0, 10.0], [2.0]);
    let truth = [(A(1), 10.0), (B(0), 2.0), (Kind::Offset { record: 0 }, 5.0)];
    let time = even(1000, 1.0);
    let u = excitation::prbs(1000, 10, -1.0, 1.0, 9).unwrap();
    let clean = respond(&b, &a, &time, &held(u.clone()), 0.0);
    let records = |seed: u64| -> Vec<Data> {
        let mut rng = rng(seed);
        let v = coloured(clean.len(), 0.2, &[0.7], &mut rng);
        let y = without_some(add(&clean, &v), &mut rng);
        let part = |rows: std::ops::Range<usize>| Data {
            continues: rows.start > 0,
            ..data(
                time[rows.clone()].to_vec(),
                vec![held(u[rows.clone()].to_vec())],
                y[rows].iter().map(|y| y + 5.0).collect(),
            )
        };
        vec![part(0..450), part(470..490), part(520..1000)]
    };
    for noise in [Noise::White, Noise::Autoregressive] {
        check("parts", &Structure::new(1, [0]), noise, &truth, records);
    }
    let found = estimate(
        &records(1),
        &Structure::new(1, [0]),
        &Settings::new(Noise::White),
    )
    .unwrap();
    assert_eq!((found.parameters.len(), found.noise.len()), (3, 1));
}
