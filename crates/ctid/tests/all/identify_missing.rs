//! Records with missing readings or rows of the output: results of each method, and errors. `RECORDS=400` runs more records than a test
//! needs.

use crate::common::Place;
use crate::identify::{Plant, SECOND};
use ct_signals::Record;
use linear_identification::{Identification, LevelChoice, Method, Order, Request, identify};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;

/// A number of pairs of an estimate and its standard error.
type Measure<'a> = &'a dyn Fn(&[(f64, f64)]) -> f64;

const ROWS: usize = 1500;

/// With noise, and signals about zero.
const NOISY: Plant = Plant {
    rest: (0.0, 0.0),
    noise: 0.2,
    ..SECOND
};

/// Number of records of each method.
fn records() -> u64 {
    let asked = std::env::var("RECORDS").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(24)
}

/// 30 % of the readings at random, and a block of 10 rows' readings.
fn without_some(mut record: Record, seed: u64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 7000);
    let rows = record.len();
    for (k, y) in record.outputs[0].values.iter_mut().enumerate() {
        if rng.random_bool(0.3) || (rows / 3..rows / 3 + 10).contains(&k) {
            *y = f64::NAN;
        }
    }
    record
}

/// Bias and spread of the estimates of a_1, a_2 and b_0 over many records.
struct Sure {
    /// Shares of the 95 % intervals that contain the true value.
    covered: Vec<f64>,
    /// Standard errors over the spread of the estimates.
    told: Vec<f64>,
    /// Mean error relative to the standard error of one record.
    bias: Vec<f64>,
}

fn sure(method: Method, missing: bool) -> Sure {
    let truth = [NOISY.a[1], NOISY.a[2], NOISY.b[0]];
    let found: Vec<Vec<(f64, f64)>> = (0..records())
        .into_par_iter()
        .map(|seed| {
            let record = NOISY.record(ROWS, seed);
            let record = match missing {
                true => without_some(record, seed),
                false => record,
            };
            let mut request = Request::new(method, Order { n: 2, m: 0 });
            // Their standard errors assume exact levels.
            if matches!(method, Method::Iv | Method::RecursiveFcloe) {
                request.levels = LevelChoice::Zero;
            }
            let found = identify(&record, &request).unwrap();
            let own = found.parameters.iter().zip(truth);
            own.map(|(p, truth)| (p.value - truth, p.std_error.unwrap_or(f64::NAN)))
                .collect()
        })
        .collect();
    let n = found.len() as f64;
    let of = |i: usize, measure: Measure| {
        let errors: Vec<(f64, f64)> = found.iter().map(|record| record[i]).collect();
        measure(&errors)
    };
    let all = |measure: Measure| -> Vec<f64> { (0..truth.len()).map(|i| of(i, measure)).collect() };
    let mean = |e: &[(f64, f64)]| e.iter().map(|e| e.0).sum::<f64>() / n;
    let spread = |e: &[(f64, f64)]| {
        let mean = mean(e);
        (e.iter().map(|e| (e.0 - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    let sure = Sure {
        covered: all(&|e| e.iter().filter(|e| e.0.abs() <= 1.96 * e.1).count() as f64 / n),
        told: all(&|e| (e.iter().map(|e| e.1 * e.1).sum::<f64>() / n).sqrt() / spread(e)),
        bias: all(&|e| mean(e) / spread(e)),
    };
    println!(
        "{} {}: covered {:.3?}, errors over spread {:.3?}, bias over spread {:.2?}",
        method.id(),
        if missing { "missing" } else { "whole" },
        sure.covered,
        sure.told,
        sure.bias
    );
    sure
}

/// Standard errors are correct with all readings and without some of them.
fn holds(method: Method) {
    let n = records() as f64;
    for missing in [false, true] {
        let found = sure(method, missing);
        // Four standard deviations of a share of 95 %, and one record; of a standard deviation; of a mean.
        let band = 4.0 * (0.95_f64 * 0.05 / n).sqrt() + 1.0 / n;
        for ((covered, told), bias) in found.covered.iter().zip(&found.told).zip(&found.bias) {
            assert!((covered - 0.95).abs() <= band, "{}: {covered}", method.id());
            assert!(
                (told - 1.0).abs() <= 4.0 / (2.0 * n).sqrt(),
                "{}: {told}",
                method.id()
            );
            assert!(
                bias.abs() <= 4.0 / n.sqrt() + 0.1,
                "{}: {bias}",
                method.id()
            );
        }
    }
}

#[test]
fn srivc_and_rivc_are_as_sure_as_they_say() {
    holds(Method::Srivc);
    holds(Method::Rivc);
}

#[test]
fn output_error_is_as_sure_as_it_says() {
    holds(Method::Fcloe);
    holds(Method::Iv);
}

/// Recursions are not worse with missing readings: the coverage of their intervals is the same.
#[test]
fn recursions_are_no_worse_for_missing_readings() {
    let n = records() as f64;
    for method in [Method::StabilizedOe, Method::RecursiveFcloe, Method::CtRls] {
        let [whole, missing] = [false, true].map(|missing| sure(method, missing));
        for (whole, missing) in whole.covered.iter().zip(&missing.covered) {
            let band = 4.0 * (2.0 * 0.95_f64 * 0.05 / n).sqrt() + 2.0 / n;
            assert!(
                missing >= &(whole - band),
                "{}: {whole} {missing}",
                method.id()
            );
        }
    }
}

fn csv(record: &Record, skip: impl Fn(usize) -> bool) -> String {
    let mut text = "t [s],u [V],y [cm]\n".to_owned();
    for k in (0..record.len()).filter(|k| !skip(*k)) {
        let y = record.outputs[0].values[k];
        let y = if y.is_nan() {
            "Bad".to_owned()
        } else {
            y.to_string()
        };
        text += &format!("{},{},{y}\n", record.time[k], record.inputs[0].values[k]);
    }
    text
}

fn value(found: &serde_json::Value, name: &str) -> (f64, f64) {
    let parameters = found["parameters"].as_array().unwrap();
    let parameter = parameters.iter().find(|p| p["name"] == name).unwrap();
    (
        parameter["value"].as_f64().unwrap(),
        parameter["std_error"].as_f64().unwrap_or(f64::NAN),
    )
}

/// Every method of `all` says what it finds in a file with bad cells, or why it does not.
#[test]
fn all_methods_side_by_side() {
    let place = Place::new();
    let record = without_some(NOISY.record(ROWS, 3), 3);
    place.write("bad.csv", csv(&record, |_| false));
    let text = place
        .succeeds("identify bad.csv --method all --order 2,0 --json all.json --report all.html");
    assert!(text.contains("missing"), "{text}");
    let found = place.json("all.json");
    let methods = found["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 8);
    for method in methods {
        let done = !method["found"].is_null();
        let why = method["refused"].as_str().unwrap_or_default();
        assert!(
            done || why.contains("missing") && why.contains("srivc"),
            "{method}"
        );
    }
    let done = methods.iter().filter(|method| !method["found"].is_null());
    assert!(done.count() >= 6);
}

/// A block of rows is missing in the file: the record is cut there, and the parts share the offset.
#[test]
fn missing_rows() {
    let place = Place::new();
    // Time constants of 20 and 30 s: the input is held over one row.
    let plant = Plant {
        rest: (5.0, 40.0),
        a: &[1.0, 50.0, 600.0],
        ..NOISY
    };
    let record = without_some(plant.record(ROWS, 4), 4);
    place.write(
        "rows.csv",
        csv(&record, |k| (700..760).contains(&k) || k == 300),
    );
    for method in ["srivc", "rivc", "fcloe", "stabilized-oe"] {
        let text = place.succeeds(&format!(
            "identify rows.csv --method {method} --order 2,0 --json found.json"
        ));
        assert!(text.contains("61 rows are missing in 2 places"), "{text}");
        let found = place.json("found.json");
        assert_eq!(found["gaps"]["cut"].as_u64(), Some(1), "{method}");
        for (name, truth) in [("a1", 50.0), ("b0", 3.0)] {
            let (value, error) = value(&found, name);
            assert!(
                (value - truth).abs() < 4.0 * error,
                "{method} {name}: {value} {error}"
            );
            assert!(error < 0.2 * truth, "{method} {name}: {error}");
        }
        let parameters = found["parameters"].as_array().unwrap();
        assert!(
            parameters.iter().all(|p| p["name"] != "offset_2"),
            "{method}"
        );
    }
}

/// A single missing reading changes the estimates by less than their standard errors, and no method needs it.
#[test]
fn one_missing_reading() {
    let record = NOISY.record(600, 5);
    let mut lacks = record.clone();
    lacks.outputs[0].values[100] = f64::NAN;
    for method in [
        Method::StabilizedOe,
        Method::CtRls,
        Method::Ls,
        Method::Iv,
        Method::Fcloe,
        Method::RecursiveFcloe,
        Method::Srivc,
        Method::Rivc,
    ] {
        let request = Request::new(method, Order { n: 2, m: 0 });
        let of = |record: &Record| -> Identification { identify(record, &request).unwrap() };
        let (whole, lacks) = (of(&record), of(&lacks));
        for (a, b) in whole.parameters.iter().zip(&lacks.parameters) {
            let unit = a.std_error.unwrap_or(0.1 * a.value.abs());
            assert!(
                (a.value - b.value).abs() < unit,
                "{}: {a:?} {b:?}",
                method.id()
            );
        }
        assert_ne!(whole.parameters, lacks.parameters, "{}", method.id());
    }
}

#[test]
fn too_few_readings_are_refused() {
    let place = Place::new();
    let mut record = NOISY.record(300, 6);
    for (k, y) in record.outputs[0].values.iter_mut().enumerate() {
        if k % 100 != 50 {
            *y = f64::NAN;
        }
    }
    place.write("three.csv", csv(&record, |_| false));
    for method in [
        "stabilized-oe",
        "ct-rls",
        "ls",
        "iv",
        "fcloe",
        "recursive-fcloe",
        "srivc",
        "rivc",
        "all",
    ] {
        place.refuses(
            &format!("identify three.csv --method {method} --order 2,0"),
            &["three.csv", "3 ", "reading"],
        );
    }
    record.outputs[0].values.fill(f64::NAN);
    place.write("none.csv", csv(&record, |_| false));
    place.refuses("identify none.csv --method srivc", &["none.csv", "y [cm]"]);
}
