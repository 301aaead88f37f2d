//! What the program says of a model text beside the missing effect.

use std::fmt::Write;

use crate::common::{Place, Random};

/// A heater whose resistance is measured; the sign of its term is `$SIGN`.
const TEXT: &str = r#"model Heater
  final parameter Real R(unit="Ohm") = 2.0 "measured";
  parameter Real C(unit="J/K", min=0) = 40;
  parameter Real k(unit="W/K", min=0) = 0.5;
  parameter Real s(unit="1", min=0) = 1 "share that heats";
  input Real i(unit="A");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
equation
  C*der(T) = $SIGNs*R*i^2 - k*(T - 20);
end Heater;
"#;

/// The heat is 0.8 R i^2, and the sensor lags by 30 s.
fn record() -> String {
    let mut text = String::from("t [s],i [A],y [degC]\n");
    let mut draw = Random(3);
    let (mut temperature, mut read) = (20.0_f64, 20.0_f64);
    for k in 0..500 {
        let i = [1.0, 4.0, 2.0, 5.0, 3.0][k / 30 % 5];
        writeln!(text, "{},{i},{:.4}", 2 * k, read + 0.05 * draw.normal()).unwrap();
        for _ in 0..200 {
            let slope = (0.8 * 2.0 * i * i - 0.5 * (temperature - 20.0)) / 40.0;
            read += 0.01 * (temperature - read) / 30.0;
            temperature += 0.01 * slope;
        }
    }
    text
}

fn place(sign: &str) -> Place {
    let place = Place::empty();
    place.write("heater.mo", TEXT.replace("$SIGN", sign));
    place.write(
        "m.toml",
        "model = \"heater.mo\"\n[columns]\ni = \"i [A]\"\ny = \"y [degC]\"\n",
    );
    place.write("a.csv", record());
    place
}

fn one_line(said: &str) -> String {
    said.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn measured_parameters_without_candidates_are_named() {
    let place = place("");
    let said = one_line(&place.succeeds("diagnose a.csv --model m.toml"));
    assert!(said.contains("lag(y)"), "{said}");
    assert!(
        said.contains("R is measured (final parameter): effects at it were not tried."),
        "{said}"
    );
    assert!(!said.contains("is at its min"), "{said}");
}

#[test]
fn a_term_with_the_wrong_sign_ends_at_its_bound() {
    let place = place("-");
    let said = one_line(&place.succeeds("diagnose a.csv --model m.toml"));
    assert!(
        said.contains("In the first fit s is at its min of 0: the sign of its term may be wrong"),
        "{said}"
    );
}

/// A band of a model that lacks an effect does not include its error.
#[test]
fn a_simulation_of_a_model_that_lacks_an_effect_says_so() {
    let place = place("");
    let new = "t [s],i [A]\n0,2\n2,2\n4,5\n6,5\n";
    place.write("new.csv", new);
    let simulate = "simulate m.toml new.csv --fit a.csv --out y.csv";
    let said = one_line(&place.succeeds(simulate));
    assert!(
        said.contains(
            "the residual of the fit at y depends on i, and the band does not include this"
        ),
        "{said}"
    );
}
