//! Priors: one more row, whose weight is known.

use approx::assert_relative_eq;
use estimation::{
    Noise, Prior, Residuals, Sample, Start, Stopping, coloured, fit_from, linearise, robust,
    squares,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const STOPPING: Stopping = Stopping {
    evaluations: 60,
    cost: 1e-12,
};

/// `y_o = exp(x_0) s_o(t) + x_1 + x_2 z(t)` at each output, `z` of a column that may be zero.
struct Curves {
    y: Vec<Vec<f64>>,
    samples: Vec<usize>,
    priors: Vec<Prior>,
    third: f64,
}

impl Curves {
    fn row(&self, x: &[f64], output: usize, k: usize) -> [f64; 4] {
        let t = k as f64 / 10.0;
        let grows = x[0].exp() * (0.05 * t * (1.0 + output as f64)).sin();
        let third = self.third * (0.9 * t).cos();
        let y = grows + x[1] + x[2] * third;
        [grows, 1.0, third, self.y[output][k] - y]
    }
}

impl Residuals for Curves {
    fn free(&self) -> &[usize] {
        &[0, 1, 2]
    }
    fn bounds(&self) -> &[(f64, f64)] {
        &[(-50.0, 50.0); 3]
    }
    fn samples(&self) -> &[usize] {
        &self.samples
    }
    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        for (output, y) in self.y.iter().enumerate() {
            for k in 0..y.len() {
                let sample = Sample {
                    output,
                    first: k == 0,
                    missing: false,
                };
                each(sample, &mut self.row(x, output, k)).then_some(())?;
            }
        }
        Some(())
    }
    fn priors(&self) -> &[Prior] {
        &self.priors
    }
}

const TRUTH: [f64; 3] = [0.4, -1.0, 0.3];

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Outputs with noise of standard deviations 0.3, 0.06 .. and this correlation from sample to sample; priors of two entries, one of which
/// is as good as the record, read with their own errors.
fn drawn(seed: u64, outputs: usize, correlation: f64, third: f64) -> Curves {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut curves = Curves {
        y: vec![vec![0.0; 120]; outputs],
        samples: vec![120; outputs],
        priors: Vec::new(),
        third,
    };
    for output in 0..outputs {
        let mut noise = normal(&mut rng) / (1.0 - correlation * correlation).sqrt();
        let y = (0..120).map(|k| {
            let model = -curves.row(&TRUTH, output, k)[3];
            noise = correlation * noise + normal(&mut rng);
            model + 0.3 * 0.2_f64.powi(output as i32) * noise
        });
        let y = y.collect();
        curves.y[output] = y;
    }
    for (entry, std_error) in [(0, 0.15), (2, 0.05)] {
        curves.priors.push(Prior {
            entry,
            value: TRUTH[entry] + std_error * normal(&mut rng),
            std_error,
        });
    }
    curves
}

fn white(curves: &Curves) -> Noise {
    Noise::white(curves.y.len())
}

fn start() -> Vec<Start> {
    vec![vec![0.0, 0.0, 0.0].into()]
}

#[test]
fn the_cost_is_that_of_the_likelihood_and_the_rows_are_its_slope() {
    for outputs in [1, 2] {
        let curves = drawn(3, outputs, 0.0, 1.0);
        let noise = white(&curves);
        let x = [0.2, -0.8, 0.4];
        let sums = squares(&curves, &x, &noise).unwrap();
        let n = 120.0 * outputs as f64;
        let priors: f64 = curves.priors.iter().map(|p| p.residual(&x).powi(2)).sum();
        let likelihood: f64 = sums.sums.iter().map(|sum| 120.0 * (sum / 120.0).ln()).sum();
        assert_relative_eq!(
            n * (sums.cost() / n).ln(),
            likelihood + priors,
            max_relative = 1e-12
        );
        let triangle = linearise(&curves, &x, &noise).unwrap();
        assert_relative_eq!(triangle.cost(), sums.cost(), max_relative = 1e-12);
        for column in 0..3 {
            let cost = |by: f64| {
                let mut moved = x;
                moved[column] += by;
                squares(&curves, &moved, &noise).unwrap().cost()
            };
            let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
            let factor = (priors / n).exp();
            let of_rows = -2.0 * factor * triangle.descent(column);
            assert_relative_eq!(of_rows, slope, max_relative = 1e-6);
        }
    }
}

#[test]
fn an_entry_that_no_sample_shows_is_as_its_prior_says() {
    for outputs in [1, 2] {
        let curves = drawn(5, outputs, 0.0, 0.0);
        let fit = fit_from(&curves, start(), &white(&curves), STOPPING).unwrap();
        let prior = curves.priors[1];
        assert_relative_eq!(fit.x[2], prior.value, max_relative = 1e-6);
        let error = fit.std_errors()[2].unwrap();
        assert_relative_eq!(error, prior.std_error, max_relative = 1e-9);
        let errors = robust(&curves, &fit, 3).unwrap().std_errors;
        assert_relative_eq!(errors[2].unwrap(), prior.std_error, max_relative = 1e-9);
        let fit = coloured(&curves, fit, 3, STOPPING).unwrap();
        assert_relative_eq!(
            fit.std_errors()[2].unwrap(),
            prior.std_error,
            max_relative = 1e-9
        );
        // Without a prior it has no standard error.
        let without = Curves {
            priors: Vec::new(),
            ..drawn(5, outputs, 0.0, 0.0)
        };
        let fit = fit_from(&without, start(), &white(&without), STOPPING).unwrap();
        assert!(fit.std_errors()[2].is_none());
    }
}

#[test]
fn a_start_far_from_a_prior_ends_where_a_near_one_does() {
    let mut curves = drawn(7, 1, 0.0, 1.0);
    curves.priors[1].std_error = 1e-4;
    let noise = white(&curves);
    let near = fit_from(&curves, start(), &noise, STOPPING).unwrap();
    let far = fit_from(
        &curves,
        vec![vec![1.0, 5.0, -30.0].into()],
        &noise,
        STOPPING,
    )
    .unwrap();
    assert_relative_eq!(near.cost, far.cost, max_relative = 1e-6);
    assert!((near.x[2] - curves.priors[1].value).abs() < 1e-3);
}

/// Intervals of 95 % contain the true value in 95 % of the draws of noise and priors, with both weightings, and priors make them shorter.
#[test]
fn intervals_hold_the_truth() {
    const RUNS: u64 = 400;
    for (outputs, correlation) in [(1, 0.0), (1, 0.7), (2, 0.7)] {
        let (mut gls, mut sandwich, mut shorter) = ([0; 3], [0; 3], 0.0);
        for seed in 0..RUNS {
            let curves = drawn(1000 + seed, outputs, correlation, 1.0);
            let noise = white(&curves);
            let fit = fit_from(&curves, start(), &noise, STOPPING).unwrap();
            let errors = robust(&curves, &fit, 3).unwrap();
            let holds = |x: &[f64], widths: &[Option<f64>], count: &mut [u32; 3]| {
                for i in 0..3 {
                    count[i] += u32::from((x[i] - TRUTH[i]).abs() <= widths[i].unwrap());
                }
            };
            holds(&fit.x, &errors.half_widths(0.95), &mut sandwich);
            let coloured_fit = coloured(&curves, fit, 3, STOPPING).unwrap();
            holds(&coloured_fit.x, &coloured_fit.half_widths(0.95), &mut gls);
            let without = Curves {
                priors: Vec::new(),
                ..drawn(1000 + seed, outputs, correlation, 1.0)
            };
            let fit = fit_from(&without, start(), &noise, STOPPING).unwrap();
            let fit = coloured(&without, fit, 3, STOPPING).unwrap();
            shorter += coloured_fit.std_errors()[0].unwrap() / fit.std_errors()[0].unwrap();
        }
        let percent = |held: u32| 100.0 * f64::from(held) / RUNS as f64;
        println!(
            "{outputs} outputs, correlation {correlation}: gls {:.1?} %, sandwich {:.1?} %, widths {:.2} of those without",
            gls.map(percent),
            sandwich.map(percent),
            shorter / RUNS as f64
        );
        for held in gls.into_iter().chain(sandwich) {
            // Three standard deviations of a count of 400 are 3.3 %.
            assert!((percent(held) - 95.0).abs() < 3.3, "{}", percent(held));
        }
        assert!(shorter / (RUNS as f64) < 0.98);
    }
}

/// An incomplete model may end far from a prior: a continued fit starts at this end, and not near the prior.
#[test]
fn a_fit_goes_on_where_another_ended_far_from_a_prior() {
    let mut curves = drawn(5, 1, 0.0, 1.0);
    let prior = Prior {
        entry: 1,
        value: 5.0,
        std_error: 0.5,
    };
    curves.priors = vec![prior];
    let white = white(&curves);
    let ended = fit_from(&curves, vec![Start::from(TRUTH.to_vec())], &white, STOPPING).unwrap();
    assert!((ended.x[1] - 5.0).abs() > 10.0 * 0.5, "{:?}", ended.x);
    let stopping = Stopping {
        evaluations: 1,
        ..STOPPING
    };
    let again = fit_from(
        &curves,
        vec![Start::from(ended.x.clone())],
        &white,
        stopping,
    );
    assert_eq!(again.unwrap().x, ended.x);
    // A start with a higher cost than a point near the prior begins near the prior.
    let mut far = ended.x.clone();
    far[1] = -40.0;
    let near = fit_from(&curves, vec![Start::from(far)], &white, stopping).unwrap();
    assert!((near.x[1] - 5.0).abs() < 5.001 * 0.5, "{:?}", near.x);
}
