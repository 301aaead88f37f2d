//! An actuator that is limited in both directions.

use effect_search::Verdict;

use crate::records::{found, level, problem, record_with};

fn motor(drive: &str) -> String {
    format!(
        "model Motor
           parameter Real b(unit=\"N.m.s\", min=0) = 0.8;
           parameter Real g(unit=\"N.m/V\", min=0) = 1.6;
           final parameter Real J(unit=\"kg.m2\") = 20;
           input Real u(unit=\"V\");
           output Real y(unit=\"1/s\") = w;
           Real w(unit=\"1/s\", start=0);
         equation
           J*der(w) = g*{drive} - b*w;
         end Motor;"
    )
}

#[test]
fn one_limit_at_both_ends_of_the_command_is_named() {
    for (limit, seed) in [(9.0, 1), (12.0, 2)] {
        let drive = format!("min(max(u, -{limit}), {limit})");
        let input = |_: &str, i: usize, k: usize| level(k, i) - 18.0;
        let record = record_with(&motor(&drive), input, (0.0, 0.3), seed);
        let found = found(&problem(&motor("u"), record));
        assert_eq!(found.effects, ["saturation(u)"], "{limit}");
        assert_eq!(found.verdict, Verdict::Effect, "{limit}");
        let last = &found.steps.last().unwrap().parameters;
        let of = |name: &str| last.iter().find(|p| p.name == name).unwrap();
        assert_eq!(of("saturation_u_side").value, 0.0, "{limit}");
        let limited = of("saturation_u_limit");
        assert!(
            (limited.value - limit).abs() < 4.0 * limited.std_error.unwrap(),
            "{limit} {limited:?}"
        );
    }
}
