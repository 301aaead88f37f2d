//! Rows of filtered data, remark 3 of section 3: the true parameters obey them, and a low pass keeps a fast disturbance out.

use ct_constrained::{ConstrainedRls, Error, Filter, FilteredRow, Row};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};

const THETA: [f64; 2] = [2.0, -0.7];

/// The slow regressors, and a fast ripple that affects the first regressor and the output, but not through `theta`.
fn sample(t: f64, ripple: f64) -> Sample<2> {
    let fast = ripple * (25.0 * t).sin();
    let phi = [(0.3 * t).sin() + fast, (0.5 * t + 1.0).cos()];
    Sample::new(phi, THETA[0] * (phi[0] - fast) + THETA[1] * phi[1])
}

fn estimator() -> ConstrainedRls<2, 1> {
    let weights = Weights::least_squares(0.005).unwrap();
    let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 10.0, weights).unwrap();
    ConstrainedRls::new(rls, [Row::equal([0.0; 2], 0.0, 0.0).unwrap()]).unwrap()
}

/// The largest error of the estimates after 400 s, and the largest violation of a row by the true parameters.
fn run(row: Option<(Filter, f64)>, ripple: f64) -> (f64, f64) {
    let (mut constrained, dt) = (estimator(), 0.02);
    let mut filtered = row.map(|(filter, weight)| FilteredRow::new(filter, weight).unwrap());
    let (truth, mut missed) = (SVector::from(THETA), 0.0_f64);
    for k in 0..20_000 {
        let sample = sample(f64::from(k) * dt, ripple);
        if let Some(filtered) = &mut filtered {
            let row = filtered.update(&sample, dt).unwrap();
            missed = missed.max(row.violation(&truth).abs());
            constrained.set_row(0, row).unwrap();
        }
        assert!(constrained.update(&sample, dt).outcome.used());
    }
    ((constrained.theta() - truth).amax(), missed)
}

const LOW_PASS: Filter = Filter::LowPass { time: 1.0 };

#[test]
fn the_true_parameters_obey_the_rows() {
    for filter in [LOW_PASS, Filter::Integral] {
        let (error, missed) = run(Some((filter, 3.0)), 0.0);
        assert!(missed < 1e-12, "{filter:?}: {missed:e}");
        assert!(error < 1e-3, "{filter:?}: {error:e}");
    }
}

/// The ripple biases what the data alone say; a row of weight `w` leaves about `1/(1 + w |G|^2)` of the bias.
#[test]
fn a_low_pass_keeps_a_fast_disturbance_out() {
    let (alone, _) = run(None, 0.5);
    let (light, _) = run(Some((LOW_PASS, 1.0)), 0.5);
    let (heavy, _) = run(Some((LOW_PASS, 100.0)), 0.5);
    println!(
        "error of data alone {alone:.3}, with a row of weight 1 {light:.3}, of weight 100 {heavy:.4}"
    );
    assert!(alone > 0.3, "{alone}");
    assert!(light < 0.7 * alone, "{light}");
    assert!(heavy < 0.03 * alone, "{heavy}");
}

/// Both filters against their analytic step responses, for steps of any length.
#[test]
fn filters_are_exact_for_held_signals() {
    let mut low = FilteredRow::<1>::new(Filter::LowPass { time: 2.0 }, 1.0).unwrap();
    let mut integral = FilteredRow::<1>::new(Filter::Integral, 1.0).unwrap();
    let mut t = 0.0;
    for dt in [0.1, 3.0, 1e-6, 0.7, 40.0] {
        t += dt;
        let sample = Sample::new([3.0], -6.0);
        let row = low.update(&sample, dt).unwrap();
        let risen = 1.0 - (-t / 2.0_f64).exp();
        assert!((row.f()[0] - 3.0 * risen).abs() < 1e-14);
        assert!((row.chi() + 6.0 * risen).abs() < 1e-14);
        let row = integral.update(&sample, dt).unwrap();
        assert!((row.f()[0] - 3.0 * t).abs() < 1e-12 * t);
        assert!((row.chi() + 6.0 * t).abs() < 1e-12 * t);
        assert_eq!(row.weight(), 1.0);
    }
}

#[test]
fn bad_settings_and_samples_are_refused() {
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = FilteredRow::<1>::new(Filter::LowPass { time }, 1.0)
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(&format!("the time constant of the filter is {time} s")),
            "{message}"
        );
    }
    assert!(matches!(
        FilteredRow::<1>::new(Filter::Integral, -1.0),
        Err(Error::Weight { .. })
    ));
    let mut row = FilteredRow::<1>::new(LOW_PASS, 1.0).unwrap();
    row.update(&Sample::new([1.0], 1.0), 0.1).unwrap();
    let before = row;
    for (phi, y, dt) in [
        (f64::NAN, 1.0, 0.1),
        (1.0, f64::INFINITY, 0.1),
        (1.0, 1.0, 0.0),
        (1.0, 1.0, f64::NAN),
        (1e40, 1.0, 0.1),
    ] {
        assert!(row.update(&Sample::new([phi], y), dt).is_err());
        assert_eq!(row, before);
    }
}
