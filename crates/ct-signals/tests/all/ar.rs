//! Autoregressive noise against dense linear algebra, and over many simulated records.
// Matrices by their indices, as in the books.
#![allow(clippy::needless_range_loop)]

use approx::assert_relative_eq;
use ct_signals::{ArModel, Error, noise};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const PROCESSES: [&[f64]; 5] = [
    &[0.8],
    &[-0.5],
    &[1.5, -0.7],
    &[0.4, 0.3],
    &[1.9, -1.4, 0.42],
];

/// Autocovariance at lags 0..n from the impulse response, for innovations of variance 1.
fn autocovariance(coefficients: &[f64], n: usize) -> Vec<f64> {
    let mut response = vec![0.0; 4000];
    response[0] = 1.0;
    for k in 1..response.len() {
        response[k] = coefficients
            .iter()
            .enumerate()
            .take(k)
            .map(|(i, a)| a * response[k - i - 1])
            .sum();
    }
    (0..n)
        .map(|lag| {
            response
                .iter()
                .zip(&response[lag..])
                .map(|(a, b)| a * b)
                .sum()
        })
        .collect()
}

/// Lower triangle `L` with `L L' = R`, `R` the Toeplitz matrix of `r`.
fn cholesky(r: &[f64]) -> Vec<Vec<f64>> {
    let n = r.len();
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = r[i - j] - sum;
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
    }
    l
}

/// `v[k] = sum a_i v[k-i] + e[k]`, past its start.
fn simulate(coefficients: &[f64], sigma: f64, n: usize, seed: u64) -> Vec<f64> {
    let settle = 500;
    let mut v = noise::white(settle + n, sigma, &mut ChaCha8Rng::seed_from_u64(seed));
    for k in 0..v.len() {
        for (i, a) in coefficients.iter().enumerate().take(k) {
            v[k] += a * v[k - i - 1];
        }
    }
    v.split_off(settle)
}

#[test]
fn whitening_is_the_inverse_of_the_dense_cholesky_factor() {
    let n = 12;
    for coefficients in PROCESSES {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        let l = cholesky(&autocovariance(coefficients, n));
        // Whiten the columns of L: L^-1 L = I, row by row.
        let mut whitener = model.whitener(n);
        for k in 0..n {
            let mut row = l[k].clone();
            whitener.push(&mut row);
            for j in 0..n {
                let identity = if j == k { 1.0 } else { 0.0 };
                assert!(
                    (row[j] - identity).abs() < 1e-9,
                    "{coefficients:?}: [{k}, {j}] {}",
                    row[j]
                );
            }
        }
    }
}

#[test]
fn log_det_is_that_of_the_dense_matrix() {
    for coefficients in PROCESSES {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        for n in 1..9 {
            let l = cholesky(&autocovariance(coefficients, n));
            let dense: f64 = (0..n).map(|k| 2.0 * l[k][k].ln()).sum();
            assert_relative_eq!(model.log_det(n), dense, epsilon = 1e-9, max_relative = 1e-9);
        }
        assert_eq!(model.log_det(0), 0.0);
    }
}

#[test]
fn stationary_deviation_is_that_of_the_process() {
    for coefficients in PROCESSES {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        let expected = 0.3 * autocovariance(coefficients, 1)[0].sqrt();
        assert_relative_eq!(model.stationary_std(), expected, max_relative = 1e-9);
    }
}

#[test]
fn a_level_as_large_as_the_process_is_whitened_to_its_slow_gain() {
    for coefficients in PROCESSES {
        let model = ArModel::from_coefficients(coefficients, 0.3).unwrap();
        let whitened = model.whiten(&[model.stationary_std(); 20]);
        assert_relative_eq!(whitened[19] / 0.3, model.slow_gain(), max_relative = 1e-9);
    }
    assert_eq!(ArModel::white(0.3).slow_gain(), 1.0);
    // Noise of a long memory: 3.2 times its innovations, of which a twentieth is left.
    let slow = ArModel::from_coefficients(&[0.95], 1.0).unwrap();
    assert_relative_eq!(slow.slow_gain(), 0.16, max_relative = 0.01);
}

#[test]
fn white_noise_is_left_alone_bit_for_bit() {
    let model = ArModel::white(0.7);
    assert_eq!(
        (model.order(), model.sigma(), model.stationary_std()),
        (0, 0.7, 0.7)
    );
    assert_eq!(model.log_det(100), 0.0);
    let v = noise::white(50, 0.7, &mut ChaCha8Rng::seed_from_u64(1));
    let bits = |v: &[f64]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&model.whiten(&v)), bits(&v));
}

#[test]
fn after_a_reset_the_next_record_is_whitened_like_the_first() {
    let model = ArModel::from_coefficients(&[1.5, -0.7], 1.0).unwrap();
    let v = simulate(&[1.5, -0.7], 1.0, 9, 2);
    let mut whitener = model.whitener(1);
    // Stop at every phase of the filter's ring, also before it is full.
    for stop in 0..9 {
        whitener.reset();
        for value in &v[..stop] {
            whitener.push(&mut [*value]);
        }
        whitener.reset();
        let again: Vec<f64> = v
            .iter()
            .map(|value| {
                let mut row = [*value];
                whitener.push(&mut row);
                row[0]
            })
            .collect();
        assert_eq!(again, model.whiten(&v), "stopped after {stop}");
    }
}

#[test]
fn lanes_do_not_mix() {
    let model = ArModel::from_coefficients(&[1.9, -1.4, 0.42], 1.0).unwrap();
    let signals: Vec<Vec<f64>> = (0..4).map(|seed| simulate(&[0.5], 1.0, 30, seed)).collect();
    let alone: Vec<Vec<f64>> = signals.iter().map(|v| model.whiten(v)).collect();
    let mut whitener = model.whitener(4);
    assert_eq!(whitener.lanes(), 4);
    for k in 0..30 {
        let mut row: Vec<f64> = signals.iter().map(|v| v[k]).collect();
        whitener.push(&mut row);
        for lane in 0..4 {
            assert_eq!(row[lane], alone[lane][k]);
        }
    }
}

#[test]
fn fit_recovers_coefficients_and_order() {
    let n = 4000;
    for coefficients in PROCESSES {
        let runs = 40;
        let mut right_order = 0;
        let mut sums = vec![0.0; coefficients.len()];
        let mut variance = 0.0;
        for seed in 0..runs {
            let v = simulate(coefficients, 0.3, n, seed);
            let model = ArModel::fit(&[&v], 8).unwrap();
            right_order += usize::from(model.order() == coefficients.len());
            for (sum, a) in sums.iter_mut().zip(model.coefficients()) {
                *sum += a / runs as f64;
            }
            variance += model.sigma().powi(2) / runs as f64;
        }
        // BIC takes one order too many with probability P(chi2_1 > log n), 0.4 %.
        assert!(
            right_order >= 36,
            "{coefficients:?}: right in {right_order} of {runs}"
        );
        for (mean, a) in sums.iter().zip(coefficients) {
            assert!((mean - a).abs() < 0.02, "{coefficients:?}: {mean} for {a}");
        }
        // Standard error 0.4 % of the variance.
        assert_relative_eq!(variance, 0.09, max_relative = 0.015);
    }
}

#[test]
fn sigma_is_unbiased_in_short_records() {
    let runs = 4000;
    let mean = (0..runs)
        .map(|seed| {
            let v = noise::white(25, 2.0, &mut ChaCha8Rng::seed_from_u64(seed));
            ArModel::fit(&[&v], 0).unwrap().sigma().powi(2)
        })
        .sum::<f64>()
        / runs as f64;
    // Standard error 4 sqrt(2/25/4000) = 0.018.
    assert!((mean - 4.0).abs() < 0.07, "{mean}");
}

#[test]
fn white_noise_is_seldom_called_coloured() {
    let runs = 300;
    let coloured = (0..runs)
        .filter(|seed| {
            let v = noise::white(1000, 1.0, &mut ChaCha8Rng::seed_from_u64(*seed));
            ArModel::fit(&[&v], 10).unwrap().order() > 0
        })
        .count();
    // P(chi2_1 > log 1000) = 0.9 %, and a little for the higher orders.
    assert!(coloured <= 12, "{coloured} of {runs}");
}

#[test]
fn segments_are_independent_records() {
    let coefficients = [0.9];
    let segments: Vec<Vec<f64>> = (0..100)
        .map(|seed| simulate(&coefficients, 1.0, 40, seed))
        .collect();
    let views: Vec<&[f64]> = segments.iter().map(Vec::as_slice).collect();
    let model = ArModel::fit(&views, 5).unwrap();
    assert_eq!(model.order(), 1);
    // Standard error sqrt((1 - 0.81)/4000) = 0.007.
    assert!(
        (model.coefficients()[0] - 0.9).abs() < 0.025,
        "{:?}",
        model.coefficients()
    );
    // Their order does not matter.
    let reversed: Vec<&[f64]> = views.iter().rev().copied().collect();
    let other = ArModel::fit(&reversed, 5).unwrap();
    assert_relative_eq!(
        model.coefficients()[0],
        other.coefficients()[0],
        max_relative = 1e-12
    );
}

#[test]
fn the_mean_stays_in() {
    let v: Vec<f64> = simulate(&[0.0], 0.1, 500, 3)
        .iter()
        .map(|v| v + 10.0)
        .collect();
    let model = ArModel::fit(&[&v], 1).unwrap();
    assert!(model.coefficients()[0] > 0.99);
}

#[test]
fn degenerate_signals_give_a_stable_model() {
    let sine: Vec<f64> = (0..200).map(|k| (0.1 * f64::from(k)).sin()).collect();
    for v in [
        vec![5.0; 200],
        sine,
        vec![1.0],
        vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ] {
        let model = ArModel::fit(&[&v], 10).unwrap();
        assert!(model.sigma().is_finite() && model.stationary_std().is_finite());
        assert!(model.coefficients().iter().all(|a| a.is_finite()));
        assert!(model.whiten(&v).iter().all(|w| w.is_finite()));
        // Stable: its own coefficients are accepted, up to rounding at the margin.
        assert!(model.log_det(v.len()).is_finite());
    }
    let silent = ArModel::fit(&[&[0.0; 30], &[]], 3).unwrap();
    assert_eq!((silent.order(), silent.sigma()), (0, 0.0));
}

#[test]
fn invalid_models_are_refused() {
    assert!(matches!(
        ArModel::fit(&[], 3),
        Err(Error::TooFewSamples { .. })
    ));
    assert!(matches!(
        ArModel::fit(&[&[]], 3),
        Err(Error::TooFewSamples { .. })
    ));
    let error = ArModel::fit(&[&[1.0, f64::INFINITY]], 3);
    assert!(matches!(error, Err(Error::ValueNotFinite { index: 1, .. })));
    let error = ArModel::fit(&[&[f64::NAN; 20]], 3);
    assert!(matches!(error, Err(Error::TooFewSamples { found: 0, .. })));
    for coefficients in [&[1.0][..], &[0.5, 0.5], &[2.1, -1.2], &[f64::NAN]] {
        let error = ArModel::from_coefficients(coefficients, 1.0);
        assert!(
            matches!(error, Err(Error::InvalidSetting { .. })),
            "{coefficients:?}"
        );
    }
    assert!(ArModel::from_coefficients(&[], -1.0).is_err());
}

#[test]
fn from_coefficients_is_the_inverse_of_the_ladder() {
    let v = simulate(&[1.9, -1.4, 0.42], 1.0, 3000, 9);
    let fitted = ArModel::fit(&[&v], 6).unwrap();
    let again = ArModel::from_coefficients(fitted.coefficients(), fitted.sigma()).unwrap();
    for (a, b) in fitted.whiten(&v).iter().zip(again.whiten(&v)) {
        assert_relative_eq!(*a, b, epsilon = 1e-9);
    }
}

#[test]
fn partial_correlations_and_coefficients_invert_each_other() {
    let k = [0.9, -0.5, 0.3, 0.1];
    let model = ArModel::from_reflections(&k, 2.0).unwrap();
    let back = ArModel::from_coefficients(model.coefficients(), model.sigma()).unwrap();
    for (a, b) in k.iter().zip(back.reflections()) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    assert!(ArModel::from_reflections(&[1.0], 1.0).is_err());
}

#[test]
fn memory_is_limited_and_short_memories_are_left_alone() {
    let short = ArModel::from_coefficients(&[0.5, 0.2], 0.3).unwrap();
    assert_eq!(short.with_memory_at_most(50.0), short);
    // A slow pole and a fast one: (1 - 0.999 q)(1 - 0.4 q).
    let long = ArModel::from_coefficients(&[1.399, -0.3996], 0.3).unwrap();
    let limited = long.with_memory_at_most(40.0);
    assert_eq!(limited.sigma(), 0.3);
    // Roots of z^2 - a_1 z - a_2.
    let [a1, a2] = limited.coefficients() else {
        panic!("{limited:?}")
    };
    let root = (a1 * a1 / 4.0 + a2).sqrt();
    let (slow, fast) = (a1 / 2.0 + root, a1 / 2.0 - root);
    assert_relative_eq!(slow, (-1.0_f64 / 40.0).exp(), max_relative = 1e-9);
    assert_relative_eq!(fast, 0.4, max_relative = 0.03);
    // A slow oscillation is limited too.
    let (radius, angle) = (0.9999_f64, 0.3_f64);
    let swings = ArModel::from_coefficients(&[2.0 * radius * angle.cos(), -radius * radius], 1.0);
    let limited = swings.unwrap().with_memory_at_most(40.0);
    assert_relative_eq!(
        -limited.coefficients()[1],
        (-2.0_f64 / 40.0).exp(),
        max_relative = 1e-9
    );
}

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
            // Each row is a sum of n independent unit values: their covariance has to be the identity.
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

/// The fit's own sum of squares is that of the series whitened afterwards, segments shorter than the order included.
#[test]
fn the_fit_knows_its_whitened_squares() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let series = noise::ar1(400, 1.0, 0.9, &mut rng);
    let lagged: Vec<f64> = (4..400).map(|k| series[k] - 0.8 * series[k - 4]).collect();
    for segments in [
        vec![&lagged[..]],
        vec![&lagged[..3], &lagged[10..11], &lagged[20..390]],
        vec![&lagged[..60], &[], &lagged[70..200]],
    ] {
        let model = ArModel::fit(&segments, 8).unwrap();
        assert!(model.order() >= 4, "{model:?}");
        let whitened = segments.iter().flat_map(|segment| model.whiten(segment));
        let squares: f64 = whitened.map(|w| w * w).sum();
        let samples: usize = segments.iter().map(|segment| segment.len()).sum();
        let own = model.sigma().powi(2) * (samples - model.order()) as f64;
        assert!((own - squares).abs() < 1e-11 * squares, "{own} {squares}");
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

/// A gap is as many lost rows, however it is passed.
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
                    // Of a signal that is far larger than its innovations some digits are lost either way.
                    let close = if coefficients == slow { 1e-6 } else { 1e-8 };
                    assert_relative_eq!(of_a, of_b, max_relative = close);
                    for (a, b) in a.iter().zip(b) {
                        assert!((a - b).abs() < close, "{coefficients:?}, {gap}: {a} {b}");
                    }
                }
            }
        }
        // Of the largest possible gap nothing is remembered.
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
    // The most that the spread grows: of samples lost at random the pairs are fewer, of blocks only the samples.
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
