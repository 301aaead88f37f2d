//! State variable filters: derivatives of sinusoids in closed form, and regressions on filtered signals.

use approx::assert_relative_eq;
use ct_lti::{
    Complex64, Error, Hold, Polynomial, Simulator, Start, StateSpace, StateVariableFilter,
    TransferFunction,
};
use proptest::prelude::*;

/// The filtered sinusoid and its derivatives are those of the gain E(0)/E(jw), but for the line between samples.
#[test]
fn derivatives_of_a_sinusoid() {
    let w: f64 = 0.7;
    let denominators = [
        Polynomial::new([1.5, 1.0]).unwrap(),
        Polynomial::new([2.0, 1.0]).unwrap().pow(3),
        // Another form: a pole pair with damping 0.3 and a lag, and another time scale.
        &Polynomial::new([4.0, 1.2, 1.0]).unwrap() * &Polynomial::new([5.0, 3.0]).unwrap(),
        Polynomial::new([1.0, 1.0]).unwrap().pow(6),
    ];
    for e in denominators {
        let errors = [0.08, 0.04, 0.02].map(|step| {
            let mut filter = StateVariableFilter::new(&e, Hold::First).unwrap();
            let n = filter.order();
            let gain = e.coefficient(0) / e.at_frequency(w);
            let samples = (80.0 / step) as usize;
            let mut worst = vec![0.0_f64; n + 1];
            for k in 0..samples {
                let t = k as f64 * step;
                let found = filter.update((w * t).sin(), step).unwrap();
                if t < 60.0 {
                    continue;
                }
                for (i, found) in found.iter().enumerate() {
                    let expected = gain
                        * Complex64::new(0.0, w).powu(i as u32)
                        * Complex64::from_polar(1.0, w * t);
                    worst[i] = worst[i]
                        .max((found - expected.im).abs() / (gain.norm() * w.powi(i as i32)));
                }
            }
            worst
        });
        // The line loses (w step)^2/12 of the amplitude; the highest derivative, a difference to the sample itself,
        // (lambda/w)^n times as much.
        for (i, coarse) in errors[0].iter().enumerate() {
            assert!(*coarse < 2e-2, "{e}: derivative {i} off by {coarse:e}");
            for (fine, coarse) in [(errors[1][i], errors[0][i]), (errors[2][i], errors[1][i])] {
                assert!(
                    fine < 0.27 * coarse + 1e-11,
                    "{e}: derivative {i}: {coarse:e} -> {fine:e}"
                );
            }
        }
        assert_relative_eq!(errors[0][0], (w * 0.08).powi(2) / 12.0, max_relative = 0.05);
    }
}

/// A held input and lines are not approximated at all.
#[test]
fn exact_for_what_the_hold_says() {
    let step = 0.9;
    let mut held = StateVariableFilter::with_bandwidth(2, 1.0, Hold::Zero).unwrap();
    held.update(1.0, 0.0).unwrap();
    for k in 1..12 {
        let t: f64 = f64::from(k) * step;
        let found = held.update(1.0, step).unwrap();
        let e = (-t).exp();
        for (found, expected) in found
            .iter()
            .zip([1.0 - e * (1.0 + t), t * e, (1.0 - t) * e])
        {
            assert_relative_eq!(*found, expected, epsilon = 2e-15);
        }
    }
}

#[test]
fn at_rest_from_the_first_sample() {
    let mut filter = StateVariableFilter::with_bandwidth(3, 2.0, Hold::First)
        .unwrap()
        .starting(Start::Rest);
    for _ in 0..5 {
        let found = filter.update(7.0, 0.3).unwrap();
        assert_relative_eq!(found[0], 7.0, max_relative = 1e-14);
        assert!(found[1..].iter().all(|d| d.abs() < 1e-12));
    }
    filter.reset();
    assert_eq!(filter.derivatives(), [0.0; 4]);
    assert_eq!(filter.update(-2.0, 0.3).unwrap()[0], -2.0);
}

#[test]
fn what_is_no_filter_is_refused() {
    let unstable = Polynomial::new([-1.0, 1.0]).unwrap();
    let refused = StateVariableFilter::new(&unstable, Hold::Zero).unwrap_err();
    assert!(
        matches!(refused, Error::NotHurwitz { real_part, .. } if real_part == 1.0),
        "{refused}"
    );
    assert!(StateVariableFilter::new(&Polynomial::one(), Hold::Zero).is_err());
    assert!(StateVariableFilter::new(&Polynomial::zero(), Hold::Zero).is_err());
    for lambda in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(StateVariableFilter::with_bandwidth(2, lambda, Hold::Zero).is_err());
    }
    assert!(StateVariableFilter::with_bandwidth(0, 1.0, Hold::Zero).is_err());
    assert!(StateVariableFilter::with_bandwidth(20, 1e40, Hold::Zero).is_err());
}

/// Least squares for `y = -a1 y' - .. - an y^(n) + b0 u + .. + bm u^(m)` by Gaussian elimination of the normal
/// equations: what the filters give is good enough for the plainest solver.
fn least_squares(rows: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let n = rows[0].0.len();
    let scale: Vec<f64> = (0..n)
        .map(|i| {
            rows.iter()
                .map(|(phi, _)| phi[i] * phi[i])
                .sum::<f64>()
                .sqrt()
        })
        .collect();
    let mut m = vec![vec![0.0; n + 1]; n];
    for (phi, y) in rows {
        for i in 0..n {
            for j in 0..n {
                m[i][j] += phi[i] / scale[i] * phi[j] / scale[j];
            }
            m[i][n] += phi[i] / scale[i] * y;
        }
    }
    for k in 0..n {
        let pivot = m[k].clone();
        for row in m
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| *i != k)
            .map(|(_, row)| row)
        {
            let factor = row[k] / pivot[k];
            for (entry, pivot) in row.iter_mut().zip(&pivot) {
                *entry -= factor * pivot;
            }
        }
    }
    (0..n).map(|k| m[k][n] / m[k][k] / scale[k]).collect()
}

/// The systems that are recovered: (a, b), a[0] = 1, and a bandwidth for the filter.
fn systems() -> [(Vec<f64>, Vec<f64>, f64); 3] {
    [
        (vec![1.0, 10.0], vec![6.0], 0.4),
        (vec![1.0, 3.0, 4.0], vec![2.0, -1.5], 1.5),
        (vec![1.0, 6.0, 8.0, 5.0], vec![3.0, 2.0, 1.0], 1.5),
    ]
}

/// A held input that changes at random every second.
fn input(t: f64) -> f64 {
    let k = (t + 1e-9).floor();
    if (12.9898 * k * k).sin() + 0.3 * (k / 9.0).sin() > 0.0 {
        1.0
    } else {
        -1.0
    }
}

/// Largest relative error of a parameter, for these holds of the two filters, and for an output between the samples.
fn worst_error(step: f64, hold_u: Hold, hold_y: Hold) -> [f64; 3] {
    systems().map(|(a, b, lambda)| {
        let n = a.len() - 1;
        let g = TransferFunction::from_coefficients(&b, &a).unwrap();
        let mut plant = Simulator::new(StateSpace::controllable(&g).unwrap(), Hold::Zero);
        let mut filter_u = StateVariableFilter::with_bandwidth(n, lambda, hold_u).unwrap();
        let mut filter_y = StateVariableFilter::with_bandwidth(n, lambda, hold_y).unwrap();
        let mut rows = Vec::new();
        for k in 0..(400.0 / step) as usize {
            let u = input(k as f64 * step);
            let y = plant.update(u, step).unwrap();
            let u = filter_u.update(u, step).unwrap();
            let y = filter_y.update(y, step).unwrap();
            let phi = y[1..]
                .iter()
                .map(|y| -y)
                .chain(u[..b.len()].iter().copied());
            rows.push((phi.collect(), y[0]));
        }
        let theta = least_squares(&rows);
        let expected = a[1..].iter().chain(&b);
        theta
            .iter()
            .zip(expected)
            .map(|(t, e)| (t / e - 1.0).abs())
            .fold(0.0, f64::max)
    })
}

/// Noise-free data give the parameters back, but for the line between samples of y, which falls with the square of the
/// step; the wrong hold for u shifts it by half a step, and errs by far more.
#[test]
fn parameters_come_back() {
    let right = [0.1, 0.05, 0.025].map(|step| worst_error(step, Hold::Zero, Hold::First));
    let shifted = [0.1, 0.05].map(|step| worst_error(step, Hold::First, Hold::First));
    let alike = worst_error(0.1, Hold::Zero, Hold::Zero);
    for n in 0..3 {
        println!(
            "order {}: {:.1e} {:.1e} {:.1e}; u on a line {:.1e} {:.1e}; y held {:.1e}",
            n + 1,
            right[0][n],
            right[1][n],
            right[2][n],
            shifted[0][n],
            shifted[1][n],
            alike[n]
        );
        assert!(right[0][n] < 5e-3, "{}", right[0][n]);
        assert!(right[1][n] < 0.27 * right[0][n] && right[2][n] < 0.27 * right[1][n]);
        assert!(shifted[0][n] > 5.0 * right[0][n] && shifted[1][n] > 5.0 * right[1][n]);
        assert!(alike[n] > 5.0 * right[0][n]);
    }
}

/// If the signals between samples are known, the regression is exact: y is filtered together with the plant, in continuous time.
#[test]
fn filtered_alike_the_regression_is_exact() {
    for (a, b, lambda) in systems() {
        let n = a.len() - 1;
        let e = Polynomial::new([lambda, 1.0]).unwrap().pow(n);
        let (a, b) = (Polynomial::new(a).unwrap(), Polynomial::new(b).unwrap());
        // p^i y_f = E(0) p^i B/(A E) u, i = 0 to n, exactly under the hold of u; the same for u_f.
        let filtered = |numerator: &Polynomial, denominator: &Polynomial| -> Vec<Simulator> {
            let of = |i: usize| {
                let g = TransferFunction::new(
                    &(&Polynomial::p().pow(i) * numerator) * e.coefficient(0),
                    denominator.clone(),
                );
                Simulator::new(StateSpace::controllable(&g.unwrap()).unwrap(), Hold::Zero)
            };
            (0..=n).map(of).collect()
        };
        let mut y = filtered(&b, &(&a * &e));
        let mut u = StateVariableFilter::new(&e, Hold::Zero).unwrap();
        let mut rows = Vec::new();
        for k in 0..400 {
            let step = if k % 3 == 0 { 0.5 } else { 0.25 };
            let input = input(f64::from(k) * 0.4);
            let y: Vec<f64> = y
                .iter_mut()
                .map(|y| y.update(input, step).unwrap())
                .collect();
            let u = u.update(input, step).unwrap();
            let terms = |p: &Polynomial, x: &[f64]| -> f64 {
                p.coefficients().iter().zip(x).map(|(p, x)| p * x).sum()
            };
            let size: f64 = y.iter().chain(u).map(|x| x.abs()).sum();
            assert!((terms(&a, &y) - terms(&b, u)).abs() < 1e-12 * (1.0 + size));
            let phi = y[1..]
                .iter()
                .map(|y| -y)
                .chain(u[..=b.degree().unwrap()].iter().copied());
            rows.push((phi.collect(), y[0]));
        }
        let expected: Vec<f64> = a.coefficients()[1..]
            .iter()
            .chain(b.coefficients())
            .copied()
            .collect();
        for (found, expected) in least_squares(&rows).iter().zip(expected) {
            assert_relative_eq!(*found, expected, max_relative = 1e-9);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// The filter is its transfer function, for any steps, and linear.
    #[test]
    fn is_its_transfer_function(order in 1..6_usize, lambda in 0.1..10.0_f64, samples in prop::collection::vec((-5.0..5.0_f64, 0.01..1.0_f64), 2..30)) {
        for hold in [Hold::Zero, Hold::First] {
            let mut filter = StateVariableFilter::with_bandwidth(order, lambda, hold).unwrap();
            let g = |i: usize| {
                let numerator = &Polynomial::p().pow(i) * filter.denominator().coefficient(0);
                let g = TransferFunction::new(numerator, filter.denominator().clone()).unwrap();
                Simulator::new(StateSpace::controllable(&g).unwrap(), hold)
            };
            let mut expected: Vec<Simulator> = (0..=order).map(g).collect();
            for &(x, step) in &samples {
                let found = filter.update(x, step).unwrap();
                for (i, (found, expected)) in found.iter().zip(&mut expected).enumerate() {
                    let expected = expected.update(x, step).unwrap();
                    let size = 5.0 * (2.0 * lambda).powi(i as i32);
                    prop_assert!((found - expected).abs() < 1e-11 * size, "{i}: {found} {expected}");
                }
            }
        }
    }
}

#[test]
fn a_restored_filter_goes_on_to_the_bit() {
    for (order, hold, start) in [
        (1, Hold::Zero, Start::Zero),
        (2, Hold::First, Start::Rest),
        (5, Hold::First, Start::Zero),
    ] {
        let filter = StateVariableFilter::with_bandwidth(order, 0.7, hold).unwrap();
        let mut filter = filter.starting(start);
        for k in 0..20 {
            let text = serde_json::to_string(&filter).unwrap();
            let mut restored: StateVariableFilter = serde_json::from_str(&text).unwrap();
            let (signal, step) = ((0.3 * f64::from(k)).sin(), [0.5, 0.8][k as usize % 2]);
            let expected = filter.update(signal, step).unwrap();
            assert_eq!(restored.update(signal, step).unwrap(), expected);
        }
        let mut value = serde_json::to_value(&filter).unwrap();
        value["denominator"][0] = (-1.0).into();
        assert!(serde_json::from_value::<StateVariableFilter>(value).is_err());
    }
}
