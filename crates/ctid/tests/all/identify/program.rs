//! The program: its files and errors.

use ct_signals::{ReadOptions, Reading, read_csv};
use ctid::sentences::of_identification;
use linear_identification::{Method, Order, Request, identify};

use super::{FIRST, SECOND, found};
use crate::common::{Place, bundled};

#[test]
fn the_program_writes_what_it_prints() {
    let place = Place::new();
    for method in ["ct-rls", "stabilized-oe"] {
        let text = place.succeeds(&format!(
            "identify tour.csv --method {method} --order 1,0 --json out.json --report out.html"
        ));
        assert!(
            text.contains("Simulation error of the final model"),
            "{text}"
        );
        assert!(text.contains("not a prediction error") || text.contains("prediction error)"));
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "wider than 80: {line}");
        }
        let json = place.json("out.json");
        assert_eq!(json["schema"], 2);
        assert_eq!(
            json["sentences"].as_array().unwrap().len(),
            json["warnings"].as_array().unwrap().len()
        );
        assert_eq!(json["method"], method);
        let names: Vec<&str> = json["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p["name"].as_str().unwrap())
            .collect();
        assert_eq!(names, ["a1", "b0", "offset"]);
        assert!(json["simulation_rmse"].as_f64().unwrap() > 0.0);
        let page = place.read("out.html");
        assert!(page.starts_with(&ctid::report::head()));
        assert!(page.contains("id=\"plot-fit\"") && page.contains("id=\"plot-trajectory\""));
        assert!(!page.contains("http://") && !page.contains("https://"));
    }
    let by_model = place.result("identify tour.csv --method ct-rls --model tour.toml");
    let by_name = place.result("identify tour.csv --method ct-rls --columns t,u,y");
    assert_eq!(by_model["parameters"], by_name["parameters"]);
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::new();
    let bad = |words: &str, says: &[&str]| {
        place.refuses(&format!("identify {words}"), says);
    };
    bad(
        "tour.csv --method ct-rls --order 5,0",
        &["n from 1 to 4", "5,0"],
    );
    bad("tour.csv --method ct-rls --order 1,2", &["m from 0 to n"]);
    bad("tour.csv --method ct-rls --order two", &["as in 2,1"]);
    bad("tour.csv --method arx", &["stabilized-oe", "ct-rls"]);
    bad("tour.csv", &["--method"]);
    bad("none.csv --method ct-rls", &["none.csv"]);
    bad(
        "tour.csv other.csv --method ct-rls",
        &["one record, and 2 are given", "the longest"],
    );
    bad(
        "tour.csv --method ct-rls --memory 0",
        &["--memory is 0", "above 0"],
    );
    bad(
        "tour.csv --method ct-rls --bandwidth nan",
        &["--bandwidth is NaN"],
    );
    for bandwidth in ["1e-9", "1e-300", "1e300"] {
        for method in ["ct-rls", "stabilized-oe", "ct-rls,stabilized-oe"] {
            bad(
                &format!("tour.csv --method {method} --bandwidth {bandwidth}"),
                &["--bandwidth is", "for this record"],
            );
        }
    }
    let slow = place.succeeds("identify tour.csv --method ct-rls --bandwidth 1e-4");
    assert!(slow.contains("suppresses a time constant"), "{slow}");
    assert!(!slow.contains("NaN"), "{slow}");
    bad(
        "tour.csv --method ct-rls --columns t,u",
        &["three names are needed"],
    );
    bad(
        "tour.csv --method ct-rls --columns t,u,z",
        &["tour.csv", "z"],
    );
    bad("tour.csv --method ct-rls --model none.toml", &["none.toml"]);
    bad(
        "tour.csv --method ct-rls --json tour.csv",
        &["one of the inputs"],
    );
    bad(
        "tour.csv --method ct-rls --model tour.toml --hold first",
        &["cannot be used with"],
    );

    let short: Vec<&str> = bundled("tour.csv").leak().lines().take(24).collect();
    place.write("short.csv", short.join("\n"));
    bad(
        "short.csv --method ct-rls --order 4,4",
        &["short.csv", "23"],
    );
    let still: String = (0..200).map(|k| format!("{k},1.5,{}\n", k % 7)).collect();
    place.write("still.csv", format!("t,u,y\n{still}"));
    bad(
        "still.csv --method stabilized-oe",
        &["still.csv", "the input is 1.5 in all 200 rows"],
    );
    place.write("dead.csv", format!("t,y,u\n{still}"));
    bad(
        "dead.csv --method stabilized-oe",
        &["the output is 1.5 in all 200 rows"],
    );
}

/// The advice is possible: there is no order below the first.
#[test]
fn no_order_below_the_first_is_advised() {
    let mut record = FIRST.record(4000, 5);
    for y in &mut record.outputs[0].values[2000..] {
        *y = 40.0 + 2.0 * (*y - 40.0);
    }
    let warnings =
        |order| of_identification(&found(&record, Method::StabilizedOe, order)).join("; ");
    let first = warnings(FIRST.order());
    assert!(first.contains("try a longer --memory"), "{first}");
    assert!(!first.contains("lower"), "{first}");
    let second = warnings(SECOND.order());
    assert!(second.contains("or a lower --order"), "{second}");
}

/// The measured tanks, if they are next to the checkout: half an hour at one level in a record of one hour shows no drift, and the program
/// does not claim that there is none.
#[test]
fn a_record_too_short_to_tell_is_called_so() {
    let tanks = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/cascaded_tanks/estimation.csv");
    let columns = ct_signals::Columns::default();
    let Ok(Reading { record, .. }) = read_csv(&tanks, &columns, &ReadOptions::default()) else {
        eprintln!("skipped: {} is not there", tanks.display());
        return;
    };
    for order in [Order { n: 1, m: 0 }, Order { n: 2, m: 0 }] {
        let found = found(&record, Method::StabilizedOe, order);
        let drift = found.drift.as_ref().unwrap();
        assert!(!drift.moves() && !drift.tells(), "{drift:?}");
        let text = ctid::identify::text::text(&found, ctid::look::Look::plain());
        assert!(text.contains("too short to tell"), "{text}");
        assert!(!text.contains("do not change with the level"), "{text}");
    }
}

/// Records without a file are checked too.
#[test]
fn a_record_that_stands_still_is_refused() {
    let mut record = FIRST.record(200, 1);
    record.inputs[0].values.fill(1.5);
    let request = Request::new(Method::CtRls, FIRST.order());
    let error = identify(&record, &request).unwrap_err().to_string();
    assert!(error.contains("\"u\" is constant at 1.5"), "{error}");
    assert!(error.contains("record at least a step"), "{error}");
}
