//! Inputs that the page requests and questions to the page: the plant, if it alone is missing, and the best result so far.

use ctid_tests::Rig;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::json;

use crate::browser::Browser;
use crate::click_path::{choose_plant, wait_for_models};
use crate::server::{Tab, alone, csv, serve};

/// A tank's record with a header without meaning.
fn unnamed() -> String {
    let rig = Rig {
        samples: 300,
        ..Rig::single_tank()
    };
    let text = csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)));
    let (_, rows) = text.split_once('\n').unwrap();
    format!("c1,c2,c3\n{rows}")
}

#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn the_plant_is_asked_for_where_it_alone_is_missing() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let file = browser.folder.path().join("unnamed.csv");
    std::fs::write(&file, unnamed()).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("document.getElementById('columns').open");
    let hidden = "document.getElementById('plant-missing').hidden";
    for (role, column) in [("time", "c1"), ("input", "c2"), ("output", "c3")] {
        assert_eq!(browser.evaluate(hidden), json!(true), "{role}");
        let wanted = format!("value === '{column}'");
        browser.choose(&format!("column-{role}"), "c", &wanted);
    }
    browser.until("!document.getElementById('plant-missing').hidden");
    assert!(
        browser
            .text("#plant-missing")
            .starts_with("Choose the plant")
    );
    browser.picture("plant-missing");
    // Directly below its field, both visible, and linked to the field for screen readers.
    let seen = browser.evaluate(
        "(() => { const [field, said] = ['plant', 'plant-missing'].map((id) => document.getElementById(id).getBoundingClientRect());
          return [field.top, field.bottom, said.top, said.bottom, innerHeight]; })()",
    );
    let seen: Vec<f64> = serde_json::from_value(seen).unwrap();
    assert!(seen[0] >= 0.0 && seen.is_sorted(), "{seen:?}");
    assert!(seen[2] - seen[1] < 40.0, "{seen:?}");
    let invalid = "document.getElementById('plant').getAttribute('aria-invalid')";
    assert_eq!(browser.evaluate(invalid), json!("true"));
    choose_plant(&mut browser, "single-tank");
    wait_for_models(&mut browser, 1);
    assert_eq!(browser.evaluate(hidden), json!(true));
    assert_eq!(browser.evaluate(invalid), json!("false"));
    // The columns that were chosen are those of the model.
    assert!(browser.text("#text").is_empty() || browser.text("#text").contains("c2"));
    browser.assert_quiet(&address);
}

/// The effort of a search, and its interruption.
#[test]
fn a_search_has_an_effort_and_an_end() {
    let _alone = alone();
    let tab = Tab::open(&serve(&[]));
    let rig = Rig {
        samples: 3000,
        colour: 0.9,
        hidden: vec![
            ("pump_deadzone", 0, vec![1.0]),
            ("sensor_lag", 0, vec![15.0]),
        ],
        ..Rig::cascaded_tanks()
    };
    let record = csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)));
    let sent = tab.post("/api/record?name=a.csv", record.as_bytes());
    assert_eq!(sent.status, 200);
    let set = tab.post("/api/settings", br#"{"plant": "cascaded-tanks"}"#);
    assert_eq!(set.status, 200);
    let unknown = tab.post("/api/run", br#"{"what": "diagnose", "effort": "endless"}"#);
    assert_eq!(unknown.status, 422);
    for (body, limit) in [
        (r#"{"what": "diagnose", "effort": "quick"}"#, json!(5)),
        (r#"{"what": "diagnose", "effort": "thorough"}"#, json!(600)),
        (r#"{"what": "diagnose"}"#, json!(40)),
        (r#"{"what": "compare"}"#, json!(null)),
    ] {
        let state = tab.post("/api/run", body.as_bytes()).json();
        assert_eq!(state["job"]["limit"], limit, "{body}");
        assert_eq!(state["job"]["ending"], false, "{body}");
    }
    let state = tab.post("/api/run", br#"{"what": "diagnose"}"#).json();
    assert_eq!(state["job"]["ending"], false);
    assert_eq!(tab.post("/api/finish", b"{}").json()["job"]["ending"], true);
    tab.post("/api/cancel", b"{}");
}
