//! A fit is written as JSON and read again, and results cross threads.

use estimation::{
    Error, Fit, Noise, Residuals, Robust, Sample, Squares, Start, Stopping, Triangle, coloured,
    fit_from, fit_from_best, prewhitened,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// `y = x_0 sin(t) + x_1` at one output.
struct Curve(Vec<f64>);

impl Residuals for Curve {
    fn free(&self) -> &[usize] {
        &[0, 1]
    }
    fn bounds(&self) -> &[(f64, f64)] {
        &[(-10.0, 10.0), (0.0, 0.5)]
    }
    fn samples(&self) -> &[usize] {
        std::slice::from_ref(&200)
    }
    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        for (k, y) in self.0.iter().enumerate() {
            let s = (0.1 * k as f64).sin();
            let sample = Sample {
                output: 0,
                first: k == 0,
                missing: false,
            };
            each(sample, &mut [s, 1.0, y - x[0] * s - x[1]]).then_some(())?;
        }
        Some(())
    }
}

#[test]
fn a_fit_is_read_again() {
    let y =
        (0..200).map(|k| 3.0 * (0.1 * f64::from(k)).sin() + 0.2 * f64::from(k * 7919 % 13) / 13.0);
    let curve = Curve(y.collect());
    let stopping = Stopping {
        evaluations: 50,
        cost: 1e-12,
    };
    let white = fit_from(
        &curve,
        vec![vec![0.0, 0.1].into()],
        &Noise::white(1),
        stopping,
    )
    .unwrap();
    let fit = coloured(&curve, white.clone(), 3, stopping).unwrap();
    for fit in [white, fit] {
        let text = serde_json::to_string(&fit).unwrap();
        let again: Fit = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&again).unwrap(), text);
        assert_eq!(
            (&again.x, &again.noise, again.bic()),
            (&fit.x, &fit.noise, fit.bic())
        );
        assert_eq!(again.std_errors(), fit.std_errors());
    }
}

#[test]
fn white_noise_of_a_prewhitened_fit_has_the_size_of_the_residual() {
    // Residuals without memory, in two units: the scale of the noise model changes with the unit, and differs from that of the fit's
    // weighting.
    for unit in [1.0, 0.01] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let noise = StandardNormal.sample_iter(&mut rng);
        let y = noise.take(200).enumerate();
        let y = y.map(|(k, e): (usize, f64)| unit * ((0.1 * k as f64).sin() + 0.2 * e));
        let curve = Curve(y.collect());
        let stopping = Stopping {
            evaluations: 50,
            cost: 1e-12,
        };
        let start = vec![vec![0.0, 0.1].into()];
        let fit = fit_from(&curve, start, &Noise::white(1), stopping).unwrap();
        let own = prewhitened(&curve, fit, 3, Some(20.0), stopping).unwrap();
        assert_eq!(own.noise.order(), 0);
        let sigma = own.noise.iter().next().unwrap().sigma();
        assert!((sigma / (0.2 * unit) - 1.0).abs() < 0.15, "{sigma}");
    }
}

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Fit>();
    crosses::<Noise>();
    crosses::<Robust>();
    crosses::<Squares>();
    crosses::<Triangle>();
    crosses::<Error>();
};

/// `y = sin(x_0 t)`, whose cost has many local minima; and the number of evaluations.
struct Sine(Vec<f64>, std::sync::atomic::AtomicUsize);

impl Residuals for Sine {
    fn free(&self) -> &[usize] {
        &[0]
    }
    fn bounds(&self) -> &[(f64, f64)] {
        &[(0.01, 10.0)]
    }
    fn samples(&self) -> &[usize] {
        std::slice::from_ref(&400)
    }
    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.1.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        for (k, y) in self.0.iter().enumerate() {
            let t = 0.1 * k as f64;
            let sample = Sample {
                output: 0,
                first: k == 0,
                missing: false,
            };
            let (sin, cos) = (x[0] * t).sin_cos();
            each(sample, &mut [t * cos, y - sin]).then_some(())?;
        }
        Some(())
    }
}

#[test]
fn only_starts_near_the_best_continue() {
    let y: Vec<f64> = (0..400)
        .map(|k| (0.13 * f64::from(k)).sin() + 1e-3 * f64::from(k * 7919 % 13))
        .collect();
    let stopping = Stopping {
        evaluations: 120,
        cost: 1e-12,
    };
    let starts = || -> Vec<Start> {
        let all = (1..=40).map(|k| vec![0.1 * f64::from(k)].into());
        all.collect()
    };
    let of = |fit: fn(&Sine, Vec<Start>, &Noise, Stopping) -> Result<Fit, Error>| {
        let sine = Sine(y.clone(), 0.into());
        let fit = fit(&sine, starts(), &Noise::white(1), stopping).unwrap();
        (fit, sine.1.into_inner())
    };
    let (all, evaluations) = of(fit_from);
    let (best, fewer) = of(fit_from_best);
    assert!((best.x[0] - 1.3).abs() < 1e-3, "{:?}", best.x);
    assert!((best.x[0] - all.x[0]).abs() < 1e-9);
    // The starts that were given up count, and none of them agrees.
    assert_eq!((best.starts, best.agree), (40, all.agree));
    assert!(best.agree > 1 && best.agree < 10, "{}", best.agree);
    assert!(2 * fewer < evaluations, "{fewer} instead of {evaluations}");
}
