//! Noise, excitations and records made in code.

use std::collections::HashSet;

use approx::assert_relative_eq;
use ct_signals::{Channel, Error, Record, excitation, noise};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

fn mean_product(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>() / x.len().min(y.len()) as f64
}

#[test]
fn white_noise_has_its_moments() {
    let n = 200_000;
    let v = noise::white(n, 0.3, &mut rng(1));
    // Within four standard errors.
    let n = n as f64;
    assert!(mean(&v).abs() < 4.0 * 0.3 / n.sqrt());
    let std = mean_product(&v, &v).sqrt();
    assert!((std - 0.3).abs() < 4.0 * 0.3 / (2.0 * n).sqrt());
    assert!(mean_product(&v, &v[1..]).abs() < 4.0 * 0.09 / n.sqrt());
}

#[test]
fn coloured_noise_has_its_moments() {
    for rho in [-0.6, 0.0, 0.9] {
        let v = noise::ar1(400_000, 2.0, rho, &mut rng(2));
        let variance = mean_product(&v, &v);
        assert_relative_eq!(variance, 4.0, max_relative = 0.05);
        for lag in 1..4 {
            let correlation = mean_product(&v, &v[lag..]) / variance;
            assert!(
                (correlation - rho.powi(lag as i32)).abs() < 0.02,
                "lag {lag}"
            );
        }
    }
}

#[test]
fn coloured_noise_is_stationary_from_the_first_sample() {
    let mut rng = rng(3);
    let first: Vec<f64> = (0..20_000)
        .map(|_| noise::ar1(1, 2.0, 0.99, &mut rng)[0])
        .collect();
    assert_relative_eq!(mean_product(&first, &first), 4.0, max_relative = 0.04);
}

#[test]
fn noise_depends_on_nothing_but_the_seed() {
    assert_eq!(
        noise::ar1(9, 1.0, 0.5, &mut rng(4)),
        noise::ar1(9, 1.0, 0.5, &mut rng(4))
    );
    assert_ne!(
        noise::white(9, 1.0, &mut rng(4)),
        noise::white(9, 1.0, &mut rng(5))
    );
}

#[test]
fn impossible_noise_is_not_a_number() {
    assert!(noise::white(3, f64::NAN, &mut rng(1))[0].is_nan());
    for rho in [1.0, -1.0, 2.0, f64::NAN] {
        assert!(
            noise::ar1(3, 1.0, rho, &mut rng(1))
                .iter()
                .all(|v| v.is_nan())
        );
    }
}

#[test]
fn steps_stay_in_range_and_hold() {
    let u = excitation::steps(5000, 7..=12, 2.0, 5.0, &mut rng(6)).unwrap();
    assert_eq!(u.len(), 5000);
    assert!(u.iter().all(|u| (2.0..=5.0).contains(u)));
    let mut holds: Vec<usize> = u.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
    holds.pop(); // cut off by the record's end
    assert!(holds.iter().all(|hold| (7..=12).contains(hold)));
    let seen: HashSet<usize> = holds.into_iter().collect();
    assert_eq!(seen.len(), 6, "every hold occurs");
}

#[test]
fn steps_of_no_length_still_end() {
    assert_eq!(
        excitation::steps(10, 0..=0, 0.0, 1.0, &mut rng(6))
            .unwrap()
            .len(),
        10
    );
    assert_eq!(
        excitation::steps(0, 1..5, 0.0, 1.0, &mut rng(6))
            .unwrap()
            .len(),
        0
    );
}

#[test]
fn binary_sequences_are_of_maximal_length() {
    for length in 2..=20 {
        let period = (1usize << length) - 1;
        let u = excitation::prbs(2 * period, 1, -1.0, 1.0, length).unwrap();
        assert_eq!(u[..period], u[period..], "register {length}: not periodic");
        // The two-valued autocorrelation: sum 1 and, at every lag, -1; checked at some lags.
        assert_eq!(u[..period].iter().sum::<f64>(), 1.0, "register {length}");
        for lag in [1, 2, period / 3, period / 2]
            .into_iter()
            .filter(|lag| *lag > 0)
        {
            let sum: f64 = (0..period).map(|k| u[k] * u[k + lag]).sum();
            assert_eq!(sum, -1.0, "register {length}, lag {lag}");
        }
    }
}

#[test]
fn bits_are_held() {
    let fast = excitation::prbs(31, 1, 0.0, 2.0, 5).unwrap();
    let slow = excitation::prbs(31 * 4, 4, 0.0, 2.0, 5).unwrap();
    for (k, u) in slow.iter().enumerate() {
        assert_eq!(*u, fast[k / 4]);
    }
}

#[test]
fn given_levels_are_held_over_and_over() {
    let u = excitation::levels(11, 2, &[1.0, -1.0, 0.5]).unwrap();
    let expected = [1.0, 1.0, -1.0, -1.0, 0.5, 0.5, 1.0, 1.0, -1.0, -1.0, 0.5];
    assert_eq!(u, expected);
    assert!(excitation::levels(0, 1, &[1.0]).unwrap().is_empty());
    assert!(excitation::levels(5, 0, &[1.0]).is_err());
    assert!(excitation::levels(5, 1, &[]).is_err());
    assert!(excitation::levels(5, 1, &[f64::NAN]).is_err());
}

#[test]
fn multisine_has_its_lines_and_no_others() {
    let (n, dt) = (400, 0.5);
    let lines = [3, 7, 20, 41];
    let frequencies = lines.map(|line| f64::from(line) / (f64::from(n) * dt));
    let u = excitation::multisine(n as usize, dt, &frequencies, 1.0, 4.0).unwrap();
    assert!(u.iter().all(|u| (1.0..=4.0).contains(u)));
    let reach = u
        .iter()
        .fold(0.0_f64, |reach, u| reach.max((u - 2.5).abs()));
    assert_relative_eq!(reach, 1.5, max_relative = 1e-12);
    let amplitude = |line: i32| {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, u) in u.iter().enumerate() {
            let angle = std::f64::consts::TAU * f64::from(line) * k as f64 / f64::from(n);
            re += u * angle.cos();
            im += u * angle.sin();
        }
        2.0 * re.hypot(im) / f64::from(n)
    };
    let expected = amplitude(3);
    assert!(expected > 1.5 / 4.0);
    for line in 1..200 {
        let here = if lines.contains(&line) { expected } else { 0.0 };
        assert!((amplitude(line) - here).abs() < 1e-9, "line {line}");
    }
}

#[test]
fn invalid_excitations_are_refused() {
    let mut rng = rng(7);
    #[expect(clippy::reversed_empty_ranges)]
    let empty = excitation::steps(9, 5..=4, 0.0, 1.0, &mut rng);
    let refused = [
        empty,
        excitation::steps(9, 1..=4, 1.0, 1.0, &mut rng),
        excitation::steps(9, 1..=4, f64::NAN, 1.0, &mut rng),
        excitation::prbs(9, 0, 0.0, 1.0, 5),
        excitation::prbs(9, 1, 0.0, 1.0, 1),
        excitation::prbs(9, 1, 0.0, 1.0, 21),
        excitation::multisine(9, 1.0, &[0.5], 0.0, 1.0),
        excitation::multisine(9, 1.0, &[0.0], 0.0, 1.0),
        excitation::multisine(9, 0.0, &[0.1], 0.0, 1.0),
        excitation::multisine(9, 1.0, &[], 0.0, 1.0),
    ];
    for result in refused {
        assert!(
            matches!(result, Err(Error::InvalidSetting { .. })),
            "{result:?}"
        );
    }
}

fn record() -> Record {
    Record {
        name: "made".into(),
        time: vec![0.0, 1.0, 2.0, 3.5],
        inputs: vec![Channel::new("u", "V", vec![1.0, 2.0, 0.5, 1.0])],
        outputs: vec![Channel::new("y", "cm", vec![10.0, 12.0, 9.0, 9.5])],
        ..Record::default()
    }
}

#[test]
fn a_record_knows_its_size() {
    let record = record();
    assert_eq!(record.len(), 4);
    assert!(!record.is_empty());
    assert_eq!(record.sample_interval(), 1.0);
    assert_eq!(record.duration(), 3.5);
    assert_eq!(record.input_range(), (0.5, 2.0));
    assert_eq!(record.output_range(), (9.0, 12.0));
    record.validate().unwrap();
}

#[test]
fn an_empty_record_has_no_size() {
    let mut empty = record();
    for values in [
        &mut empty.time,
        &mut empty.inputs[0].values,
        &mut empty.outputs[0].values,
    ] {
        values.clear();
    }
    assert!(empty.is_empty());
    assert_eq!(empty.sample_interval(), 0.0);
    assert_eq!(empty.duration(), 0.0);
    assert!(empty.input_range().0.is_nan());
    empty.validate().unwrap();
}

#[test]
fn a_record_that_is_wrong_is_refused() {
    let mut short = record();
    short.outputs[0].values.pop();
    let error = short.validate().unwrap_err();
    assert!(matches!(
        error,
        Error::LengthMismatch {
            expected: 4,
            found: 3,
            ..
        }
    ));

    let mut hole = record();
    hole.inputs[0].values[2] = f64::INFINITY;
    let error = hole.validate().unwrap_err();
    assert!(matches!(error, Error::ValueNotFinite { index: 2, .. }));
    assert_eq!(
        error.to_string(),
        "made: u[2] is inf; every value has to be finite"
    );

    for time in [1.0, 0.5] {
        let mut twice = record();
        twice.time[2] = time;
        let error = twice.validate().unwrap_err();
        assert!(matches!(error, Error::TimeNotIncreasing { index: 2, .. }));
    }

    let mut reference = record();
    reference.references = vec![Channel::new("r", "cm", vec![1.0])];
    assert!(reference.validate().is_err());
}

#[test]
fn a_limited_slew_is_kept_and_the_sequence_followed() {
    let mut u = vec![0.0, 10.0, 10.0, 10.0, 0.0, 1.0, 1.0];
    excitation::limit_slew(&mut u, 4.0).unwrap();
    assert_eq!(u, [0.0, 4.0, 8.0, 10.0, 6.0, 2.0, 1.0]);
    let slow = u.clone();
    excitation::limit_slew(&mut u, 100.0).unwrap();
    assert_eq!(u, slow);
    for wrong in [0.0, -1.0, f64::NAN] {
        excitation::limit_slew(&mut u, wrong).unwrap_err();
    }
}
