//! The residual tests over many records: right size where nothing is left, power where something is.

use approx::assert_relative_eq;
use ct_signals::residual_tests::{
    autocorrelation, cross_correlation, ljung_box, pairs, prewhitened_input_test,
};
use ct_signals::{ArModel, Error, excitation, noise};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const RUNS: u64 = 1000;
const N: usize = 500;

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Probabilities are spread evenly: each share within its band.
fn assert_uniform(p: &[f64], context: &str) {
    for (level, low, high) in [
        (0.01, 0.0, 0.025),
        (0.1, 0.06, 0.14),
        (0.5, 0.42, 0.58),
        (0.9, 0.85, 0.95),
    ] {
        let share = p.iter().filter(|p| **p < level).count() as f64 / p.len() as f64;
        assert!(
            (low..=high).contains(&share),
            "{context}: share of p < {level} is {share}"
        );
    }
}

fn share_below(p: &[f64], level: f64) -> f64 {
    p.iter().filter(|p| **p < level).count() as f64 / p.len() as f64
}

fn steps(rng: &mut ChaCha8Rng) -> Vec<f64> {
    excitation::steps(N, 5..=30, 2.0, 8.0, rng).unwrap()
}

#[test]
fn correlations_by_hand() {
    // x - mean = -1.5, -0.5, 0.5, 1.5; sum of squares 5.
    let r = autocorrelation(&[1.0, 2.0, 3.0, 4.0], 4);
    let expected = [1.0, 1.25 / 5.0, -1.5 / 5.0, -2.25 / 5.0, 0.0];
    for (r, expected) in r.iter().zip(expected) {
        assert_relative_eq!(*r, expected, max_relative = 1e-12);
    }
    assert_eq!(autocorrelation(&[3.0; 5], 2), [1.0, 0.0, 0.0]);
    assert_eq!(autocorrelation(&[], 2), [1.0, 0.0, 0.0]);
}

#[test]
fn the_input_leads() {
    let u = noise::white(5000, 1.0, &mut rng(1));
    let e: Vec<f64> = (0..5000)
        .map(|k| if k < 3 { 0.0 } else { -u[k - 3] })
        .collect();
    let r = cross_correlation(&u, &e, 6);
    assert!(r[3] < -0.99);
    for (lag, r) in r.iter().enumerate().filter(|(lag, _)| *lag != 3) {
        assert!(r.abs() < 0.06, "lag {lag}: {r}");
    }
}

#[test]
fn ljung_box_against_a_worked_value() {
    // rho = 1/4, -3/10 at n = 4: Q = 4*6*(0.0625/3 + 0.09/2) = 1.58; chi-square of 2: exp(-Q/2).
    let p = ljung_box(&[1.0, 2.0, 3.0, 4.0], 2, 0).unwrap();
    assert_relative_eq!(p, (-0.79_f64).exp(), max_relative = 1e-9);
}

#[test]
fn ljung_box_is_even_on_white_noise_and_small_on_coloured() {
    let p: Vec<f64> = (0..RUNS)
        .map(|seed| ljung_box(&noise::white(N, 3.0, &mut rng(seed)), 20, 0).unwrap())
        .collect();
    assert_uniform(&p, "white");
    let p: Vec<f64> = (0..RUNS)
        .map(|seed| ljung_box(&noise::ar1(N, 3.0, 0.3, &mut rng(seed)), 20, 0).unwrap())
        .collect();
    assert!(share_below(&p, 0.01) > 0.95, "{}", share_below(&p, 0.01));
}

#[test]
fn ljung_box_counts_fitted_coefficients() {
    let p: Vec<f64> = (0..RUNS)
        .map(|seed| {
            let v = noise::ar1(N, 1.0, 0.6, &mut rng(seed));
            let model = ArModel::fit(&[&v], 6).unwrap();
            ljung_box(&model.whiten(&v), 12, model.order()).unwrap()
        })
        .collect();
    assert_uniform(&p, "whitened by its own model");
}

#[test]
fn input_test_is_even_where_nothing_is_left() {
    type Input = fn(&mut ChaCha8Rng) -> Vec<f64>;
    // Changes of an input with a step every twelve samples.
    let moves = |rng: &mut ChaCha8Rng| {
        let sizes = noise::white(N, 1.0, rng);
        (0..N)
            .map(|k| {
                if k % 12 == 5 {
                    sizes[k].abs() + 2.0
                } else {
                    0.0
                }
            })
            .collect()
    };
    let inputs: [(&str, Input); 4] = [
        ("regular moves", moves),
        ("steps", steps),
        ("smooth", |rng| noise::ar1(N, 1.0, 0.95, rng)),
        ("binary", |_| excitation::prbs(N, 4, 0.0, 5.0, 9).unwrap()),
    ];
    for (name, input) in inputs {
        for rho in [0.0, 0.9] {
            let p: Vec<f64> = (0..RUNS)
                .map(|seed| {
                    let mut rng = rng(seed);
                    let u = input(&mut rng);
                    let e = noise::ar1(N, 0.2, rho, &mut rng);
                    prewhitened_input_test(&u, &e, 20).unwrap().1
                })
                .collect();
            assert_uniform(&p, &format!("{name}, noise of rho = {rho}"));
        }
    }
}

#[test]
fn input_test_is_even_in_a_closed_loop() {
    // A proportional controller on an integrating process: the residual is pure noise, but the input depends on it.
    let p: Vec<f64> = (0..RUNS)
        .map(|seed| {
            let mut rng = rng(seed);
            let r = steps(&mut rng);
            let e = noise::ar1(N, 0.3, 0.7, &mut rng);
            let mut level = 5.0;
            let u: Vec<f64> = (0..N)
                .map(|k| {
                    let u = 0.5 * (r[k] - (level + e[k]));
                    level += 0.2 * u;
                    u
                })
                .collect();
            prewhitened_input_test(&u, &e, 20).unwrap().1
        })
        .collect();
    assert_uniform(&p, "closed loop");
}

#[test]
fn input_test_sees_what_the_model_lacks() {
    // The residual holds a first-order response of half the noise's size.
    let p: Vec<f64> = (0..RUNS)
        .map(|seed| {
            let mut rng = rng(seed);
            let u = steps(&mut rng);
            let mut e = noise::white(N, 0.4, &mut rng);
            let mut x = 0.0;
            for k in 1..N {
                x = 0.8 * x + 0.2 * 0.12 * (u[k - 1] - 5.0);
                e[k] += x;
            }
            prewhitened_input_test(&u, &e, 20).unwrap().1
        })
        .collect();
    assert!(share_below(&p, 0.01) > 0.8, "{}", share_below(&p, 0.01));
}

#[test]
fn tests_that_make_no_sense_are_refused() {
    let x = noise::white(30, 1.0, &mut rng(1));
    assert!(matches!(
        ljung_box(&x, 5, 5),
        Err(Error::InvalidSetting { .. })
    ));
    assert!(matches!(
        ljung_box(&x, 0, 0),
        Err(Error::InvalidSetting { .. })
    ));
    assert!(matches!(
        ljung_box(&x, 30, 0),
        Err(Error::TooFewSamples { needed: 31, .. })
    ));
    assert!(matches!(
        ljung_box(&[1.0, f64::INFINITY, 2.0], 1, 0),
        Err(Error::ValueNotFinite { .. })
    ));
    let error = prewhitened_input_test(&x, &x[1..], 5);
    assert!(matches!(error, Err(Error::SeriesMismatch { .. })));
    assert!(prewhitened_input_test(&x, &x, 0).is_err());
    // A constant input explains nothing: no correlation.
    let (correlation, p) = prewhitened_input_test(&[1.0; 30], &x, 5).unwrap();
    assert_eq!((correlation, p), (vec![0.0; 6], 1.0));
}

/// 30 % of the samples at random, or blocks of 10 to 40.
fn thinned(x: &[f64], blocks: bool, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut x = x.to_vec();
    let n = x.len();
    if blocks {
        for _ in 0..n / 80 {
            let at = rng.random_range(0..n - 40);
            x[at..at + rng.random_range(10..40)].fill(f64::NAN);
        }
    } else {
        x.iter_mut()
            .filter(|_| rng.random::<f64>() < 0.3)
            .for_each(|x| *x = f64::NAN);
    }
    x
}

#[test]
fn correlations_by_hand_where_samples_are_missing() {
    // x - mean = -2, ., 0, 2 and lag 2 has one pair of 0 and -2, lag 3 one of 2 and -2.
    let x = [1.0, f64::NAN, 3.0, 5.0];
    assert_eq!(pairs(&x, &x, 4), [3, 1, 1, 1, 0]);
    let r = autocorrelation(&x, 4);
    for (r, expected) in r.iter().zip([1.0, 0.0, 0.0, -0.25, 0.0]) {
        assert_relative_eq!(*r, expected, max_relative = 1e-12);
    }
    // Nearly as many as there are, nearly the same.
    let mut x = noise::ar1(5000, 1.0, 0.8, &mut rng(4));
    let whole = autocorrelation(&x, 10);
    x[2000] = f64::NAN;
    for (a, b) in whole.iter().zip(autocorrelation(&x, 10)) {
        assert!((a - b).abs() < 2e-3, "{a} {b}");
    }
    assert_eq!(pairs(&[0.0; 5], &[0.0; 4], 2), [4, 3, 2]);
}

#[test]
fn tests_are_even_where_samples_are_missing_and_see_what_is_there() {
    let runs = std::env::var("RECORDS").map_or(RUNS / 2, |runs| runs.parse().unwrap());
    for blocks in [false, true] {
        let context = if blocks { "blocks" } else { "at random" };
        let all = |p: &dyn Fn(&mut ChaCha8Rng) -> f64| -> Vec<f64> {
            (0..runs).map(|seed| p(&mut rng(seed))).collect()
        };
        let sized = |p: Vec<f64>, what: &str| {
            let share = share_below(&p, 0.05);
            println!("{what}, {context}: {share} below 0.05");
            assert_uniform(&p, &format!("{what}, {context}"));
            // Three standard errors, and the error of the chi-square approximation.
            let width = 3.0 * (0.05 * 0.95 / runs as f64).sqrt() + 0.005;
            assert!((share - 0.05).abs() < width, "{what}, {context}: {share}");
        };
        sized(
            all(&|rng| {
                let x = noise::white(N, 3.0, rng);
                ljung_box(&thinned(&x, blocks, rng), 20, 0).unwrap()
            }),
            "white",
        );
        sized(
            all(&|rng| {
                let x = thinned(&noise::ar1(N, 1.0, 0.6, rng), blocks, rng);
                let model = ArModel::fit(&[&x], 6).unwrap();
                ljung_box(&model.whiten(&x), 12, model.order()).unwrap()
            }),
            "whitened by its own model",
        );
        let coloured = all(&|rng| {
            let x = noise::ar1(N, 3.0, 0.3, rng);
            ljung_box(&thinned(&x, blocks, rng), 20, 0).unwrap()
        });
        assert!(
            share_below(&coloured, 0.01) > 0.6,
            "{}",
            share_below(&coloured, 0.01)
        );
        println!(
            "coloured, {context}: {} below 0.01",
            share_below(&coloured, 0.01)
        );
        let unexplained = |gain: f64, rho: f64| {
            move |rng: &mut ChaCha8Rng| {
                let u = steps(rng);
                let mut e = noise::ar1(N, 0.4, rho, rng);
                let mut x = 0.0;
                for k in 1..N {
                    x = 0.8 * x + 0.2 * gain * (u[k - 1] - 5.0);
                    e[k] += x;
                }
                prewhitened_input_test(&u, &thinned(&e, blocks, rng), 20)
                    .unwrap()
                    .1
            }
        };
        sized(all(&unexplained(0.0, 0.0)), "white beside steps");
        sized(all(&unexplained(0.0, 0.9)), "noise of 0.9 beside steps");
        let seen = all(&unexplained(0.16, 0.0));
        // Three samples of ten are missing: with complete records the limit is 0.8.
        assert!(
            share_below(&seen, 0.01) > 0.75,
            "{}",
            share_below(&seen, 0.01)
        );
        println!(
            "beside an effect, {context}: {} below 0.01",
            share_below(&seen, 0.01)
        );
    }
}

#[test]
fn lags_without_pairs_do_not_count() {
    let mut x = noise::white(600, 1.0, &mut rng(7));
    let sampled: Vec<f64> = x.iter().step_by(3).copied().collect();
    for (k, x) in x.iter_mut().enumerate() {
        if k % 3 != 0 {
            *x = f64::NAN;
        }
    }
    // With two of three samples missing, the result is that of the series of the others.
    let (whole, thin) = (ljung_box(&sampled, 6, 0), ljung_box(&x, 18, 0));
    assert_relative_eq!(whole.unwrap(), thin.unwrap(), max_relative = 1e-9);
    assert!(matches!(
        ljung_box(&x, 2, 0),
        Err(Error::TooFewSamples { .. })
    ));
    assert!(ljung_box(&[f64::NAN; 40], 5, 0).is_err());
}
