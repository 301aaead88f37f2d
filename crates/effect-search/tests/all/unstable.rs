//! Unstable models.

use ct_model::ModelSpec;
use effect_search::{Error, Options, Problem, diagnose};

use crate::records::record;

fn block(rate: &str) -> String {
    format!(
        "model Block
           parameter Real a(unit=\"1/s\", min=0.1) = 0.2;
           parameter Real g(unit=\"1/s\", min=0) = 0.05;
           input Real u(unit=\"1\");
           output Real y(unit=\"1\") = x;
           Real x(unit=\"1\", start=20);
         equation
           der(x) = g*u {rate}*x;
         end Block;"
    )
}

/// Deviations of the states grow, so that no simulation from the inputs follows the record, whatever is missing.
#[test]
fn a_model_that_grows_away_from_its_record_is_refused() {
    let record = record(&block("- a"), 0.0, 0.1, 1);
    let spec = ModelSpec::parse(&block("+ a")).unwrap();
    let problem = Problem::builder(spec, [record]).build().unwrap();
    let refused = diagnose(&problem, &Options::default(), &|_| {}).err();
    let Some(Error::Unstable {
        output,
        growth_time,
        ..
    }) = refused
    else {
        panic!("{refused:?}");
    };
    assert_eq!(output, "y");
    assert!((growth_time - 5.0).abs() < 1e-9, "{growth_time}");
}
