//! Rows that are refused.

use ct_constrained::Relation::{AtLeast, AtMost, Equal};
use ct_rls::ExactHold;
use stabilized_oe::{BlockDiagonal, CoupledRow, Error, Known, StabilizedOe};

use crate::support::second_order;

pub(super) fn with_rows<const K: usize>(
    rows: [CoupledRow<2, 3>; K],
) -> Result<StabilizedOe<2, 3, BlockDiagonal<2, 3>, Known<2, 1>, K>, Error> {
    let gain = second_order::block_diagonal::<ExactHold>(second_order::weights(0.0));
    StabilizedOe::new(gain, Known::new(true))
        .unwrap()
        .with_rows(rows)
}

#[test]
fn rows_that_contradict_each_other_are_refused() {
    let of = |relation, f, f_c, chi| CoupledRow::new(relation, f, f_c, chi, 10.0).unwrap();
    let sum = |relation, chi| of(relation, [1.0, 0.0, 0.0], [1.0, 0.0], chi);
    let difference = |relation, chi| of(relation, [1.0, 0.0, 0.0], [-1.0, 0.0], chi);
    let first = |relation, chi| of(relation, [2.0, 0.0, 0.0], [0.0, 0.0], chi);
    for (rows, row) in [
        // a pair, an equality against a bound, and three of which any two agree
        ([sum(Equal, 1.0), sum(Equal, 2.0), first(Equal, 0.0)], None),
        (
            [sum(Equal, 1.0), sum(AtLeast, 1.5), first(AtMost, 9.0)],
            Some(1),
        ),
        (
            [sum(Equal, 1.0), difference(Equal, 3.0), first(AtMost, 3.0)],
            Some(2),
        ),
    ] {
        let error = with_rows(rows).map(|_| ()).unwrap_err();
        let Error::Constrained(ct_constrained::Error::NoCommonPoint {
            row: found,
            violation,
        }) = error
        else {
            panic!("{error}");
        };
        assert!(row.is_none_or(|row| row == found), "{error}");
        assert!((0.4..=1.1).contains(&violation.abs()), "{error}");
        assert!(!error.to_string().contains('\n'));
    }
    // the same that agree, also one said twice, and one that is switched off
    let off = CoupledRow::new(Equal, [1.0, 0.0, 0.0], [1.0, 0.0], 7.0, 0.0).unwrap();
    let agree = [sum(Equal, 1.0), difference(Equal, 3.0), first(AtMost, 4.0)];
    assert!(with_rows(agree).is_ok());
    assert!(with_rows([agree[0], agree[0], agree[1], agree[2], off]).is_ok());
    let mut estimator = with_rows([agree[0], off]).unwrap();
    assert!(estimator.set_row(1, sum(AtLeast, 1.5)).is_err());
    assert_eq!(estimator.rows(), &[agree[0], off]);
    assert!(matches!(
        estimator.set_row(2, off),
        Err(Error::Constrained(ct_constrained::Error::NoSuchRow {
            index: 2,
            rows: 2
        }))
    ));
    estimator.set_row(1, sum(AtLeast, 0.5)).unwrap();
    // theta = (2, 2, 0.5), c = (1, 1)
    assert_eq!(estimator.violations(), [2.0, 0.0]);
}

#[test]
fn rows_out_of_range_are_refused_with_their_numbers() {
    let make = |f, f_c, chi, w| CoupledRow::<2, 3>::new(AtMost, f, f_c, chi, w);
    let zero = make([0.0; 3], [-0.0, 0.0], 4.0, 1.0).unwrap_err();
    assert_eq!(zero, Error::ZeroRow { chi: 4.0 });
    assert!(zero.to_string().contains("chi = 4 are 0"), "{zero}");
    for w in [-1.0, f64::NAN, f64::INFINITY] {
        let error = make([1.0; 3], [0.0; 2], 4.0, w).unwrap_err();
        assert!(
            error
                .to_string()
                .contains(&format!("weight of the row is {w}")),
            "{error}"
        );
    }
    assert!(make([1.0; 3], [f64::NAN, 0.0], 4.0, 1.0).is_err());
    assert!(make([1.0; 3], [1e31, 0.0], 4.0, 1.0).is_err());
    assert!(make([1.0, f64::INFINITY, 0.0], [1.0; 2], 4.0, 1.0).is_err());
    assert!(make([1.0; 3], [1.0; 2], f64::NAN, 1.0).is_err());
}
