//! Projections: the nearest point in the metric of what is known, and errors where there is none.

use ct_constrained::{Error, Row, project, project_box};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, UdFactor, Weights};
use nalgebra::{SMatrix, SVector, matrix, vector};
use proptest::prelude::*;

fn estimator<const P: usize>(theta: SVector<f64, P>, p: SMatrix<f64, P, P>) -> ContinuousRls<P> {
    ContinuousRls::new(theta, p, Weights::least_squares(0.0).unwrap()).unwrap()
}

#[test]
fn a_correlated_parameter_moves_along() {
    let mut rls = estimator(vector![2.0, 0.0], matrix![1.0, 0.5; 0.5, 1.0]);
    let (lower, upper) = (vector![f64::NEG_INFINITY, -10.0], vector![1.0, 10.0]);
    assert!(project_box(&mut rls, &lower, &upper).unwrap());
    assert!((rls.theta() - vector![1.0, -0.5]).amax() < 1e-14);
    assert!(!project_box(&mut rls, &lower, &upper).unwrap());
    assert_eq!(rls.covariance(), matrix![1.0, 0.5; 0.5, 1.0]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The projection obeys the rows, and no other point of them is nearer; so the way to every point of the set gets shorter.
    #[test]
    fn nearest_point_of_a_set(
        theta in prop::array::uniform3(-3.0..3.0),
        root in prop::array::uniform9(-1.0..1.0),
        rows in prop::array::uniform4((prop::array::uniform3(-1.0..1.0), 0.0..1.0)),
        others in prop::array::uniform32(prop::array::uniform3(-1.0..1.0)),
    ) {
        let root = SMatrix::<f64, 3, 3>::from_column_slice(&root);
        let p = root * root.transpose() + SMatrix::identity() * 0.1;
        let start = SVector::from(theta);
        let mut rls = estimator(start, p);
        // the origin obeys all of them
        let rows = rows.map(|(f, chi)| Row::at_most(f, chi, 0.0).unwrap());
        let moved = project(&mut rls, &rows).unwrap();
        let nearest = *rls.theta();
        prop_assert_eq!(moved, rows.iter().any(|r| r.violation(&start) > 1e-12));
        let metric = UdFactor::new(&p).unwrap();
        let distance = metric.information_norm(&(nearest - start));
        for row in &rows {
            // the size of the terms is at most 1 + 3 * 3
            prop_assert!(row.violation(&nearest) < 1e-11);
        }
        for other in others.map(|x| SVector::from(x) * 2.0) {
            if rows.iter().all(|r| r.violation(&other) == 0.0) {
                prop_assert!(distance <= metric.information_norm(&(other - start)) * (1.0 + 1e-9) + 1e-12);
                prop_assert!(metric.information_norm(&(other - nearest)) <= metric.information_norm(&(other - start)) * (1.0 + 1e-9) + 1e-12);
            }
        }
    }
}

#[test]
fn rows_that_contradict_each_other() {
    let mut rls = estimator(vector![0.0, 0.0], SMatrix::identity());
    let rows = [
        Row::at_least([1.0, 1.0], 1.0, 1.0).unwrap(),
        Row::at_most([1.0, 1.0], -1.0, 1.0).unwrap(),
    ];
    let error = project(&mut rls, &rows).unwrap_err();
    assert!(
        matches!(error, Error::NoCommonPoint { violation, .. } if violation > 0.9),
        "{error}"
    );
    assert_eq!(*rls.theta(), vector![0.0, 0.0]);
    let never = [Row::equal([0.0, 0.0], 1.0, 1.0).unwrap()];
    assert!(matches!(
        project(&mut rls, &never),
        Err(Error::NoCommonPoint { .. })
    ));
    for (lower, upper) in [
        (1.0, 0.0),
        (f64::NAN, 1.0),
        (0.0, f64::NAN),
        (f64::INFINITY, f64::INFINITY),
    ] {
        let error = project_box(&mut rls, &vector![-1.0, lower], &vector![1.0, upper]).unwrap_err();
        assert!(matches!(error, Error::Bounds { index: 1, .. }), "{error}");
    }
}

#[test]
fn equalities_and_bounds_together() {
    let mut rls = estimator(vector![1.0, 5.0, -2.0], SMatrix::identity() * 1e6);
    let rows = [
        Row::equal([1.0, 1.0, 1.0], 1.0, 0.0).unwrap(),
        Row::at_least([0.0, 0.0, 1.0], 0.0, 0.0).unwrap(),
    ];
    assert!(project(&mut rls, &rows).unwrap());
    // on the plane and at the bound: (1, 5) moved by the same amount to sum to 1
    assert!(
        (rls.theta() - vector![-1.5, 2.5, 0.0]).amax() < 1e-9,
        "{}",
        rls.theta()
    );
}

#[test]
fn an_equality_that_rounding_moved_is_not_taken_for_a_contradiction() {
    let mut rls = estimator(vector![-3.0, -7.0], matrix![890.0, 8.5; 8.5, 0.1]);
    let rows = [
        Row::equal([8.0, 8.0], 40.0, 0.0).unwrap(),
        Row::at_most([4.0, 0.0], 5.0, 0.0).unwrap(),
    ];
    assert_eq!(project(&mut rls, &rows), Ok(true));
    assert!(
        (rls.theta() - vector![1.25, 3.75]).amax() < 1e-13,
        "{}",
        rls.theta()
    );
}

#[test]
fn a_box_may_have_a_fixed_entry() {
    let mut rls = estimator(vector![0.0, -3.9], matrix![3.5, 1.34; 1.34, 3.24]);
    let moved = project_box(&mut rls, &vector![0.0, 0.0], &vector![0.0, 2.0]);
    assert_eq!(moved, Ok(true));
    assert_eq!(*rls.theta(), vector![0.0, 0.0]);
}

/// The difference of the entries is known to fourteen digits, their sum is nearly unknown.
fn nearly_singular() -> ContinuousRls<2> {
    let weights = Weights::least_squares(0.0).unwrap();
    let mut rls = ContinuousRls::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
    rls.update(&Sample::new([1e14, -1e14], 0.0), 1.0);
    rls
}

#[test]
fn an_only_row_is_met_however_little_is_left_to_learn_along_it() {
    let mut rls = nearly_singular();
    let rows = [Row::equal([1.0, -1.0], 1.0, 0.0).unwrap()];
    assert_eq!(project(&mut rls, &rows), Ok(true));
    let theta = rls.theta();
    assert!((theta[0] - theta[1] - 1.0).abs() < 1e-9, "{theta}");
}

#[test]
fn a_box_that_is_not_empty_is_never_refused() {
    let mut rls = nearly_singular();
    let (lower, upper) = (vector![1.0, f64::NEG_INFINITY], vector![f64::INFINITY, 0.0]);
    assert_eq!(project_box(&mut rls, &lower, &upper), Ok(true));
    let theta = rls.theta();
    assert!(theta[0] >= 1.0 && theta[1] <= 0.0, "{theta}");
}

#[test]
fn a_row_without_length_is_an_error_where_it_is_violated() {
    let mut rls = estimator(vector![0.0, 0.0], SMatrix::identity());
    let rows = [Row::at_most([1e-310, 0.0], -1.0, 0.0).unwrap()];
    let error = project(&mut rls, &rows).unwrap_err();
    assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    assert_eq!(*rls.theta(), vector![0.0, 0.0]);
}

#[test]
fn a_violation_that_leaves_the_floating_point_range_is_an_error() {
    let start = vector![1e300, 0.0];
    let mut rls = estimator(start, SMatrix::identity());
    let rows = [Row::at_most([1e20, 0.0], 1.0, 0.0).unwrap()];
    let error = project(&mut rls, &rows).unwrap_err();
    assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    assert_eq!(*rls.theta(), start);
}

/// An equality is never let go for another row: the row that cannot be obeyed beside it is the one that is named.
#[test]
fn a_row_that_contradicts_an_equality_is_named_and_not_the_equality() {
    let mut rls = estimator(vector![0.0, 0.0], SMatrix::identity());
    let rows = [
        Row::equal([1.0, 0.0], 1.0, 0.0).unwrap(),
        Row::at_least([1.0, 0.0], 3.0, 0.0).unwrap(),
    ];
    let error = project(&mut rls, &rows).unwrap_err();
    assert_eq!(
        error,
        Error::NoCommonPoint {
            row: 1,
            violation: 2.0
        }
    );
}

/// The third row is the difference of the others up to rounding, which is large compared with the row.
#[test]
fn a_row_that_others_imply_may_be_off_by_their_rounding() {
    let (a, b, little) = (3.3e7, 0.7e7, 1e-6);
    let mut rls = estimator(vector![0.0, 0.0], SMatrix::identity());
    let rows = |off: f64| {
        [
            Row::equal([1.0, 1.0], a + b, 0.0).unwrap(),
            Row::equal([1.0, 1.0 - little], a + (1.0 - little) * b, 0.0).unwrap(),
            Row::at_most([0.0, little], little * b * (1.0 - off), 0.0).unwrap(),
        ]
    };
    assert_eq!(project(&mut rls, &rows(1e-6)), Ok(true));
    assert!(
        (rls.theta() - vector![a, b]).amax() < 10.0,
        "{}",
        rls.theta()
    );
    // beyond it the rows have no common point
    let mut rls = estimator(vector![0.0, 0.0], SMatrix::identity());
    let error = project(&mut rls, &rows(1e-2)).unwrap_err();
    assert!(matches!(error, Error::NoCommonPoint { .. }), "{error}");
}

#[test]
fn terms_that_leave_the_floating_point_range_are_an_error_though_they_cancel() {
    let start = vector![1.4e278, 1.4e278];
    let mut rls = estimator(start, SMatrix::identity());
    let rows = [Row::at_most([7e29, -7e29], -1.0, 0.0).unwrap()];
    let error = project(&mut rls, &rows).unwrap_err();
    assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    assert_eq!(*rls.theta(), start);
}
