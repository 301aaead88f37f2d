//! Choices that the commands have as options: simulation of a loop, number of effects, and the unexplained error to keep.

use ctid_tests::{Drive, Rig};
use plants::{Fitted, Place, Term, Variable};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::{Value, json};

use crate::browser::Browser;
use crate::click_path::{choose_measured_tank, wait_for_models};
use crate::server::{Tab, alone, command, csv, serve};

/// A tank in a loop, its model file with the controller, and the results of `ctid compare` with both settings.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn a_loop_is_treated_in_both_ways() {
    let rig = Rig {
        drive: Drive::Closed,
        samples: 400,
        ..Rig::single_tank()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (data, model) = (path("loop.csv"), path("tank.toml"));
    std::fs::write(&data, csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)))).unwrap();
    let text = "plant = \"single-tank\"\n[known]\narea = 154\n[controller]\ntype = \"PI\"\ngain = 0.4\nintegral_time = 120\nu_min = 0\nu_max = 10\n";
    std::fs::write(&model, text).unwrap();
    let compared = |way: &str| -> Value {
        let json = path(&format!("{way}.json"));
        command(&[
            "compare", &data, "--model", &model, "--loop", way, "--json", &json,
        ]);
        serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap()
    };
    let _alone = alone();
    let ways = ["simulated", "measured"].map(|way| (way, compared(way)));
    assert_ne!(ways[0].1["steps"][0]["rmse"], ways[1].1["steps"][0]["rmse"]);

    let page = serve(&[&data, "--model", &model]);
    let tab = Tab::open(&page);
    let mut fits = Vec::new();
    for (way, compared) in &ways {
        let body = json!({ "measured": *way == "measured" }).to_string();
        let state = tab.post("/api/loop", body.as_bytes()).json();
        assert!(state["current"].is_null(), "{state}");
        assert_eq!(tab.post("/api/run", br#"{"what": "compare"}"#).status, 200);
        let state = tab.until("fitted", |state| !state["current"].is_null());
        assert_eq!(
            state["trail"][0]["errors"][0]["rmse"], compared["steps"][0]["rmse"],
            "{way}"
        );
        fits.push(state["current"].clone());
    }
    // The way back is not computed again.
    let state = tab.post("/api/loop", br#"{"measured": false}"#).json();
    assert_eq!(state["current"], fits[0]);

    let address = page.to_string();
    let mut browser = Browser::open(&address);
    wait_for_models(&mut browser, 1);
    let parameters = "document.getElementById('parameters').innerText";
    let simulated = browser.evaluate(parameters);
    browser.evaluate("document.querySelector('#controller').open = true");
    browser.choose("loop", "r", "value === 'measured'");
    browser.until(&format!("{parameters} !== {simulated}"));
    wait_for_models(&mut browser, 1);
    browser.picture("loop");
    browser.assert_quiet(&address);
}

/// A tank with a wave in its balance that no effect describes.
fn wave(seed: u64) -> String {
    let knots: Vec<f64> = (0..160).map(|i| 0.25 * f64::from(i)).collect();
    let rig = Rig {
        terms: vec![Term {
            name: "wave".to_string(),
            place: Place::Vessel,
            vessel: 0,
            variable: Variable::Level,
            ordinates: knots.iter().map(|h| 2.5 * (1.1 * h).sin()).collect(),
            knots,
            fitted: Fitted::Scale,
        }],
        samples: 900,
        ..Rig::single_tank()
    };
    csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(seed)))
}

/// The shape of the unexplained error is drawn, kept under a name, taken out and put back.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn the_unexplained_is_kept_by_name() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let file = browser.folder.path().join("wave.csv");
    std::fs::write(&file, wave(1)).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("document.querySelector('#records li')");
    choose_measured_tank(&mut browser);
    browser.click("#most");
    browser.type_text("0");
    browser.click("#diagnose");
    browser.until("document.getElementById('failure').innerText.includes('from 1 to 255')");
    browser.press("Tab", 9, "");
    browser.evaluate("document.getElementById('most').value = '3'");
    browser.click("#diagnose");
    browser.until("document.querySelector('#keep-name')");
    browser.until("[...document.querySelectorAll('#unknown-figures .plot')].some((one) => one.data) && [...document.querySelectorAll('#unknown-figures .plot')].every((one) => one.data)");
    browser.picture("unexplained");
    browser.click("#keep-name");
    browser.type_text("no name");
    browser.click("#keep");
    browser.until("!document.getElementById('failure').hidden");
    let refused = browser.text("#failure");
    assert!(refused.contains("no name"), "{refused}");
    browser.evaluate("document.getElementById('keep-name').value = ''");
    browser.click("#keep-name");
    browser.type_text("wave");
    browser.press("Enter", 13, "\r");
    wait_for_models(&mut browser, 2);
    let fell = crate::click_path::trail(&mut browser);
    println!("simulation error {fell:?} cm");
    assert!(fell[1] < 0.5 * fell[0], "{fell:?}");
    assert!(browser.text("#trail").contains("+ wave"));
    assert!(browser.text("#findings").contains("Added as wave"));
    browser.picture("kept");
    browser.click("#effects button[aria-label='Remove wave']");
    wait_for_models(&mut browser, 1);
    browser.evaluate("document.getElementById('any-effect').value = JSON.stringify({ effect: 'wave', place: null })");
    browser.click("#add-any");
    wait_for_models(&mut browser, 2);
    // The server reported the error, which the browser logs.
}

#[test]
fn so_many_effects_and_no_more() {
    let rig = Rig {
        samples: 1000,
        hidden: vec![("pump_lag", 0, vec![25.0]), ("overflow", 0, vec![17.0])],
        ..Rig::single_tank()
    };
    let _alone = alone();
    let tab = Tab::open(&serve(&[]));
    let record = csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)));
    assert_eq!(
        tab.post("/api/record?name=a.csv", record.as_bytes()).status,
        200
    );
    assert_eq!(
        tab.post("/api/settings", br#"{"plant": "single-tank"}"#)
            .status,
        200
    );
    for none in ["0", "-1", "256", "1.5"] {
        let body = format!(r#"{{"what": "diagnose", "max_effects": {none}}}"#);
        assert_eq!(tab.post("/api/run", body.as_bytes()).status, 422, "{none}");
    }
    let found = |most: &str| {
        let body = format!(r#"{{"what": "diagnose", "max_effects": {most}}}"#);
        assert_eq!(tab.post("/api/run", body.as_bytes()).status, 200);
        let state = tab.until("diagnosed", |state| state["job"].is_null());
        state["diagnosis"]["groups"].as_array().unwrap().len()
    };
    let all = found("null");
    assert!(all > 1, "{all}");
    assert_eq!(found("1"), 1);
}
