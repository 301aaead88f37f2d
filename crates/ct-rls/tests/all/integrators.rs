//! Euler's rule and that of Runge and Kutta: right for short steps, and at their limit an error instead of NaN.

use crate::support::{normals, rng};
use ct_rls::{
    ContinuousRls, Error, Euler, ExactHold, Integrator, Outcome, RecursiveEstimator, Rk4, Sample,
    Weights,
};
use nalgebra::{SMatrix, SVector};

fn estimator<I: Integrator>(p0: f64, weights: Weights) -> ContinuousRls<2, I> {
    ContinuousRls::with_integrator(SVector::zeros(), SMatrix::identity() * p0, weights).unwrap()
}

fn run<I: Integrator>(steps: u32, weights: Weights) -> (SVector<f64, 2>, SMatrix<f64, 2, 2>) {
    let mut rls = estimator::<I>(1.0, weights);
    let mut rng = rng(3);
    // ten intervals of 0.1 s, whatever the steps
    for _ in 0..10 {
        let sample = Sample {
            phi: normals(&mut rng),
            y: 1.0,
        };
        for _ in 0..steps {
            assert_eq!(
                rls.update(&sample, 0.1 / f64::from(steps)).outcome,
                Outcome::Updated
            );
        }
    }
    (*rls.theta(), rls.covariance())
}

#[test]
fn orders_of_the_rules() {
    let weights = Weights::new(1.0, 0.8, 0.1).unwrap();
    let exact = run::<ExactHold>(1, weights);
    let split = run::<ExactHold>(7, weights);
    assert!((exact.0 - split.0).norm() < 1e-14 && (exact.1 - split.1).norm() < 1e-14);
    let error = |(theta, p): (SVector<f64, 2>, SMatrix<f64, 2, 2>)| {
        (theta - exact.0).norm() + (p - exact.1).norm()
    };
    let euler = error(run::<Euler>(40, weights)) / error(run::<Euler>(80, weights));
    let rk4 = error(run::<Rk4>(4, weights)) / error(run::<Rk4>(8, weights));
    assert!((1.9..2.1).contains(&euler), "{euler}");
    assert!((14.0..18.0).contains(&rk4), "{rk4}");
}

#[test]
fn euler_stops_at_its_limit_and_says_so() {
    let weights = Weights::least_squares(0.1).unwrap();
    let sample = Sample::new([1.0, 0.5], 1.0);
    // gamma h phi'P phi = 0.5 * 1.25 p0 against 1 + eta h = 1.05
    let mut rls = estimator::<Euler>(1.67, weights);
    assert!(rls.update(&sample, 0.5).outcome.used());
    assert!(rls.health().unwrap().smallest_pivot > 0.0);

    let mut rls = estimator::<Euler>(1.69, weights);
    assert_eq!(rls.update(&sample, 0.5).outcome, Outcome::Stopped);
    assert_eq!(rls.update(&sample, 0.1).outcome, Outcome::Stopped);
    let Err(Error::EulerLimit { gain, limit, dt }) = rls.health() else {
        panic!("{:?}", rls.health());
    };
    assert!((gain - 0.5 * 1.25 * 1.69).abs() < 1e-12 && (limit - 1.05).abs() < 1e-12 && dt == 0.5);
    assert_eq!(*rls.theta(), SVector::<f64, 2>::zeros());
    assert!(rls.covariance().iter().all(|x| x.is_finite()));

    rls.reset_covariance(&SMatrix::identity()).unwrap();
    assert!(rls.update(&sample, 0.5).outcome.used());
    assert!(rls.health().is_ok());
}

/// The grid of P(0) and steps on which the exact step never fails; Euler's rule fails exactly beyond its limit.
#[test]
fn the_exact_step_holds_where_the_rules_fail() {
    let weights = Weights::least_squares(0.02).unwrap();
    let (mut euler, mut rk4, mut cells) = (0, 0, 0);
    for p0 in [1e-3, 1e-1, 1e1, 1e3, 1e5, 1e8] {
        for dt in [1e-3, 1e-2, 0.1, 1.0, 10.0] {
            cells += 1;
            let sample = Sample::new([1.0, 0.0], 1.0);
            let mut exact = estimator::<ExactHold>(p0, weights);
            for _ in 0..100 {
                assert!(exact.update(&sample, dt).outcome.used());
            }
            let health = exact.health().unwrap();
            assert!(health.smallest_pivot > 0.0 && exact.theta()[0].is_finite());

            let mut rule = estimator::<Euler>(p0, weights);
            let holds = rule.update(&sample, dt).outcome.used();
            assert_eq!(holds, dt * p0 < 1.0 + 0.02 * dt);
            euler += u32::from(holds);
            let mut rule = estimator::<Rk4>(p0, weights);
            rk4 += u32::from(rule.update(&sample, dt).outcome.used());
        }
    }
    println!("of {cells} cells Euler's rule holds in {euler}, Runge-Kutta in {rk4}");
    assert!(euler <= 16 && rk4 >= euler && rk4 < 24);
}
