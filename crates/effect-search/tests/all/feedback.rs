//! The test for feedback of records without a controller.

use effect_search::Verdict;

use crate::records::{found, problem, record_with};

fn cell(second: &str, voltage: &str) -> String {
    format!(
        "model Cell
           final parameter Real Q(unit=\"A.s\") = 4e4;
           parameter Real R(unit=\"Ohm\", min=0) = 0.03;
           input Real i(unit=\"A\");
           output Real y(unit=\"V\") = v;
           Real q(unit=\"1\", start=0.5);
           {second}
           Real v(unit=\"V\") = 3 + 1.2*q - R*i{voltage};
         equation
           Q*der(q) = -i;
           {}
         end Cell;",
        if second.is_empty() {
            ""
        } else {
            "50*der(w) = 0.02*i - w;"
        }
    )
}

/// The current changes in every row and the voltage follows at once: with a wrong resistance the residual contains the current, and past
/// residuals predict the present one. With the second pair the residual is noise.
#[test]
fn what_the_model_lacks_is_no_feedback() {
    let text = cell("Real w(unit=\"V\", start=0);", " - w");
    let current = |_: &str, _: usize, k: usize| {
        let slow = ((k / 23) * 7919 % 13) as f64 - 6.0;
        slow + 0.4 * ((k * 104_729) % 11) as f64
    };
    let record = record_with(&text, current, (0.0, 0.002), 3);
    let found = found(&problem(&cell("", ""), record));
    assert!(
        matches!(found.verdict, Verdict::Effect | Verdict::Undecided),
        "{:?} {:?}",
        found.verdict,
        found.groups
    );
    assert_eq!(found.control_loop, None);
}
