//! A box that estimates are kept to: hard, by entry, or soft; around an estimator of any integrator.

use ct_constrained::{Bounds, Error, Keep, Row, project_box};
use ct_rls::{ContinuousRls, Euler, ExactHold, Integrator, RecursiveEstimator, Weights};
use nalgebra::{SVector, matrix};

/// Two correlated parameters; the first one is above 1.
fn outside<I: Integrator>() -> ContinuousRls<2, I> {
    let weights = Weights::least_squares(0.01).unwrap();
    let p = matrix![2.0, 1.0; 1.0, 3.0];
    ContinuousRls::with_integrator(SVector::from([1.5, 0.2]), p, weights).unwrap()
}

fn unit_box() -> Bounds<2> {
    Bounds::new([-1.0, f64::NEG_INFINITY], [1.0, f64::INFINITY]).unwrap()
}

fn projects<I: Integrator>() {
    let mut rls = outside::<I>();
    assert_eq!(unit_box().enforce(&mut rls, 0.1), Ok(true));
    // theta - P e_1 (0.5/P_11): the correlated one moves by half as much
    assert!((rls.theta() - SVector::from([1.0, -0.05])).amax() < 1e-12);
    let mut same = outside::<I>();
    project_box(&mut same, unit_box().lower(), unit_box().upper()).unwrap();
    assert_eq!(rls.theta(), same.theta());
    assert_eq!(unit_box().enforce(&mut rls, 0.1), Ok(false));
}

#[test]
fn a_projection_moves_what_is_correlated_whatever_the_integrator() {
    projects::<ExactHold>();
    projects::<Euler>();
}

#[test]
fn a_clamp_moves_nothing_else() {
    let mut rls = outside::<Euler>();
    let bounds = unit_box().kept_by(Keep::Clamp).unwrap();
    assert_eq!(bounds.enforce(&mut rls, 0.1), Ok(true));
    assert_eq!(rls.theta(), &SVector::from([1.0, 0.2]));
}

#[test]
fn a_penalty_relaxes_as_its_row_does() {
    let (weight, dt) = (3.0, 0.1);
    let bounds = unit_box().kept_by(Keep::Penalty { weight }).unwrap();
    let mut rls = outside::<ExactHold>();
    assert_eq!(bounds.enforce(&mut rls, dt), Ok(true));
    // theta_j += P_j1 (1 - theta_1)(1 - e^(-w P_11 h))/P_11
    let share = -(1.0 - f64::exp(-weight * 2.0 * dt)) * 0.5 / 2.0;
    let expected = SVector::from([1.5 + 2.0 * share, 0.2 + share]);
    assert!((rls.theta() - expected).amax() < 1e-14);
    let mut row = outside::<ExactHold>();
    Row::at_most([1.0, 0.0], 1.0, weight)
        .unwrap()
        .penalize(&mut row, dt);
    assert!((rls.theta() - row.theta()).amax() < 1e-14);
    // an infinite bound means no bound
    assert!(rls.theta()[1] > 0.0);
}

#[test]
fn inside_nothing_happens() {
    for keep in [Keep::Projection, Keep::Clamp, Keep::Penalty { weight: 1e3 }] {
        let wide = Bounds::new([-2.0; 2], [2.0; 2])
            .unwrap()
            .kept_by(keep)
            .unwrap();
        let mut rls = outside::<ExactHold>();
        let before = *rls.theta();
        assert_eq!(wide.enforce(&mut rls, 0.1), Ok(false));
        assert_eq!(rls.theta(), &before);
        assert!(wide.contains(&before) && !unit_box().contains(&before));
        assert_eq!(Bounds::none().enforce(&mut rls, 0.1), Ok(false));
    }
}

#[test]
fn bad_boxes_are_refused_with_their_numbers() {
    let error = Bounds::new([0.0, 2.0], [1.0, 1.0]).unwrap_err();
    assert_eq!(
        error,
        Error::Bounds {
            index: 1,
            lower: 2.0,
            upper: 1.0
        }
    );
    assert!(Bounds::new([f64::NAN], [1.0]).is_err());
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(unit_box().kept_by(Keep::Penalty { weight }).is_err());
    }
}

/// The estimate at a bound of 0 is no measure of its own rounding: it must not be chased down to the smallest numbers.
#[test]
fn a_bound_of_zero_is_kept_exactly() {
    let positive = Bounds::new([0.0; 3], [f64::INFINITY; 3]).unwrap();
    let weights = Weights::least_squares(0.01).unwrap();
    for k in 1..2000 {
        let k = f64::from(k);
        let theta = SVector::from([-1e-3 * k, 0.3 / k, (k * 0.7).sin()]);
        let r = 0.9 * (0.1 * k).sin();
        let p = matrix![1.0, r, 0.1; r, 1.0, 0.2 * r; 0.1, 0.2 * r, k];
        let mut rls = ContinuousRls::<3>::new(theta, p, weights).unwrap();
        assert_eq!(positive.enforce(&mut rls, 0.1), Ok(true));
        assert!(positive.contains(rls.theta()), "{}", rls.theta());
        assert_eq!(positive.enforce(&mut rls, 0.1), Ok(false));
    }
}
