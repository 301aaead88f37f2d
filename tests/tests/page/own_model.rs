//! A user's own model with the mouse: an example, a mistake in its text that is mended, a record and a text that are dropped.

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
    // One letter is enough: an example is loaded as soon as it is chosen, so that a further key would choose the next one.
    browser.evaluate("document.getElementById('example').focus()");
    browser.type_text("c");
    browser.until("document.getElementById('own-text').value.includes('CoupledHeaters')");
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
    // Its ports are listed, without effects.
    assert_eq!(
        browser.evaluate(
            "[...document.querySelectorAll('#own-ports tbody th')].filter((one) => one.innerText === 'input').length"
        ),
        json!(3)
    );
    assert_eq!(browser.text("#own-ports td:last-child").trim(), "");
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
    assert!(browser.text("#next").contains("correct the text"));
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

/// What a plant has and a user's own model has not yet is refused, and a model file names no file of the machine.
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
    let refused = posted("/api/run", json!({ "what": "chain", "effects": [] }));
    assert_eq!(refused.status, 422);
    assert!(
        refused
            .error()
            .contains("not on the page for models of your own yet")
    );
    // What cannot act there is refused with what may have been meant, and the file stays.
    let before = tab.state()["own"]["file"].clone();
    let refused = posted("/api/own", json!({ "do": "add", "effect": "lagg(y)" }));
    assert_eq!(refused.status, 422);
    assert!(refused.error().contains("did you mean lag(y)?"));
    assert_eq!(tab.state()["own"]["file"], before);
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

/// The heated block of the examples, its capacity known.
fn block() -> String {
    let path = format!(
        "{}/../examples/models/heated-block.mo",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    text.replace("parameter Real C(", "final parameter Real C(")
}

/// A record of the block whose sensor lags by 25 s.
fn lagging() -> String {
    let mut text = String::from("t [s],u [%],Ta [degC],y [degC]\n");
    let (mut warm, mut read) = (20.0, 20.0);
    for k in 0..400_usize {
        let u = (((k / 17) * 7919) % 13) as f64 * 3.0;
        let room = 15.0 + 4.0 * (0.013 * k as f64).sin();
        // Something that looks like noise and is the same everywhere.
        let noise = (((k * 7919 + 13) % 101) as f64 / 50.0 - 1.0) * 0.1;
        text += &format!("{},{u},{room:.4},{:.4}\n", 5 * k, read + noise);
        for _ in 0..500 {
            read += 0.01 * (warm - read) / 25.0;
            warm += 0.01 * (0.4 * u - 0.2 * (warm - room)) / 50.0;
        }
    }
    text
}

/// What is missing in a user's own model is found at its port, added with its sizes, and the error falls.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn a_model_of_ones_own_is_diagnosed_and_mended() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let folder = browser.folder.path().to_path_buf();
    let (record, text) = (folder.join("rows.csv"), folder.join("block.mo"));
    std::fs::write(&record, lagging()).unwrap();
    std::fs::write(&text, block()).unwrap();
    browser.drop_files("#drop-fitted", &[&record, &text]);
    browser.until("document.getElementById('own-text').value.includes('final parameter') && !document.getElementById('own-fit').disabled");
    browser.click("#own-fit");
    wait_for_fit(&mut browser, 1);
    let error = "Number(document.querySelector('#own-errors td').innerText)";
    let before = browser.evaluate(error).as_f64().unwrap();
    browser.click("#own-diagnose");
    browser.until("document.querySelector('#own-findings .groups li') && document.getElementById('working').hidden");
    let found = browser.text("#own-findings");
    assert!(
        found.contains("lag(y) at the output y, which reads T (block)"),
        "{found}"
    );
    // The row of its port in the table of ports.
    let sits = browser.evaluate(
        "[...document.querySelectorAll('#own-ports tbody tr')].filter((row) => row.lastChild.innerText.includes('found')).map((row) => row.children[0].innerText)",
    );
    assert!(!sits.as_array().unwrap().is_empty(), "{sits}");
    browser.picture("own-found");
    browser.click("#own-found-0");
    browser.until("document.getElementById('own-file').value.includes('[effect.')");
    wait_for_fit(&mut browser, 1);
    let after = browser.evaluate(error).as_f64().unwrap();
    assert!(before > 5.0 * after && after < 0.12, "{before} {after}");
    assert!(browser.text("#own-ports").contains("in the model"));
    for (width, height) in [(1400, 1000), (390, 844)] {
        browser.look(width, height, "light");
        browser.until("document.documentElement.scrollWidth <= innerWidth");
        browser.picture(&format!("own-mended-{width}"));
    }
    browser.assert_quiet(&address);
}
