//! A file that another program has changed meanwhile is not overwritten.

use std::path::{Path, PathBuf};
use std::sync::MutexGuard;

use serde_json::json;
use tempfile::TempDir;

use crate::browser::Browser;
use crate::server::{Tab, alone, bundled, serve};

/// The bundled model in a folder of its own, and its text.
fn model() -> (TempDir, PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tank.toml");
    let text = std::fs::read_to_string(bundled("tour.toml")).unwrap();
    std::fs::write(&file, &text).unwrap();
    (folder, file, text)
}

fn type_over(browser: &mut Browser, id: &str, text: &str) {
    browser.click(&format!("#{id}"));
    browser.evaluate(&format!("document.getElementById('{id}').select()"));
    browser.type_text(text);
}

/// A page that shows a model file.
fn opened(file: &Path) -> (Browser, String, MutexGuard<'static, ()>) {
    let address = serve(&["--model", &file.display().to_string()]).to_string();
    let alone = alone();
    let mut browser = Browser::open(&address);
    browser.until("document.getElementById('known-area')?.value === '154'");
    (browser, address, alone)
}

/// Somebody is in a field when an editor writes the same field, and then another one.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn a_field_that_was_overtaken_is_filled_again_and_says_so() {
    let (_folder, file, text) = model();
    let (mut browser, _, _alone) = opened(&file);
    type_over(&mut browser, "known-area", "160");
    let newer = text.replace("154.0 ", "150.0 ");
    std::fs::write(&file, &newer).unwrap();
    browser.until("document.getElementById('text').textContent.includes('150.0')");
    assert_eq!(
        browser.evaluate("document.getElementById('known-area').value"),
        json!("160")
    );
    browser.press("Enter", 13, "\r");
    browser.until(
        "document.getElementById('model-error').innerText.includes('known.area changed meanwhile')",
    );
    assert_eq!(
        browser.evaluate("document.getElementById('known-area').value"),
        json!("150")
    );
    assert_eq!(std::fs::read_to_string(&file).unwrap(), newer);
    browser.picture("overtaken");
    // Said of what stands there now it is written.
    type_over(&mut browser, "known-area", "161");
    browser.press("Enter", 13, "\r");
    browser.until("document.getElementById('text').textContent.includes('161') && document.getElementById('model-error').hidden");
    // Another field does not stand in the way of the one in which somebody is.
    type_over(&mut browser, "known-area", "162");
    let other = std::fs::read_to_string(&file)
        .unwrap()
        .replace("[known]", "[known]\ntank_height = 61.0");
    std::fs::write(&file, other).unwrap();
    browser.until("document.getElementById('known-tank_height').value === '61'");
    browser.press("Enter", 13, "\r");
    browser.until("document.getElementById('text').textContent.includes('162')");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains("tank_height = 61.0") && text.contains("162"),
        "{text}"
    );
}

/// Two fields, the second filled in before the first is answered, are both written.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn fields_that_are_filled_in_quickly_do_not_overtake_each_other() {
    let (_folder, file, _) = model();
    let (mut browser, address, _alone) = opened(&file);
    browser.evaluate(
        "for (const [id, value] of [['known-area', '155'], ['known-tank_height', '62'], ['known-input_range', '11']]) {
           const box = document.getElementById(id); box.value = value; box.dispatchEvent(new Event('change', { bubbles: true })); }",
    );
    browser.until("['155', '62', '11'].every((said) => document.getElementById('text').textContent.includes(said))");
    let text = std::fs::read_to_string(&file).unwrap();
    for said in ["area = 155", "tank_height = 62", "input_range = 11"] {
        assert!(text.contains(said), "{said}: {text}");
    }
    assert_eq!(browser.text("#model-error"), "");
    browser.assert_quiet(&address);
}

/// The same of two tabs without a browser, and of a whole text.
#[test]
fn what_was_filled_from_an_older_model_is_refused() {
    let (_folder, file, text) = model();
    let page = serve(&["--model", &file.display().to_string()]);
    let (first, second) = (Tab::open(&page), Tab::open(&page));
    let form = |tab: &Tab, from: &serde_json::Value, area: f64| {
        let mut said = from.clone();
        said["known"]["area"] = json!(area);
        said["from"] = from.clone();
        tab.post("/api/settings", said.to_string().as_bytes())
    };
    let from = first.state()["settings"].clone();
    assert_eq!(form(&first, &from, 155.0).status, 200);
    let refused = form(&second, &from, 156.0);
    assert_eq!(refused.status, 409);
    assert!(
        refused.error().contains("known.area changed meanwhile"),
        "{refused:?}"
    );
    assert!(std::fs::read_to_string(&file).unwrap().contains("155"));

    let replaced = |from: &str| {
        let body = json!({ "text": "plant = 'first-order'", "from": from }).to_string();
        second.post("/api/text", body.as_bytes()).status
    };
    assert_eq!(replaced(&text), 409);
    let now = std::fs::read_to_string(&file).unwrap();
    assert_eq!(replaced(&now), 200);
    // Where the model is in no file it is the same.
    let tab = Tab::open(&serve(&[]));
    let bare = br#"{"text": "plant = 'single-tank'"}"#;
    assert_eq!(tab.post("/api/text", bare).status, 200);
    assert_eq!(tab.post("/api/text", bare).status, 409);
    assert_eq!(
        tab.post("/api/settings", br#"{"plant": "first-order"}"#)
            .status,
        409
    );
}
