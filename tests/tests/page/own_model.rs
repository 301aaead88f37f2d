//! A model of one's own with the mouse: an example, a mistake in its text that is mended, a record and a text that are dropped.

use serde_json::json;

use crate::browser::Browser;
use crate::server::{Tab, alone, serve};

/// A fit is drawn.
fn wait_for_fit(browser: &mut Browser, outputs: usize) {
    browser.until(&format!(
        "document.querySelectorAll('#own-figures .js-plotly-plot').length === {outputs} && !document.querySelector('.see.stale') \
         && document.getElementById('working').hidden && !document.getElementById('fall').hidden"
    ));
}

#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn an_example_is_fitted_and_its_text_is_changed() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    browser.choose(
        "example",
        "c",
        "value === '' && document.getElementById('own-text').value.includes('CoupledHeaters')",
    );
    wait_for_fit(&mut browser, 2);
    // An error for each output, and every fitted parameter with its standard error.
    assert_eq!(
        browser.evaluate(
            "[...document.querySelectorAll('#own-errors tbody th')].map((one) => one.innerText)"
        ),
        json!(["y1", "y2"])
    );
    assert!(browser.text("#own-parameters").contains("UA"));
    assert!(browser.text("#own-check").starts_with("CoupledHeaters"));
    assert!(
        browser
            .text("#own")
            .contains("is not asked here for models of your own yet")
    );
    for part in ["missing", "chains-part", "trail-part", "model"] {
        assert_eq!(
            browser.evaluate(&format!("document.getElementById('{part}').hidden")),
            json!(true)
        );
    }
    for (width, height) in [(1400, 1000), (390, 844)] {
        browser.look(width, height, "light");
        browser.until("document.documentElement.scrollWidth <= innerWidth");
        browser.picture(&format!("own-{width}"));
    }
    browser.look(1400, 1000, "light");

    // A letter too much is said with its place; what was fitted stays in sight, and is said to be of another text.
    browser.evaluate("(() => { const t = document.getElementById('own-text'); t.focus(); const at = t.value.indexOf('UA*'); t.setSelectionRange(at, at); })()");
    browser.type_text("U");
    browser.until("document.getElementById('own-text-error').innerText.startsWith('Line ')");
    assert!(
        browser
            .text("#own-text-error")
            .contains("`UUA` is not declared")
    );
    assert_eq!(
        browser.evaluate("document.getElementById('own-fit').disabled"),
        json!(true)
    );
    assert!(browser.text("#next").contains("mend the text"));
    browser.press("Backspace", 8, "");
    browser.until("document.getElementById('own-text-error').hidden && !document.getElementById('own-fit').disabled");
    browser.click("#own-fit");
    wait_for_fit(&mut browser, 2);
    browser.assert_quiet(&address);
}

#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn a_text_and_a_record_are_dropped_and_the_columns_chosen() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let folder = browser.folder.path().to_path_buf();
    let example = |name: &str| {
        let path = format!("{}/../examples/models/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).unwrap()
    };
    let (record, text) = (folder.join("rows.csv"), folder.join("block.mo"));
    std::fs::write(&record, example("heated-block.csv")).unwrap();
    // The capacity is measured here: there is no model file that says so.
    let own = example("heated-block.mo").replace("parameter Real C(", "final parameter Real C(");
    std::fs::write(&text, own).unwrap();
    browser.drop_files("#drop-fitted", &[&record, &text]);
    browser.until("document.getElementById('own-text').value.includes('final parameter')");
    browser.until("document.querySelector('#records .alert')");
    for (signal, letter, header) in [
        ("u", "h", "heater [%]"),
        ("Ta", "r", "room [degC]"),
        ("y", "b", "block [degC]"),
    ] {
        browser.choose(
            &format!("own-column-{signal}"),
            letter,
            &format!("value === '{header}'"),
        );
        let written = json!(format!("{signal} = \"{header}\""));
        browser.until(&format!(
            "document.getElementById('own-file').value.includes({written})"
        ));
    }
    browser.evaluate("document.activeElement.blur()");
    browser.until("!document.getElementById('own-fit').disabled");
    browser.click("#own-fit");
    wait_for_fit(&mut browser, 1);
    // Back to the plants: the record stays.
    browser.click("#own-end");
    browser
        .until("document.getElementById('own').hidden && !document.getElementById('model').hidden");
    browser.assert_quiet(&address);
}

/// What a plant has and a model of one's own has not yet is refused, and a model file names no file of the machine.
#[test]
fn what_is_not_there_yet_is_refused() {
    let page = serve(&[]);
    let _alone = alone();
    let tab = Tab::open(&page);
    let posted = |path: &str, body: serde_json::Value| tab.post(path, body.to_string().as_bytes());
    posted(
        "/api/own",
        json!({ "do": "example", "name": "heated-block" }),
    );
    for what in [
        json!({ "what": "diagnose" }),
        json!({ "what": "chain", "effects": [] }),
    ] {
        let refused = posted("/api/run", what);
        assert_eq!(refused.status, 422);
        assert!(
            refused
                .error()
                .contains("not on the page for models of your own yet")
        );
    }
    let file = "model = \"/etc/passwd\"\n[known]\nC = 52.0\n";
    let state = posted("/api/own", json!({ "do": "write", "file": file })).json();
    assert_eq!(state["own"]["file_error"], json!(null));
    assert!(!state.to_string().contains("root:"));
    let refused = posted(
        "/api/own",
        json!({ "do": "example", "name": "../../../etc/passwd" }),
    );
    assert_eq!(refused.status, 422);
    // A text of the largest request is looked at, and one beyond it is not.
    let deep = format!(
        "model M\n output Real y = {}1{};\nend M;",
        "(".repeat(200_000),
        ")".repeat(200_000)
    );
    let state = posted("/api/own", json!({ "do": "write", "text": deep })).json();
    assert!(state["own"]["text_error"].is_string());
    let large = posted(
        "/api/own",
        json!({ "do": "write", "text": " ".repeat(1 << 21) }),
    );
    assert_eq!(large.status, 413);
}
