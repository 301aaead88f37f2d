//! The variant for sizes known at run time gives the same numbers.

use crate::support::{normal, normals, rng, spd};
use ct_rls::{
    ContinuousRls, Directional, DynamicRls, DynamicSample, Error, ExactHold, FactoredIntegrator,
    Guards, Outcome, RandomWalk, RecursiveEstimator, Sample, Weights,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

#[test]
fn the_same_numbers_for_any_size() {
    same_numbers::<1>();
    same_numbers::<2>();
    same_numbers::<3>();
    same_numbers::<4>();
    same_numbers::<5>();
    same_numbers::<6>();
    same_numbers::<7>();
    same_numbers::<8>();
    same_numbers::<9>();
    same_numbers::<10>();
    same_numbers::<16>();
}

fn same_numbers<const P: usize>() {
    let q = SVector::<f64, P>::from_fn(|i, _| 0.1 * (i % 3) as f64);
    same::<P, ExactHold>(|rls| rls, |rls| rls);
    same::<P, Directional>(|rls| rls, |rls| rls);
    same::<P, RandomWalk>(
        |rls| rls.with_intensity(q).unwrap(),
        |rls| rls.with_intensity(q.as_slice()).unwrap(),
    );
}

fn same<const P: usize, I: FactoredIntegrator>(
    prepare: impl Fn(ContinuousRls<P, I>) -> ContinuousRls<P, I>,
    prepare_dynamic: impl Fn(DynamicRls<I>) -> DynamicRls<I>,
) {
    let mut rng = rng(8);
    let weights = Weights::new(1.0, 0.7, 0.05).unwrap();
    let p0: SMatrix<f64, P, P> = spd::<P>(&mut rng) * 1e4;
    let guards = Guards {
        trace_limit: 1e6,
        silent_below: 0.1,
    };
    let mut fixed = ContinuousRls::<P, I>::with_integrator(SVector::zeros(), p0, weights)
        .and_then(|rls| prepare(rls).with_guards(guards))
        .unwrap();
    let dynamic_p0 = DMatrix::from_column_slice(P, P, p0.as_slice());
    let mut dynamic = DynamicRls::<I>::with_integrator(DVector::zeros(P), &dynamic_p0, weights)
        .and_then(|rls| prepare_dynamic(rls).with_guards(guards))
        .unwrap();
    for k in 0..5000 {
        if k == 4000 {
            fixed.reset_covariance(&p0).unwrap();
            dynamic.reset_covariance(&dynamic_p0).unwrap();
        }
        let size = if (2000..3000).contains(&k) { 0.01 } else { 1.0 };
        let phi = normals::<P>(&mut rng) * size;
        let y = if k == 77 { f64::NAN } else { normal(&mut rng) };
        let a = fixed.update(&Sample { phi, y }, 0.5);
        let sample = DynamicSample {
            phi: DVector::from_column_slice(phi.as_slice()),
            y,
        };
        let b = dynamic.update(&sample, 0.5);
        assert_eq!(a.outcome, b.outcome);
    }
    // the same to the bit
    assert_eq!(fixed.theta().as_slice(), dynamic.theta().as_slice());
    assert_eq!(
        fixed.covariance().as_slice(),
        dynamic.covariance().as_slice()
    );
    let (a, b) = (fixed.health().unwrap(), dynamic.health().unwrap());
    assert_eq!((a.trace, a.excitation), (b.trace, b.excitation));
    assert_eq!(
        (a.used, a.unused, a.silent, a.capped),
        (b.used, b.unused, b.silent, b.capped)
    );
    assert!(a.silent > 900);
}

#[test]
fn sizes_that_do_not_fit() {
    let weights = Weights::least_squares(0.0).unwrap();
    let new = |n, r, c| DynamicRls::new(DVector::zeros(n), &DMatrix::identity(r, c), weights);
    assert!(matches!(
        new(3, 2, 3),
        Err(Error::Size {
            found: 2,
            expected: 3,
            ..
        })
    ));
    assert!(matches!(new(3, 3, 4), Err(Error::Size { found: 4, .. })));
    let mut rls = new(3, 3, 3).unwrap();
    assert_eq!(
        rls.update_with(&[1.0, 2.0], 1.0, 0.1, &weights).outcome,
        Outcome::BadSize
    );
    assert!(
        rls.update_with(&[1.0, 2.0, 3.0], 1.0, 0.1, &weights)
            .outcome
            .used()
    );
    assert!(matches!(
        rls.reset_covariance(&DMatrix::identity(2, 2)),
        Err(Error::Size { .. })
    ));
    assert!(rls.reset_covariance(&DMatrix::identity(3, 3)).is_ok());
    let walk = || {
        DynamicRls::<RandomWalk>::with_integrator(
            DVector::zeros(2),
            &DMatrix::identity(2, 2),
            weights,
        )
        .unwrap()
    };
    assert!(matches!(
        walk().with_intensity(&[1.0]),
        Err(Error::Size {
            found: 1,
            expected: 2,
            ..
        })
    ));
    assert!(matches!(
        walk().with_intensity(&[1.0, -1.0]),
        Err(Error::Intensity { index: 1, .. })
    ));
}

#[test]
fn estimates_can_be_replaced() {
    let weights = Weights::least_squares(0.1).unwrap();
    let mut rls = DynamicRls::new(DVector::zeros(2), &DMatrix::identity(2, 2), weights).unwrap();
    rls.update_with(&[1.0, 2.0], 1.0, 0.1, &weights);
    let p = rls.covariance();
    rls.set_theta(&[3.0, 4.0]).unwrap();
    assert_eq!(rls.theta().as_slice(), [3.0, 4.0]);
    assert_eq!(rls.covariance(), p);
    assert!(matches!(
        rls.set_theta(&[1.0]),
        Err(Error::Size {
            found: 1,
            expected: 2,
            ..
        })
    ));
    assert!(matches!(
        rls.set_theta(&[1.0, f64::NAN]),
        Err(Error::Theta { index: 1, .. })
    ));
    assert_eq!(rls.theta().as_slice(), [3.0, 4.0]);
}

/// A parameter with a random walk and without excitation is limited by the cap for sizes known at run time too.
#[test]
fn a_walk_grows_to_the_cap_and_no_further() {
    let weights = Weights::least_squares(0.0).unwrap();
    let guards = Guards {
        trace_limit: 5.0,
        silent_below: 0.0,
    };
    let mut rls = DynamicRls::<RandomWalk>::with_integrator(
        DVector::zeros(2),
        &DMatrix::identity(2, 2),
        weights,
    )
    .and_then(|rls| rls.with_intensity(&[0.2, 0.2])?.with_guards(guards))
    .unwrap();
    for _ in 0..100 {
        rls.update_with(&[1.0, 0.0], 1.0, 0.5, &weights);
        assert!(rls.covariance().trace() <= 5.0 * (1.0 + 1e-12));
    }
    // without the cap, 1 + 0.2 * 50 s
    assert!(rls.covariance()[(1, 1)] > 4.0);
    assert!(rls.health().unwrap().capped > 0);
}
