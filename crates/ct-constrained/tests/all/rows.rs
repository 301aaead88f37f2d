//! Equality rows and penalties: against the direct inverse, the closed form, an adaptive solver, and the Lyapunov function.

mod penalties;

use ct_constrained::{ConstrainedRls, Error, Row};
use ct_rls::{ContinuousRls, Outcome, RecursiveEstimator, Sample, Weights};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn normals<const P: usize>(rng: &mut ChaCha8Rng) -> SVector<f64, P> {
    SVector::from_fn(|_, _| normal(rng))
}

fn array<const P: usize>(rng: &mut ChaCha8Rng) -> [f64; P] {
    std::array::from_fn(|_| normal(rng))
}

fn dot<const P: usize>(f: &[f64; P], theta: &SVector<f64, P>) -> f64 {
    f.iter().zip(theta).map(|(f, x)| f * x).sum()
}

fn spd<const P: usize>(rng: &mut ChaCha8Rng) -> SMatrix<f64, P, P> {
    let a = SMatrix::<f64, P, P>::from_fn(|_, _| 0.5 * normal(rng));
    a * a.transpose() + SMatrix::identity() * 0.5
}

fn estimator<const P: usize>(rng: &mut ChaCha8Rng, p0: f64, c: f64, eta: f64) -> ContinuousRls<P> {
    let weights = Weights::new(c, c, eta).unwrap();
    ContinuousRls::new(normals(rng), spd::<P>(rng) * p0, weights).unwrap()
}

/// One step of all rows at once: `Q+ = e^{eta h} (Q - Q M' (M Q M' + (a W)^-1)^-1 M Q)` with the inverse from [U].
fn off_the_inverse<const P: usize, const R: usize>(seed: u64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (c, eta) = (normal(&mut rng).exp(), [0.0, 0.02, 0.3][seed as usize % 3]);
    let dt = 0.1 * normal(&mut rng).exp();
    let rls = estimator::<P>(&mut rng, 10.0, c, eta);
    let rows: [Row<P>; R] = std::array::from_fn(|_| {
        let weight = 3.0 * normal(&mut rng).exp();
        Row::equal(array(&mut rng), normal(&mut rng), weight).unwrap()
    });
    let sample = Sample {
        phi: normals::<P>(&mut rng),
        y: normal(&mut rng),
    };

    let growth = (eta * dt).exp();
    let a = if eta == 0.0 { dt } else { (growth - 1.0) / eta };
    let (mut m, mut z) = (
        vec![sample.phi.transpose()],
        DVector::from_element(1, sample.y),
    );
    let mut inverse_weights = DVector::from_element(1, 1.0 / (a * c));
    for row in &rows {
        m.push(row.f().transpose());
        z = z.push(row.chi());
        inverse_weights = inverse_weights.push(1.0 / (a * row.weight()));
    }
    let m = DMatrix::from_fn(R + 1, P, |i, j| m[i][j]);
    let q = DMatrix::from_column_slice(P, P, rls.covariance().as_slice());
    let start = DVector::from_column_slice(rls.theta().as_slice());
    let sum = &m * &q * m.transpose() + DMatrix::from_diagonal(&inverse_weights);
    let gain = &q * m.transpose() * sum.try_inverse().unwrap();
    let theta = &start + &gain * (z - &m * &start);
    let q = (&q - gain * m * &q) * growth;

    let mut constrained = ConstrainedRls::new(rls, rows).unwrap();
    assert_eq!(constrained.update(&sample, dt).outcome, Outcome::Updated);
    let theta_found = DVector::from_column_slice(constrained.theta().as_slice());
    let q_found = DMatrix::from_column_slice(P, P, constrained.covariance().as_slice());
    let off = (theta_found - &theta).amax() / theta.amax().max(1.0);
    off.max((q_found - &q).amax() / q.amax())
}

#[test]
fn rows_one_at_a_time_agree_with_the_matrix_inverse() {
    let mut worst = 0.0_f64;
    for seed in 0..300 {
        // also with more rows than parameters
        for off in [
            off_the_inverse::<1, 1>(seed),
            off_the_inverse::<2, 5>(seed),
            off_the_inverse::<3, 2>(seed),
            off_the_inverse::<5, 2>(seed),
            off_the_inverse::<8, 4>(seed),
        ] {
            worst = worst.max(off);
        }
    }
    assert!(worst < 1e-10, "{worst:e}");
    println!("largest difference from the direct inverse: {worst:.1e}");
}

/// The minimum of criterion (3.5) over many steps, with rows that vary in time.
#[test]
fn reaches_the_minimum_of_the_criterion() {
    const P: usize = 4;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (c, eta, dt) = (0.8, 0.05, 0.2);
    let rls = estimator::<P>(&mut rng, 10.0, c, eta);
    let mut information = rls.covariance().try_inverse().unwrap();
    let mut vector = information * rls.theta();
    let off_row = Row::equal([1.0; P], 9.0, 0.0).unwrap();
    let mut constrained = ConstrainedRls::new(rls, [off_row, off_row]).unwrap();
    for k in 0..500 {
        let row = Row::equal(array(&mut rng), normal(&mut rng), 5.0).unwrap();
        constrained.set_row(0, row).unwrap();
        let sample = Sample {
            phi: normals::<P>(&mut rng),
            y: normal(&mut rng),
        };
        constrained.update(&sample, dt);
        let (decay, b) = ((-eta * dt).exp(), (1.0 - (-eta * dt).exp()) / eta);
        information = information * decay
            + (sample.phi * sample.phi.transpose() * c + row.f() * row.f().transpose() * 5.0) * b;
        vector = vector * decay + (sample.phi * (c * sample.y) + row.f() * (5.0 * row.chi())) * b;
        let minimum = information.lu().solve(&vector).unwrap();
        let off = (minimum - constrained.theta()).amax() / minimum.amax();
        assert!(off < 1e-10, "{k}: {off:e}");
    }
    assert!(matches!(
        constrained.set_row(2, off_row),
        Err(Error::NoSuchRow { index: 2, rows: 2 })
    ));
}

#[test]
fn an_equality_row_makes_up_for_missing_excitation() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let rls = estimator::<2>(&mut rng, 10.0, 1.0, 0.05);
    let mut alone = rls.clone();
    let mut constrained =
        ConstrainedRls::new(rls, [Row::equal([1.0, -1.0], 0.5, 10.0).unwrap()]).unwrap();
    for _ in 0..2000 {
        let size = normal(&mut rng);
        let sample = Sample::new([size, size], 2.5 * size);
        alone.update(&sample, 0.2);
        constrained.update(&sample, 0.2);
    }
    assert!((constrained.theta() - SVector::from([1.5, 1.0])).amax() < 1e-9);
    assert!(constrained.violations()[0].abs() < 1e-9);
    assert!(constrained.health().unwrap().excitation > 1.0);
    assert!(alone.health().unwrap().excitation < 1e-3);
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let rls = estimator::<2>(&mut rng, 10.0, 1.0, 0.1);
    let rows = [
        Row::equal([1.0, 1.0], 3.0, 50.0).unwrap(),
        Row::at_least([1.0, 0.0], 10.0, 50.0).unwrap(),
    ];
    let mut constrained = ConstrainedRls::new(rls, rows).unwrap();
    let before = (*constrained.theta(), constrained.covariance());
    let numbers = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let samples = numbers.map(|x| [([x, 1.0], 1.0, 0.1), ([1.0, 1.0], x, 0.1)]);
    let steps = [([1.0, 1.0], 1.0, -1.0), ([1.0, 1.0], 1.0, f64::NAN)];
    for (phi, y, dt) in samples.into_iter().flatten().chain(steps) {
        let innovation = constrained.update(&Sample::new(phi, y), dt);
        assert!(innovation.accepted().is_err(), "{phi:?} {y} {dt}");
        let after = (*constrained.theta(), constrained.covariance());
        assert_eq!(after, before, "{phi:?} {y} {dt}");
    }
}

#[test]
fn rows_act_while_the_sensor_is_gone() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let rls = estimator::<2>(&mut rng, 10.0, 1.0, 0.1);
    let mut constrained =
        ConstrainedRls::new(rls, [Row::equal([1.0, 1.0], 3.0, 50.0).unwrap()]).unwrap();
    for _ in 0..200 {
        let innovation = constrained.update(&Sample::new([0.0, 0.0], 0.0), 0.1);
        assert_eq!(innovation.outcome, Outcome::Silent);
    }
    assert!(
        constrained.violations()[0].abs() < 1e-2,
        "{:?}",
        constrained.violations()
    );
}

/// A silent step forgets nothing, of the rows' information neither.
#[test]
fn a_row_counts_in_full_while_nothing_is_forgotten() {
    let (weight, dt) = (2.0, 0.5);
    let weights = Weights::least_squares(1.0).unwrap();
    let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
    let row = Row::equal([1.0, 0.0], 1.0, weight).unwrap();
    let mut constrained = ConstrainedRls::new(rls, [row]).unwrap();
    for k in 1..=10 {
        let innovation = constrained.update(&Sample::new([0.0, 0.0], 0.0), dt);
        assert_eq!(innovation.outcome, Outcome::Silent);
        let information = 1.0 + weight * dt * f64::from(k);
        let found = 1.0 / constrained.covariance()[(0, 0)];
        assert!((found / information - 1.0).abs() < 1e-12, "{k}: {found}");
    }
}

/// Every weight that [`Row`] accepts is enforced: no weight is so large that the row is left out.
#[test]
fn a_row_of_any_weight_is_enforced() {
    for weight in [1e3, 1e40, 1e70, f64::MAX] {
        let weights = Weights::least_squares(0.01).unwrap();
        let rls = ContinuousRls::<2>::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
        let rows = [
            Row::equal([1.0, 1.0], 3.0, weight).unwrap(),
            Row::at_most([1.0, 0.0], 0.5, weight).unwrap(),
        ];
        let mut constrained = ConstrainedRls::new(rls, rows).unwrap();
        for k in 0..100 {
            let u = if k % 2 == 0 { 1.0 } else { -1.0 };
            let sample = Sample::new([u, 1.0], u);
            constrained.update(&sample, 10.0).accepted().unwrap();
        }
        let theta = constrained.theta();
        assert!(
            (theta[0] + theta[1] - 3.0).abs() < 0.1,
            "{weight:e}: {theta}"
        );
        assert!(theta[0] < 0.55, "{weight:e}: {theta}");
        assert!(constrained.health().unwrap().excitation > 0.0);
    }
}

#[test]
fn bad_settings_are_refused_with_their_numbers() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    assert!(matches!(
        Row::<2>::equal([f64::NAN, 0.0], 1.0, 1.0),
        Err(Error::NotFinite { .. })
    ));
    assert!(matches!(
        Row::<2>::at_most([1.0, 0.0], f64::INFINITY, 1.0),
        Err(Error::NotFinite { .. })
    ));
    for (f, chi) in [([1e31, 1e31], 1.0), ([1.0, 0.0], -1e101)] {
        assert!(matches!(
            Row::<2>::equal(f, chi, 1.0),
            Err(Error::TooLarge { .. })
        ));
    }
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            Row::<2>::at_least([1.0, 0.0], 0.0, weight),
            Err(Error::Weight { .. })
        ));
    }
    let half = Weights::new(1.0, 0.5, 0.0).unwrap();
    let rls = ContinuousRls::<2>::new(SVector::zeros(), SMatrix::identity(), half).unwrap();
    let message = ConstrainedRls::new(rls, []).unwrap_err().to_string();
    assert!(message.contains("gamma is 0.5 with c = 1"), "{message}");
    let mut constrained = ConstrainedRls::new(estimator::<2>(&mut rng, 1.0, 1.0, 0.0), []).unwrap();
    assert!(
        constrained
            .update_with(&Sample::new([1.0, 1.0], 1.0), 0.1, &half)
            .is_err()
    );
}

/// The effect of a row in a step depends on the forgetting and length of that step, and not on earlier steps.
#[test]
fn a_row_counts_by_the_memory_and_the_length_of_its_own_step() {
    let (weight, f) = (2.0, [1.0, 0.0]);
    let row = Row::equal(f, 1.0, weight).unwrap();
    let start = Weights::least_squares(0.0).unwrap();
    let rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity(), start).unwrap();
    let mut constrained = ConstrainedRls::new(rls, [row]).unwrap();
    // the data contain no information about the row's parameter
    let sample = Sample::new([0.0, 1.0], 0.0);
    let mut information: f64 = 1.0;
    for (eta, dt) in [(0.5, 1.0), (2.0, 1.0), (2.0, 0.1), (2.0, 0.1), (0.1, 0.1)] {
        let weights = Weights::least_squares(eta).unwrap();
        constrained.update_with(&sample, dt, &weights).unwrap();
        let kept = (-eta * dt).exp();
        information = information * kept + weight * (1.0 - kept) / eta;
        let found = 1.0 / constrained.covariance()[(0, 0)];
        assert!((found / information - 1.0).abs() < 1e-12, "{eta} {dt}");
    }
}
