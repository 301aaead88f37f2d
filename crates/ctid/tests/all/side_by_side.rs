//! Methods and orders side by side.

#![allow(clippy::unwrap_used)]

use crate::common::Place;
use crate::identify::{FIRST, Plant, SECOND};
use ct_signals::Record;
use linear_identification::side_by_side::{Orders, Row, SideBySide, Violation, compare};
use linear_identification::{Error, Method, Order, Request, mend};

fn all(record: &Record, test: &[Record], orders: &str) -> SideBySide {
    let orders: Orders = orders.parse().unwrap();
    let methods = [
        Method::StabilizedOe,
        Method::CtRls,
        Method::Ls,
        Method::Iv,
        Method::Fcloe,
        Method::RecursiveFcloe,
    ];
    let requests = methods.map(|method| Request::new(method, orders.0[0]));
    let (fitted, test) = mend(vec![record.clone()], test.to_vec(), orders.0[0], false).unwrap();
    let records = (&fitted[0], &test[..], false);
    let worded = |error: Error| error.to_string();
    compare(records, &requests, &orders.0, &worded, &|| {}).unwrap()
}

fn of(found: &SideBySide, method: Method) -> &Row {
    found
        .methods
        .iter()
        .find(|row| row.method == method)
        .unwrap()
}

#[test]
fn without_noise_all_methods_simulate_both_records_and_agree() {
    let (record, test) = (FIRST.record(2000, 1), FIRST.record(800, 2));
    let found = all(&record, &[test], "1,0");
    assert_eq!((found.methods.len(), found.orders.len()), (6, 0));
    for row in &found.methods {
        let outcome = row.found.as_ref().unwrap();
        assert!(outcome.fit_percent > 98.0, "{:?}", row.method);
        assert!(outcome.test_fit_percent.unwrap() > 98.0, "{:?}", row.method);
        assert!(
            (outcome.parameters[0].value - 20.0).abs() < 0.5,
            "{:?}",
            row.method
        );
        assert!(
            (outcome.parameters[1].value - 3.0).abs() < 0.05,
            "{:?}",
            row.method
        );
    }
}

#[test]
fn the_order_of_the_plant_is_chosen() {
    let plant = Plant {
        noise: 0.1,
        ..SECOND
    };
    for seed in 0..4 {
        let found = all(&plant.record(3000, seed), &[], "1..3");
        // n from 1 to 3, m below n
        assert_eq!(found.orders.len(), 6 * 6);
        for method in [Method::Fcloe, Method::StabilizedOe] {
            let row = of(&found, method);
            assert_eq!(row.order, Order { n: 2, m: 0 }, "{:?}", row.method);
            let outcome = row.found.as_ref().unwrap();
            assert!(
                outcome.determined && outcome.yic.unwrap() < -8.0,
                "{:?}",
                row.method
            );
        }
        // The first order leaves what the input did.
        let first = found
            .orders
            .iter()
            .find(|row| row.method == Method::Fcloe && row.order == Order { n: 1, m: 0 });
        let violated = &first.unwrap().found.as_ref().unwrap().violated;
        let depends =
            |it: &Violation| matches!(it, Violation::DependsOnInput { p_value } if *p_value < 0.01);
        assert!(violated.iter().any(depends), "{violated:?}");
    }
}

#[test]
fn noise_biases_least_squares_and_it_says_so() {
    let plant = Plant {
        noise: 0.5,
        ..SECOND
    };
    let found = all(&plant.record(3000, 3), &[], "2,0");
    let rls = of(&found, Method::CtRls).found.as_ref().unwrap();
    let biased = |it: &Violation| matches!(it, Violation::WorseThanLeast { rmse, least } if *rmse == rls.rmse && rmse > least);
    assert!(rls.violated.iter().any(biased), "{:?}", rls.violated);
    let fcloe = of(&found, Method::Fcloe).found.as_ref().unwrap();
    assert!(fcloe.violated.is_empty(), "{:?}", fcloe.violated);
    // In the order of their errors.
    let errors: Vec<f64> = found
        .methods
        .iter()
        .map(|row| row.found.as_ref().unwrap().rmse)
        .collect();
    assert!(errors.is_sorted(), "{errors:?}");
}

#[test]
fn the_program_sets_them_side_by_side() {
    let place = Place::new();
    let text = place.succeeds(
        "identify tour.csv --model tour.toml --method all --order 1..2 --test tour-test.csv --json a.json --report a.html",
    );
    for words in ["on test", "What each assumes", "Orders", "recursive-fcloe"] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    assert!(
        text.lines().all(|line| line.chars().count() <= 80),
        "{text}"
    );
    let json = place.json("a.json");
    assert_eq!(json["methods"].as_array().unwrap().len(), 8);
    assert_eq!(json["orders"].as_array().unwrap().len(), 8 * 3);
    assert_eq!(json["test"][0], "tour-test.csv");
    for row in json["methods"].as_array().unwrap() {
        assert!(row["found"]["test_rmse"].as_f64().unwrap() > 0.0, "{row}");
    }
    let page = place.read("a.html");
    assert!(page.contains("id=\"plot-fit\"") && page.contains("id=\"orders\""));
    // A name given twice counts once; an option of a single method is no error with several methods.
    let text = place
        .succeeds("identify tour.csv --model tour.toml --method ls,fcloe,ls,ct-rls --memory 300");
    assert_eq!(
        text.matches("  ls assumes").count() + text.matches("- ls assumes").count(),
        1,
        "{text}"
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::new();
    let identify = |rest: &str| format!("identify tour.csv --model tour.toml {rest}");
    place.refuses(&identify("--method ls --order 0..2"), &["0..2", "1 to 4"]);
    place.refuses(&identify("--method ls --order 3..2"), &["3..2"]);
    place.refuses(
        &identify("--method ls,nothing"),
        &["nothing", "stabilized-oe"],
    );
    place.refuses(
        &identify("--method all --test missing.csv"),
        &["missing.csv"],
    );
    place.refuses(
        &identify("--method all --test tour-test.csv --json tour-test.csv"),
        &["tour-test.csv"],
    );
    place.refuses(
        &identify("--method ct-rls,stabilized-oe --levels mean"),
        &["--levels", "ct-rls,stabilized-oe"],
    );
    place.refuses(
        &identify("--method iv,ls --memory 300"),
        &["--memory", "iv,ls"],
    );
    place.refuses(
        &identify("--method ct-rls,stabilized-oe --sensor-filter 0.5"),
        &["--sensor-filter"],
    );
    // A test record is an input and cannot be replaced by a result.
    place.succeeds(&identify("--method ls --json own.json"));
    place.refuses(
        &identify("--method all --test own.json --json own.json"),
        &["own.json"],
    );
    let rows = |unit: &str| {
        let rows: String = (0..60)
            .map(|k| format!("{k},{},{}\n", k / 7 % 2, k % 5))
            .collect();
        format!("t [s],u [V],y [{unit}]\n{rows}")
    };
    place.write("cm.csv", rows("cm"));
    place.write("mm.csv", rows("mm"));
    place.refuses(
        "identify cm.csv --method all --test mm.csv",
        &["mm.csv", "[mm]", "[cm]"],
    );
    // Twenty rows are too few for every method: one line.
    let few: String = rows("cm")
        .lines()
        .take(21)
        .map(|line| format!("{line}\n"))
        .collect();
    place.write("few.csv", few);
    place.refuses("identify few.csv --method all --order 4,4", &["few.csv"]);
}
