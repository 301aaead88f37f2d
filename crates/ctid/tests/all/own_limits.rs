//! Candidates of a model file that are absent only in a limit: RC pairs of a cell. And texts that cannot be simulated or have unknown
//! units.

use std::fmt::Write;

use serde_json::Value;

use crate::common::{Place, Random};

// Without units the catalogue has no voltage, and therefore no RC pair for it.
const CELL: &str = r#"model Cell "open-circuit voltage and series resistance"
  parameter Real E0(min=0) = 4.15 "open-circuit voltage";
  parameter Real R0(min=0) = 0.02 "series resistance";
  input Real i "current that is drawn";
  output Real v = E0 - R0*i "terminals";
end Cell;
"#;

/// Resistance \[Ohm\] and capacity \[F\].
const FAST: (f64, f64) = (0.015, 2000.0);
const SLOW: (f64, f64) = (0.03, 20_000.0);

fn pair(name: &str, at: usize, capacity: f64) -> String {
    format!(
        "[candidates.{name}]\nparameters = {{ R{at} = {{ unit = \"Ohm\", start = 0.01, min = 0.0 }}, C{at} = {{ unit = \"F\", start = {capacity:?}, min = 1.0 }} }}\n\
         states = {{ v{at} = {{ unit = \"V\", start = 0.0, equation = \"C{at}*der(v{at}) = i - v{at}/R{at}\" }} }}\nterms = {{ v = \"-v{at}\" }}\n"
    )
}

/// Terminal voltage of a cell with these pairs under pulses, every 2 s.
fn pulses(pairs: &[(f64, f64)], seed: u64) -> String {
    let mut text = String::from("t [s],i,v\n");
    let mut draw = Random(seed);
    let mut over = vec![0.0; pairs.len()];
    for k in 0..1500 {
        let i = [0.0, 2.0, 0.0, 1.0, 0.0, 3.0, 0.5, 0.0][(k / 61) % 8];
        let v = 4.1 - 0.025 * i - over.iter().sum::<f64>() + 0.001 * draw.normal();
        writeln!(text, "{},{i},{v:.6}", 2 * k).unwrap();
        for (v, (r, c)) in over.iter_mut().zip(pairs) {
            let decay = (-2.0 / (r * c)).exp();
            *v = decay * *v + r * (1.0 - decay) * i;
        }
    }
    text
}

fn place(pairs: &str) -> Place {
    let place = Place::empty();
    place.write("cell.mo", CELL);
    place.write(
        "m.toml",
        format!("model = \"cell.mo\"\neffects = []\n[columns]\ntime = \"t [s]\"\n{pairs}"),
    );
    place
}

fn is_near(result: &Value, name: &str, value: f64) {
    let last = result["steps"].as_array().unwrap().last().unwrap();
    let parameters = last["parameters"].as_array().unwrap();
    let one = parameters.iter().find(|one| one["name"] == name).unwrap();
    let (fitted, error) = (&one["value"], &one["std_error"]);
    let (fitted, error) = (fitted.as_f64().unwrap(), error.as_f64().unwrap());
    assert!(
        (fitted - value).abs() < 4.0 * error && error < 0.1 * value,
        "{name} = {fitted} +- {error}, and {value} was simulated"
    );
}

#[test]
fn an_rc_pair_is_found_and_written_without_a_factor() {
    let place = place(&pair("rc_pair", 1, 1000.0));
    place.write("a.csv", pulses(&[FAST], 1));
    place.succeeds("diagnose a.csv --model m.toml --json found.json");
    let found = place.json("found.json");
    assert_eq!(found["effects"][0], "rc_pair", "{found}");
    assert_eq!(found["verdict"], "effect");
    is_near(&found, "rc_pair_R1", FAST.0);
    is_near(&found, "rc_pair_C1", FAST.1);
    place.succeeds("add rc_pair --model m.toml --from found.json");
    let mended = place.result("compare a.csv --model m.toml");
    is_near(&mended, "rc_pair_R1", FAST.0);
    place.succeeds("export m.toml a.csv --modelica mended.mo");
    let text = place.read("mended.mo");
    assert!(
        text.contains("rc_pair_C1*der(rc_pair_v1) = i - rc_pair_v1/rc_pair_R1;"),
        "{text}"
    );
    assert!(text.contains("v = v_true - rc_pair_v1;"), "{text}");
    assert!(!text.contains("factor"), "{text}");
    place.succeeds("simulate m.toml a.csv --out y.csv");
}

#[test]
fn a_second_pair_is_declared_beside_the_first_and_found_beside_it() {
    let both = pair("rc_pair", 1, 1000.0) + &pair("second_rc_pair", 2, 10_000.0);
    let place = place(&both);
    // One pair has one name, although two are offered.
    place.write("a.csv", pulses(&[FAST], 2));
    let found = place.result("diagnose a.csv --model m.toml");
    assert_eq!(found["groups"], serde_json::json!([["rc_pair"]]));
    place.write("b.csv", pulses(&[FAST, SLOW], 3));
    let found = place.result("diagnose b.csv --model m.toml");
    let groups = found["groups"].as_array().unwrap();
    assert_eq!(groups.len(), 2, "{groups:?}");
    for group in groups {
        assert_eq!(group.as_array().unwrap().len(), 1, "{groups:?}");
    }
    // The order of the two time constants is random.
    let last = found["steps"].as_array().unwrap().last().unwrap();
    let parameters = last["parameters"].as_array().unwrap();
    let first = parameters.iter().find(|p| p["name"] == "rc_pair_C1");
    let is_fast = first.unwrap()["value"].as_f64().unwrap() < 7000.0;
    let [one, other] = if is_fast { [FAST, SLOW] } else { [SLOW, FAST] };
    is_near(&found, "rc_pair_R1", one.0);
    is_near(&found, "rc_pair_C1", one.1);
    is_near(&found, "second_rc_pair_R2", other.0);
    is_near(&found, "second_rc_pair_C2", other.1);
}

#[test]
fn nothing_is_found_where_there_is_no_pair() {
    let place = place(&pair("rc_pair", 1, 1000.0));
    place.write("a.csv", pulses(&[], 4));
    let found = place.result("diagnose a.csv --model m.toml");
    assert_eq!(found["verdict"], "adequate", "{found}");
}

#[test]
fn a_division_by_a_state_that_starts_at_zero_is_refused_with_its_place() {
    let place = Place::empty();
    let text = "model Tank\n  parameter Real a = 1;\n  input Real u;\n  output Real y = x;\n  Real x(min=0, start=0);\nequation\n  der(x) = u - a/x;\nend Tank;\n";
    place.write("tank.mo", text);
    place.write("m.toml", "model = \"tank.mo\"\n");
    place.write("a.csv", "t,u,y\n0,1,2\n1,1,2.5\n2,1,2\n");
    let says = [
        "tank.mo:5:17: `x` starts at 0, and the equation of `x` divides by it, `a/x`",
        "`Real x(start=...)`",
    ];
    place.refuses("check tank.mo", &says);
    place.refuses("compare a.csv --model m.toml", &says);
    // Divisors that are not zero at the start are accepted.
    for divisor in ["max(x, 0.1)", "(if x > 0 then x else 1)", "(x + 1)"] {
        place.write("tank.mo", text.replace("a/x", &format!("a/{divisor}")));
        place.succeeds("check tank.mo");
    }
    place.write("tank.mo", text.replace("start=0", "start=2"));
    place.succeeds("check tank.mo");
}

#[test]
fn a_unit_that_is_none_is_said_with_its_place() {
    let place = Place::empty();
    place.write(
        "cell.mo",
        CELL.replace("R0(min=0)", "R0(unit=\"bananas/K\", min=0)"),
    );
    let said = place.succeeds("check cell.mo");
    assert!(
        said.contains("cell.mo:3:21: `bananas` in the unit `bananas/K` is unknown"),
        "{said}"
    );
    for unit in [
        "mH",
        "kg.m2/s",
        "V.s/rad",
        "1",
        "W/(m2.K4)",
        "uF",
        "mmHg",
        "%",
        "mol/l",
        "m^3/h",
    ] {
        let known = CELL.replace("R0(min=0)", &format!("R0(unit=\"{unit}\", min=0)"));
        place.write("cell.mo", known);
        let said = place.succeeds("check cell.mo");
        assert!(!said.contains("no unit"), "{unit}: {said}");
    }
}

/// A model of a cell in which only the sum of two resistances is determined, and whose voltage has the unit of a current.
#[test]
fn what_the_records_cannot_determine_comes_first() {
    let place = place("");
    let text = CELL
        .replace("parameter Real R0(min=0)", "parameter Real R1(unit=\"Ohm\", min=0) = 0.01;\n  parameter Real R0(unit=\"Ohm\", min=0)")
        .replace("input Real i", "input Real i(unit=\"A\")")
        .replace("E0(min=0)", "E0(unit=\"V\", min=0)")
        .replace("output Real v = E0 - R0*i", "output Real v(unit=\"A\") = E0 - (R0 + R1)*i");
    place.write("cell.mo", text);
    place.write("d.csv", pulses(&[FAST], 3));
    let mismatch = "warning: cell.mo:6:29: units in the equation of v: ";
    let together = "warning: these records determine only a combination of R1 and R0";
    for command in ["compare", "diagnose"] {
        let said = place.succeeds(&format!("{command} d.csv --model m.toml"));
        assert!(said.starts_with(mismatch), "{said}");
        let conclusions = said.find("Simulation error").unwrap();
        let warned = said.find(together).unwrap();
        assert!(warned < conclusions, "{said}");
        assert_eq!(said.matches(together).count(), 1, "{said}");
    }
}
