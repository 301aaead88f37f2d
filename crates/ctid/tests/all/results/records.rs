//! Several records, held-out ones, and the options for them.

use serde_json::Value;

use super::{DIAGNOSE, number, parameters};
use crate::common::{Place, Tanks, bundled, lasting};

#[test]
fn two_records_are_fitted_together() {
    let place = Place::new();
    place.succeeds("add overflow --model tour.toml");
    let steps = |data: &str| {
        let json = place.result(&format!("compare {data} --model tour.toml"));
        json["steps"][0].clone()
    };
    let (first, second) = (steps("tour.csv"), steps("tour-test.csv"));
    let both = steps("tour.csv tour-test.csv");
    let error = |step: &Value, name: &str| {
        let list = step["parameters"].as_array().unwrap();
        let parameter = list.iter().find(|parameter| parameter["name"] == name);
        number(&parameter.unwrap()["std_error"])
    };
    let value = |step: &Value, name: &str| {
        let found = parameters(step).into_iter().find(|(own, _)| own == name);
        found.unwrap().1
    };
    for name in ["pump_gain", "alpha", "overflow.rim"] {
        assert!(error(&both, name) < error(&first, name), "{name}");
        assert!(error(&both, name) < error(&second, name), "{name}");
        let (low, high) = (value(&first, name), value(&second, name));
        let (low, high) = (low.min(high), low.max(high));
        let slack = error(&both, name);
        let together = value(&both, name);
        assert!(
            low - slack < together && together < high + slack,
            "{name}: {together} is not between {low} and {high}"
        );
    }
    // An initial level for each record.
    assert_eq!(parameters(&both).len(), parameters(&first).len() + 1);
    // The order of the records does not matter.
    let swapped = steps("tour-test.csv tour.csv");
    for name in ["pump_gain", "alpha", "overflow.rim"] {
        let (a, b) = (value(&both, name), value(&swapped, name));
        assert!((a - b).abs() < 0.1 * error(&both, name), "{name}: {a}, {b}");
    }
}

#[test]
fn a_held_out_record_changes_no_fit_and_no_choice() {
    let place = Place::new();
    let without = lasting(place.result(DIAGNOSE));
    for test in [
        bundled("tour-test.csv"),
        // Held-out data that contradict the model altogether.
        Tanks {
            theta: vec![30.0, 20.0],
            rows: 100,
            ..Tanks::single()
        }
        .csv(),
    ] {
        let is_long = test.lines().count() > 200;
        place.write("held-out.csv", test);
        let mut with = lasting(place.result(&format!("{DIAGNOSE} --test held-out.csv")));
        for step in with["steps"].as_array_mut().unwrap() {
            assert!(number(&step["rmse_test"]) > 0.0);
            for key in ["rmse_test", "rmse_test_per_output", "weighted_rmse_test"] {
                step[key] = Value::Null;
            }
            let later = &step["outputs"][0]["rmse_test_50"];
            assert_eq!(later.as_f64().is_some_and(|error| error > 0.0), is_long);
            for key in ["rmse_test", "rmse_test_50", "held_out_error"] {
                step["outputs"][0][key] = Value::Null;
            }
        }
        with["acceptance"]["share_test"] = Value::Null;
        // The findings in words tell of the held-out error.
        with["sentences"] = without["sentences"].clone();
        assert_eq!(with, without);
    }
}

#[test]
fn a_decimal_comma_changes_nothing() {
    let place = Place::new();
    let points = lasting(place.result(&format!("{DIAGNOSE} --test tour-test.csv")));
    for name in ["tour.csv", "tour-test.csv"] {
        let text = bundled(name).replace(',', ";").replace('.', ",");
        // In the format of spreadsheets.
        place.write(name, format!("\u{feff}{}", text.replace('\n', "\r\n")));
    }
    let commas = lasting(place.result(&format!("{DIAGNOSE} --test tour-test.csv")));
    assert_eq!(points, commas);
}

#[test]
fn tabs_comments_and_other_columns_change_nothing() {
    let place = Place::new();
    let plain = lasting(place.result(DIAGNOSE));
    let mut text = String::from("# logger 7\n\n");
    for (index, line) in bundled("tour.csv").lines().enumerate() {
        let remark = if index == 0 { "remark" } else { "ok, so far" };
        text += &format!("{remark}\t{}\n", line.replace(',', "\t "));
    }
    place.write("tour.csv", text);
    assert_eq!(plain, lasting(place.result(DIAGNOSE)));
}

#[test]
fn minutes_are_as_good_as_seconds() {
    let place = Place::new();
    place.write(
        "tour.toml",
        bundled("tour.toml").replace("time = \"t [s]\"", "time = \"t\""),
    );
    let seconds = place.result(DIAGNOSE);
    let mut text = String::from("t [min],u [V],y [cm]\n");
    for line in bundled("tour.csv").lines().skip(1) {
        let (time, rest) = line.split_once(',').unwrap();
        text += &format!("{},{rest}\n", time.parse::<f64>().unwrap() / 60.0);
    }
    place.write("tour.csv", text);
    let minutes = place.result(DIAGNOSE);
    for key in ["verdict", "effects", "groups"] {
        assert_eq!(seconds[key], minutes[key]);
    }
    let steps = |json: &Value| json["steps"].as_array().unwrap().clone();
    for (a, b) in steps(&seconds).iter().zip(&steps(&minutes)) {
        let (a, b) = (parameters(a), parameters(b));
        assert_eq!(a.len(), b.len());
        for ((name, a), (_, b)) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-5 * a.abs(), "{name}: {a} and {b}");
        }
    }
}
