//! Effects that act together, each of which explains little alone.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_model::effects::{OwnCandidate, OwnParameter};
use effect_search::{Options, Problem, Verdict, diagnose};

use crate::records::record;

/// Two heaters of one board, as its user believes.
const BOARD: &str = r#"model Board
  final parameter Real C(unit="J/K") = 50;
  parameter Real k1(unit="W/K", min=0, max=10) = 0.8;
  parameter Real k2(unit="W/K", min=0, max=10) = 0.5;
  parameter Real g1(unit="W/%", min=0, max=20) = 1.6;
  parameter Real g2(unit="W/%", min=0, max=20) = 1.6;
  input Real u(unit="%");
  input Real w(unit="%");
  output Real y1(unit="degC") = T1;
  output Real y2(unit="degC") = T2;
  Real T1(unit="degC", start=20);
  Real T2(unit="degC", start=20);
equation
  C*der(T1) = g1*u - k1*(T1 - 20);
  C*der(T2) = g2*w - k2*(T2 - 20);
end Board;"#;

/// The board with a conductance between the heaters, one supply that sags under both, and sensors that lag.
const TRUE_BOARD: &str = r#"model Board
  input Real u(unit="%");
  input Real w(unit="%");
  output Real y1(unit="degC") = S1;
  output Real y2(unit="degC") = S2;
  Real T1(unit="degC", start=20);
  Real T2(unit="degC", start=20);
  Real S1(unit="degC", start=20);
  Real S2(unit="degC", start=20);
equation
  50*der(T1) = 1.6*u*(1 - 0.006*w) - 0.6*(T1 - 20) + 0.35*(T2 - T1);
  50*der(T2) = 1.6*w*(1 - 0.008*u) - 0.6*(T2 - 20) + 0.35*(T1 - T2);
  25*der(S1) = T1 - S1;
  20*der(S2) = T2 - S2;
end Board;"#;

fn supply() -> BTreeMap<String, OwnCandidate> {
    let sag = |start| OwnParameter {
        unit: "1/%".to_string(),
        min: Some(0.0),
        max: Some(0.02),
        start,
    };
    let supply = OwnCandidate {
        parameters: BTreeMap::from([
            ("s1".to_string(), sag(0.002)),
            ("s2".to_string(), sag(0.002)),
        ]),
        terms: BTreeMap::from([
            ("T1".to_string(), "-s1*g1*u*w".to_string()),
            ("T2".to_string(), "-s2*g2*u*w".to_string()),
        ]),
        ..OwnCandidate::default()
    };
    BTreeMap::from([("supply".to_string(), supply)])
}

#[test]
fn a_coupling_a_supply_and_two_lags_are_found_beside_slow_noise() {
    let spec = ModelSpec::parse(BOARD).unwrap();
    let record = record(TRUE_BOARD, 0.99, 0.3, 5);
    let mut problem = Problem::builder(spec, [record]).build().unwrap();
    problem.candidates = supply();
    let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
    println!("{:?} {:?} {:?}", found.verdict, found.groups, found.seconds);
    assert_eq!(found.verdict, Verdict::Partial);
    for names in [
        &["coupling(T1,T2)"] as &[&str],
        &["supply"],
        &["lag(y1)", "lag(u)"],
        &["lag(y2)", "lag(w)"],
    ] {
        let in_group =
            |group: &Vec<String>| names.iter().any(|name| group.iter().any(|id| id == name));
        assert!(
            found.groups.iter().any(in_group),
            "{names:?} {:?}",
            found.groups
        );
    }
}
