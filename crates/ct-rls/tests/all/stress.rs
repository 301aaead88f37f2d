//! Ten million updates that forget as with 0.98 a step, with excitation that goes away and comes back, and nearly collinear
//! regressors; and what the textbook's update does on the same data.

use crate::support::textbook::{Form, Textbook};
use crate::support::{normal, normals, rng};
use ct_rls::{ContinuousRls, Guards, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector, vector};
use rand_chacha::ChaCha8Rng;

const DT: f64 = 0.1;
const LAMBDA: f64 = 0.98;

fn estimator<const P: usize>() -> ContinuousRls<P> {
    let weights = Weights::from_forgetting_factor(LAMBDA, DT).unwrap();
    ContinuousRls::new(SVector::zeros(), SMatrix::identity() * 1e3, weights).unwrap()
}

/// Regressors of each phase: ratio of the other entries to the first.
fn regressor<const P: usize>(rng: &mut ChaCha8Rng, collinear: f64) -> SVector<f64, P> {
    let phi: SVector<f64, P> = normals(rng);
    let apart = collinear.min(1.0);
    SVector::from_fn(|i, _| match i {
        0 => phi[0],
        _ => phi[0] * (1.0 - apart) + collinear * phi[i],
    })
}

#[test]
fn ten_million_updates() {
    let theta = vector![2.0, -0.5];
    let mut rls = estimator::<2>();
    let mut textbook = Textbook::<2>::new(Form::Outer, 1e3, LAMBDA);
    let mut rng = rng(1);
    let mut textbook_died = None;
    let mut count = 0_u64;
    let healthy = |rls: &ContinuousRls<2>, at: u64| {
        let health = rls.health().unwrap();
        assert!(
            health.smallest_pivot > 0.0 && health.trace.is_finite() && health.excitation > 0.0,
            "{at}: {health:?}"
        );
        let p = rls.covariance();
        assert_eq!(p, p.transpose(), "{at}");
        assert!(rls.theta().iter().all(|x| x.is_finite()), "{at}");
    };
    // (samples, size of the regressor, distance from collinearity): the squared condition number is 1e14 at a distance of 1e-7
    let phases = [
        (400_000_u64, 1.0, 1.0),
        (100_000, 0.0, 1.0),
        (400_000, 1.0, 1.0),
        (100_000, 1e-9, 1.0),
        (400_000, 1.0, 1.0),
        (500_000, 1.0, 1e-7),
        (100_000, 1.0, 1.0),
    ];
    while count < 10_000_000 {
        for (samples, size, collinear) in phases {
            for _ in 0..samples {
                let phi = regressor(&mut rng, collinear) * size;
                let y = theta.dot(&phi) + 1e-3 * size * normal(&mut rng);
                let innovation = rls.update(&Sample { phi, y }, DT);
                assert!(innovation.outcome.used());
                count += 1;
                if textbook_died.is_none() {
                    textbook.update(&phi, y);
                    if !textbook.positive_definite() {
                        textbook_died = Some(count);
                    }
                }
                if count.is_multiple_of(10_007) {
                    healthy(&rls, count);
                }
            }
            healthy(&rls, count);
            if size == 1.0 && collinear == 1.0 {
                let off = (rls.theta() - theta).norm();
                // about 1e-3 sqrt(2 * 0.01): the noise over the memory
                assert!(off < 2e-3, "{count}: {off}");
            }
        }
    }
    let died = textbook_died.expect("the textbook's update should not survive");
    println!("the textbook's update lost definiteness after {died} of {count} updates");
    assert!(died < 5_000, "{died}");
}

/// Nearly collinear from the start, without noise and without a cap on `P`: its condition number becomes that of the
/// regressors, squared, 1e14 and 1e18.
#[test]
fn nearly_collinear_from_the_start() {
    fn check<const P: usize>(apart: f64, condition: f64) {
        let mut rng = rng(2);
        let theta: SVector<f64, P> = normals(&mut rng);
        let guards = Guards {
            trace_limit: f64::INFINITY,
            silent_below: 0.0,
        };
        let mut rls = estimator::<P>().with_guards(guards).unwrap();
        let mut learn = |rls: &mut ContinuousRls<P>, apart: f64, samples: u32| {
            for _ in 0..samples {
                let phi = regressor::<P>(&mut rng, apart);
                let y = theta.dot(&phi);
                assert!(rls.update(&Sample { phi, y }, DT).outcome.used());
            }
        };
        learn(&mut rls, apart, 100_000);
        let health = rls.health().unwrap();
        assert!(health.smallest_pivot > 0.0 && health.trace.is_finite());
        // the smallest eigenvalue of P is below its smallest pivot
        let reached = health.trace / (P as f64 * health.smallest_pivot);
        assert!(reached > condition, "{P} {apart:e}: {reached:e}");
        // the sum is known, the differences are nearly unknown
        assert!((rls.theta().sum() - theta.sum()).abs() < 1e-6);
        learn(&mut rls, 1.0, 5_000);
        let off = (rls.theta() - theta).norm();
        assert!(off < 1e-9, "{P} {apart:e}: {off:e}");
        assert!(rls.health().unwrap().smallest_pivot > 0.0);
    }
    for (apart, condition) in [(1e-7, 1e13), (1e-9, 1e17)] {
        check::<2>(apart, condition);
        check::<4>(apart, condition);
        check::<8>(apart, condition);
    }
}

/// Failure that a short test does not show: unit Gaussian regressors, no noise, well-conditioned data.
#[test]
fn the_textbook_dies_on_healthy_data() {
    fn died<const P: usize>(seed: u64) -> u32 {
        let mut rng = rng(seed);
        let mut textbook = Textbook::<P>::new(Form::Outer, 1e3, LAMBDA);
        let mut rls = estimator::<P>();
        let theta: SVector<f64, P> = normals(&mut rng);
        for k in 1..100_000 {
            let phi: SVector<f64, P> = normals(&mut rng);
            let y = theta.dot(&phi);
            textbook.update(&phi, y);
            rls.update(&Sample { phi, y }, DT);
            if !textbook.positive_definite() {
                assert!((rls.theta() - theta).norm() < 1e-9);
                return k;
            }
        }
        u32::MAX
    }
    for seed in 0..5 {
        for k in [died::<2>(seed), died::<5>(seed)] {
            // 30/(1 - 0.98) = 1500
            assert!((1000..2500).contains(&k), "{k}");
        }
    }
}
