//! Records of a model of its user's own as they come: a time column in another unit than that of the text, codes for missing samples, start
//! values that are far off.

use std::fmt::Write;

use crate::common::{Place, Random};

/// The loss is known; without bounds of the heat capacity.
const BLOCK: &str = r#"model Block "a block with a heater, in a room"
  parameter Real C(unit="J/K", min=0) = 5000 "heat capacity";
  parameter Real k(unit="W/K", min=0) = 8 "loss to the room";
  input Real p(unit="W") "power";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
equation
  C*der(T) = p - k*(T - 20);
end Block;
"#;

/// The block with a heat capacity of 6000 J/K and a loss of 10 W/K, a row a minute; `cell`: the text of a reading.
fn record(rows: usize, cell: impl Fn(usize, f64) -> String) -> String {
    let mut text = String::from("t [min],p [W],y [degC]\n");
    let mut draw = Random(5);
    let mut t = 25.0;
    for k in 0..rows {
        let p = [0.0, 300.0, 100.0, 500.0][k / 25 % 4];
        let reading = t + 0.05 * draw.normal();
        writeln!(text, "{k},{p},{}", cell(k, reading)).unwrap();
        let end = 20.0 + p / 10.0;
        t = end + (t - end) * (-60.0 * 10.0 / 6000.0_f64).exp();
    }
    text
}

fn place(text: &str, columns: &str, record: String) -> Place {
    let place = Place::empty();
    place.write("block.mo", text);
    place.write(
        "m.toml",
        format!("model = \"block.mo\"\n[columns]\ntime = \"t [min]\"\n{columns}"),
    );
    place.write("a.csv", record);
    place
}

fn plain(rows: usize) -> String {
    record(rows, |_, y| format!("{y:.4}"))
}

/// Value and standard error of the heat capacity.
fn heat_capacity(place: &Place) -> (f64, f64) {
    let found = place.result("compare a.csv --model m.toml");
    let parameters = found["steps"][0]["parameters"].as_array().unwrap();
    let c = parameters.iter().find(|one| one["name"] == "C").unwrap();
    (
        c["value"].as_f64().unwrap(),
        c["std_error"].as_f64().unwrap(),
    )
}

#[test]
fn the_unit_of_time_of_the_text_may_differ_from_that_of_the_column() {
    let per_minute = place(BLOCK, "", plain(300));
    for command in ["compare", "diagnose"] {
        let said = per_minute.succeeds(&format!("{command} a.csv --model m.toml"));
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            said.contains("der() is per s, but it is taken per min")
                && said.contains("write time_unit = \"s\" under [columns]"),
            "{said}"
        );
    }
    let (value, error) = heat_capacity(&per_minute);
    assert!((value - 100.0).abs() < 4.0 * error, "{value} +- {error}");

    let per_second = place(BLOCK, "time_unit = \"s\"\n", plain(300));
    let (value, error) = heat_capacity(&per_second);
    assert!((value - 6000.0).abs() < 4.0 * error, "{value} +- {error}");
    for command in ["check m.toml", "compare a.csv --model m.toml"] {
        let said = per_second.succeeds(command);
        assert!(!said.contains("warning"), "{said}");
    }

    let unknown = place(BLOCK, "time_unit = \"cm\"\n", plain(300));
    unknown.refuses(
        "compare a.csv --model m.toml",
        &["m.toml:4: ", "write time_unit = \"s\""],
    );
}

#[test]
fn codes_and_single_spikes_are_told_with_their_correction() {
    let codes = record(300, |k, y| {
        if (100..112).contains(&k) {
            "-999".to_string()
        } else {
            format!("{y:.4}")
        }
    });
    let coded = place(BLOCK, "time_unit = \"s\"\n", codes.clone());
    let said = coded.succeeds("compare a.csv --model m.toml");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("a.csv, column y: 12 readings of one value are far from the others, -999.0 degC at 100 min")
            && said.contains("write missing = [\"-999\"] under [columns]"),
        "{said}"
    );
    // The correction works.
    let mended = place(BLOCK, "time_unit = \"s\"\nmissing = [\"-999\"]\n", codes);
    let said = mended.succeeds("compare a.csv --model m.toml");
    assert!(!said.contains("warning"), "{said}");

    let spike = record(300, |k, y| {
        format!("{:.4}", if k == 215 { y + 40.0 } else { y })
    });
    let said = place(BLOCK, "time_unit = \"s\"\n", spike).succeeds("diagnose a.csv --model m.toml");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("one reading is far from the others") && said.contains("at 3.58 h between"),
        "{said}"
    );
}

#[test]
fn a_parameter_without_bounds_may_be_far_from_its_start() {
    let far = BLOCK.replace("= 5000", "= 60");
    let far = place(&far, "time_unit = \"s\"\n", plain(300));
    let (value, error) = heat_capacity(&far);
    assert!((value - 6000.0).abs() < 4.0 * error, "{value} +- {error}");
    let found = far.result("diagnose a.csv --model m.toml");
    assert_eq!(found["verdict"], "adequate", "{found}");
}

#[test]
fn conversions_of_units_are_told_and_so_are_inputs_outside_their_range() {
    let text = BLOCK.replace(
        "input Real p(unit=\"W\")",
        "input Real p(unit=\"kW\", min=0, max=0.4)",
    );
    let text = text.replace("= p -", "= 1000*p -");
    let watts = place(&text, "time_unit = \"s\"\n", plain(300));
    for command in [
        "compare a.csv --model m.toml",
        "simulate m.toml a.csv --out y.csv",
    ] {
        let said = watts.succeeds(command);
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            said.contains("\"p\" converted from W to kW")
                && said.contains("warning: a.csv: p is above its max of 0.4000 kW in 75 rows, up to 0.5000 kW: correct the unit"),
            "{said}"
        );
    }
    // The noise of a measured input at its bound is not a wrong unit.
    let at_the_bound = place(
        &text.replace("max=0.4", "max=0.499"),
        "time_unit = \"s\"\n",
        plain(300),
    );
    let said = at_the_bound.succeeds("compare a.csv --model m.toml");
    assert!(!said.contains("warning"), "{said}");
}
