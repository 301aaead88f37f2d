//! Cancelled computations stop.

use std::thread::sleep;
use std::time::Duration;

use ctid_tests::Rig;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::json;

use crate::server::{Tab, alone, csv, serve};

/// Threads that compute in this process, where the system lists them.
fn computing() -> Option<usize> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?.flatten();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    Some(names.filter(|name| name.trim() == "ctid computes").count())
}

/// Waits until nothing is computed.
fn gone(why: &str) {
    for _ in 0..2400 {
        match computing() {
            None => return println!("skipped: this system does not list threads"),
            Some(0) => return,
            Some(_) => sleep(Duration::from_millis(50)),
        }
    }
    panic!("it goes on computing after {why}");
}

/// A record whose diagnosis takes far longer than this test.
fn long_record() -> String {
    let rig = Rig {
        samples: 4000,
        colour: 0.9,
        hidden: vec![
            ("pump_deadzone", 0, vec![1.0]),
            ("sensor_lag", 0, vec![15.0]),
        ],
        ..Rig::cascaded_tanks()
    };
    csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)))
}

#[test]
fn what_is_cancelled_stops() {
    let _alone = alone();
    let page = serve(&[]);
    let tab = Tab::open(&page);
    assert_eq!(
        tab.post("/api/record?name=long.csv", long_record().as_bytes())
            .status,
        200
    );
    assert_eq!(
        tab.post("/api/settings", br#"{"plant": "cascaded-tanks"}"#)
            .status,
        200
    );
    let begin = || {
        let answer = tab.post("/api/run", br#"{"what": "diagnose"}"#);
        assert_eq!(answer.status, 200, "{answer:?}");
        tab.until("searching", |state| {
            state["job"]["phase"] == "searching sets of effects"
        });
    };
    begin();
    assert_eq!(tab.post("/api/cancel", b"{}").json()["job"], json!(null));
    gone("it was cancelled");
    let state = tab.state();
    assert!(
        state["diagnosis"].is_null() && state["failure"].is_null(),
        "{state}"
    );
    // One computation per tab: the next one replaces the first.
    begin();
    tab.post("/api/run", br#"{"what": "compare"}"#);
    assert!(computing().is_none_or(|count| count <= 2));
    tab.post("/api/cancel", b"{}");
    gone("another took its place");
    // A dropped tab stops its computation.
    begin();
    let _others: Vec<Tab> = (0..8).map(|_| Tab::open(&page)).collect();
    assert_eq!(tab.get("/api/state").status, 410);
    gone("its tab was forgotten");
}

/// A fit of a model that has become another one is of no use: it ends at once, and one of the same model goes on.
#[test]
fn a_fit_of_an_older_model_stops() {
    let _alone = alone();
    let tab = Tab::open(&serve(&[]));
    let record = long_record();
    assert_eq!(
        tab.post("/api/record?name=long.csv", record.as_bytes())
            .status,
        200
    );
    let text = "plant = 'cascaded-tanks'\n";
    let written = |from: &str, text: &str| {
        let body = json!({ "text": text, "from": from }).to_string();
        let answer = tab.post("/api/text", body.as_bytes());
        assert_eq!(answer.status, 200, "{answer:?}");
        answer.json()
    };
    let begin = |body: &str| {
        let answer = tab.post("/api/run", body.as_bytes());
        assert_eq!(answer.json()["job"]["what"], "compare", "{answer:?}");
    };
    written("", text);
    begin(r#"{"what": "compare"}"#);
    let commented = format!("# ours\n{text}");
    assert_eq!(written(text, &commented)["job"]["what"], "compare");
    let answer = tab
        .post("/api/effect", br#"{"do": "add", "effect": "overflow"}"#)
        .json();
    assert!(
        answer["job"].is_null() && answer["failure"].is_null(),
        "{answer}"
    );
    gone("its model became another");
    // Other effects beside the model are fitted whatever effects it has, but not to another plant.
    begin(r#"{"what": "chain", "effects": [["sensor_lag", null]]}"#);
    let answer = tab
        .post("/api/effect", br#"{"do": "remove", "effect": "overflow"}"#)
        .json();
    assert_eq!(answer["job"]["what"], "compare");
    let now = answer["text"].as_str().unwrap().to_string();
    assert!(written(&now, "plant = 'first-order'\n")["job"].is_null());
    gone("its plant became another");
}
