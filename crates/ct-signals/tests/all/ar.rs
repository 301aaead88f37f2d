//! Autoregressive noise against dense linear algebra, and over many simulated records.
// Matrices by their indices, as in textbooks.
#![allow(clippy::needless_range_loop)]

mod missing;

use approx::assert_relative_eq;
use ct_signals::{ArModel, Error, noise};
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
    // Missing rows at every phase of the filter's ring, also before it is full.
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
    // The result does not depend on their order.
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
        // Stable: its coefficients are accepted, up to rounding at the margin.
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
