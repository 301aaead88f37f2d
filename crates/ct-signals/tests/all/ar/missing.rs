//! Autoregressive noise where samples are missing.

use approx::assert_relative_eq;
use ct_signals::ArModel;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{PROCESSES, autocovariance, cholesky, simulate};

#[test]
fn rows_behind_lost_ones_come_out_white_and_of_the_same_variance() {
    let n = 14;
    for lost in [&[0][..], &[3], &[2, 4, 5, 6, 7, 10], &[0, 1, 13]] {
        for coefficients in PROCESSES {
            let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
            let l = cholesky(&autocovariance(coefficients, n));
            let mut whitener = model.whitener(n);
            let mut whitened: Vec<Vec<f64>> = Vec::new();
            for k in 0..n {
                if lost.contains(&k) {
                    whitener.skip();
                    continue;
                }
                let mut row = l[k].clone();
                whitener.push(&mut row);
                whitened.push(row);
            }
            // Each row is a sum of n independent unit values: their covariance must be the identity.
            for (i, a) in whitened.iter().enumerate() {
                for (j, b) in whitened.iter().enumerate() {
                    let covariance: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    let identity = if i == j { 1.0 } else { 0.0 };
                    assert!(
                        (covariance - identity).abs() < 1e-8,
                        "{coefficients:?} without {lost:?}: [{i}, {j}] {covariance}"
                    );
                }
            }
        }
    }
}

/// Rows that are missing, of 40.
fn patterns() -> Vec<Vec<usize>> {
    vec![
        vec![],
        vec![0],
        vec![0, 1, 2, 39],
        vec![1],
        vec![2, 4, 5, 6, 7, 10, 11, 30],
        (0..40).filter(|k| k % 3 != 0).collect(),
        (0..40).filter(|k| k % 2 == 0).collect(),
        (5..35).collect(),
        (0..40).filter(|k| (7 * k * k + 3) % 10 < 4).collect(),
    ]
}

/// Whitening and log-determinant against the covariance matrix without the rows and columns of what is missing.
#[test]
fn missing_samples_are_left_out_as_by_dense_algebra() {
    let n = 40;
    for coefficients in PROCESSES {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        let r = autocovariance(coefficients, n);
        let v = simulate(coefficients, 0.3, n, 11);
        for missing in patterns() {
            let there: Vec<usize> = (0..n).filter(|k| !missing.contains(k)).collect();
            let mut l = vec![vec![0.0_f64; there.len()]; there.len()];
            for i in 0..there.len() {
                for j in 0..=i {
                    let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                    let rest = r[there[i] - there[j]] - sum;
                    l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
                }
            }
            let mut solved: Vec<f64> = Vec::new();
            for i in 0..there.len() {
                let known: f64 = (0..i).map(|j| l[i][j] * solved[j]).sum();
                solved.push((v[there[i]] - known) / l[i][i]);
            }
            let mut thin = v.clone();
            missing.iter().for_each(|&k| thin[k] = f64::NAN);
            let whitened = model.whiten(&thin);
            for (i, &k) in there.iter().enumerate() {
                assert!(
                    (whitened[k] - solved[i]).abs() < 1e-9,
                    "{coefficients:?} without {missing:?}, {k}: {} {}",
                    whitened[k],
                    solved[i]
                );
            }
            assert!(missing.iter().all(|&k| whitened[k].is_nan()));
            let dense: f64 = (0..there.len()).map(|i| 2.0 * l[i][i].ln()).sum();
            let ours = model.log_det_of(thin.iter().map(|v| !v.is_nan()));
            assert_relative_eq!(ours, dense, epsilon = 1e-8, max_relative = 1e-8);
        }
        for n in 0..9 {
            assert_eq!(model.log_det_of(vec![true; n]), model.log_det(n));
        }
        assert_eq!(model.log_det_of([false; 5]), 0.0);
    }
}

/// A gap equals the same number of lost rows, for each way of skipping.
#[test]
fn long_gaps_are_as_many_lost_rows() {
    let slow = [1.989, -0.989_01];
    for coefficients in PROCESSES.iter().copied().chain([&slow[..], &[0.999_999]]) {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        let v = simulate(coefficients, 0.3, 30, 12);
        for gap in [0, 1, 5, 17, 49, 50, 333, 1000, 20_000] {
            for begin in [0, 1, 2, 9] {
                let mut one_by_one = model.whitener(2);
                let mut at_once = model.whitener(2);
                for value in &v[..begin] {
                    one_by_one.push(&mut [*value, 1.0]);
                    at_once.push(&mut [*value, 1.0]);
                }
                (0..gap).for_each(|_| one_by_one.skip());
                at_once.skip_many(gap);
                for value in &v[begin..] {
                    let (mut a, mut b) = ([*value, 1.0], [*value, 1.0]);
                    let (of_a, of_b) = (
                        one_by_one.push_with_variance(&mut a),
                        at_once.push_with_variance(&mut b),
                    );
                    // For a signal far larger than its innovations, rounding loses some digits in both computations.
                    let close = if coefficients == slow { 1e-6 } else { 1e-8 };
                    assert_relative_eq!(of_a, of_b, max_relative = close);
                    for (a, b) in a.iter().zip(b) {
                        assert!((a - b).abs() < close, "{coefficients:?}, {gap}: {a} {b}");
                    }
                }
            }
        }
        // After the largest possible gap the memory is empty.
        let mut whitener = model.whitener(1);
        whitener.push(&mut [1.0]);
        whitener.skip_many(usize::MAX);
        let mut row = [1.0];
        whitener.push(&mut row);
        assert_relative_eq!(row[0], model.whiten(&[1.0])[0], max_relative = 1e-9);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Pattern {
    Whole,
    AtRandom,
    Blocks,
    EveryThird,
}

fn thinned(mut v: Vec<f64>, pattern: Pattern, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let n = v.len();
    match pattern {
        Pattern::Whole => {}
        Pattern::AtRandom => {
            v.iter_mut()
                .filter(|_| rng.random::<f64>() < 0.3)
                .for_each(|v| *v = f64::NAN);
        }
        Pattern::Blocks => (0..n / 140).for_each(|_| {
            let at = rng.random_range(0..n - 50);
            v[at..at + 50].fill(f64::NAN);
        }),
        Pattern::EveryThird => (0..n).filter(|k| k % 3 > 0).for_each(|k| v[k] = f64::NAN),
    }
    v
}

/// Mean and standard deviation.
fn moments(x: &[f64]) -> (f64, f64) {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let square = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    (mean, (square / x.len() as f64).sqrt())
}

/// The estimate's bias and spread with 30 % of the samples missing beside those of whole records; `RECORDS=1000` takes so many.
#[test]
fn fit_recovers_what_missing_samples_leave() {
    let runs: u64 = std::env::var("RECORDS").map_or(60, |runs| runs.parse().unwrap());
    let n = 2000;
    // Largest increase of the spread: samples lost at random reduce the number of pairs, blocks only that of samples.
    for (coefficients, at_random, third) in [(&[0.8][..], 1.45, 1.7), (&[1.5, -0.7], 1.45, 2.2)] {
        let p = coefficients.len();
        let mut whole = Vec::new();
        for (pattern, most) in [
            (Pattern::Whole, 1.0),
            (Pattern::AtRandom, at_random),
            (Pattern::Blocks, 1.45),
            (Pattern::EveryThird, third),
        ] {
            let fits: Vec<(ArModel, f64)> = (0..runs)
                .map(|seed| {
                    let v = thinned(simulate(coefficients, 0.3, n, seed), pattern, seed);
                    let model = ArModel::fit(&[&v], 4).unwrap();
                    let left = ct_signals::residual_tests::ljung_box(&model.whiten(&v), 15, p);
                    (model, left.unwrap())
                })
                .collect();
            let right: Vec<_> = fits
                .iter()
                .filter(|(model, _)| model.order() == p)
                .collect();
            assert!(
                right.len() as f64 > 0.9 * runs as f64,
                "{coefficients:?}, {pattern:?}: right order in {} of {runs}",
                right.len()
            );
            let of = |i: usize| {
                right
                    .iter()
                    .map(|(m, _)| m.coefficients()[i])
                    .collect::<Vec<_>>()
            };
            for (i, a) in coefficients.iter().enumerate() {
                let (mean, spread) = moments(&of(i));
                if pattern == Pattern::Whole {
                    whole.push(spread);
                }
                println!(
                    "{a} {pattern:?}: {mean:.4} +- {spread:.4}, {:.2}",
                    spread / whole[i]
                );
                // Four standard errors and the bias of order 1/n.
                let width = 4.0 * spread / (right.len() as f64).sqrt() + 10.0 / n as f64;
                assert!((mean - a).abs() < width, "{a}, {pattern:?}: {mean}");
                assert!(
                    spread < most * whole[i] * (1.0 + 1.0 / (runs as f64).sqrt()),
                    "{a}, {pattern:?}: {spread} for {}",
                    whole[i]
                );
            }
            let (sigma, spread) =
                moments(&right.iter().map(|(m, _)| m.sigma()).collect::<Vec<_>>());
            assert!(
                (sigma - 0.3).abs() < 4.0 * spread / (runs as f64).sqrt() + 0.003,
                "{sigma}"
            );
            let refused = fits.iter().filter(|(_, left)| *left < 0.05).count() as f64 / runs as f64;
            println!("  not white in {refused:.3}, sigma {sigma:.4} +- {spread:.4}");
            let width = 3.0 * (0.05 * 0.95 / runs as f64).sqrt() + 0.01;
            assert!(
                (refused - 0.05).abs() < width,
                "{coefficients:?}, {pattern:?}: {refused}"
            );
        }
    }
}

#[test]
fn the_order_is_found_where_samples_are_missing() {
    for pattern in [Pattern::AtRandom, Pattern::Blocks] {
        for coefficients in PROCESSES.iter().copied().chain([&[][..]]) {
            let right = (0..20).filter(|&seed| {
                let v = thinned(simulate(coefficients, 0.3, 2000, seed), pattern, seed);
                ArModel::fit(&[&v], 6).unwrap().order() == coefficients.len()
            });
            let right = right.count();
            assert!(right >= 18, "{coefficients:?}, {pattern:?}: {right} of 20");
        }
    }
}

#[test]
fn missing_samples_at_the_ends_take_no_part() {
    let v = simulate(&[1.5, -0.7], 1.0, 300, 8);
    let padded = [&[f64::NAN; 7][..], &v, &[f64::NAN; 3]].concat();
    let whole = ArModel::fit(&[&v], 6).unwrap();
    assert_eq!(ArModel::fit(&[&padded, &[f64::NAN; 4]], 6).unwrap(), whole);
    assert_eq!(whole.whiten(&padded)[7..307], whole.whiten(&v));
    let silent = ArModel::fit(&[&[0.0, f64::NAN, 0.0, 0.0]], 3).unwrap();
    assert_eq!((silent.order(), silent.sigma()), (0, 0.0));
    let sine: Vec<f64> = (0..200)
        .map(|k| {
            if k % 7 == 3 {
                f64::NAN
            } else {
                (0.1 * f64::from(k)).sin()
            }
        })
        .collect();
    let stable = ArModel::fit(&[&sine, &[5.0, f64::NAN, 5.0]], 10).unwrap();
    assert!(stable.sigma().is_finite() && stable.stationary_std().is_finite());
    // The fit's sum of squares is that of the series whitened afterwards.
    let thin = thinned(v, Pattern::AtRandom, 3);
    let model = ArModel::fit(&[&thin], 6).unwrap();
    let there: Vec<f64> = model
        .whiten(&thin)
        .into_iter()
        .filter(|w| !w.is_nan())
        .collect();
    let squares: f64 = there.iter().map(|w| w * w).sum();
    let own = model.sigma().powi(2) * (there.len() - model.order()) as f64;
    assert_relative_eq!(own, squares, max_relative = 1e-11);
}
