//! Three tanks and two pumps with the mouse: what has to be said of them, and a leak that is found and added.

use ctid_tests::three_tanks::record;
use serde_json::json;

use crate::browser::Browser;
use crate::click_path::{choose_plant, trail};
use crate::server::{alone, csv, serve};

/// Fitted models in the trail, drawn over the reading and both commands.
fn wait_for_models(browser: &mut Browser, count: usize) {
    browser.until(&format!(
        "document.querySelectorAll('#trail .step').length === {count} && document.getElementById('plot-record-0')?.data?.length === {count} + 3 \
         && document.getElementById('working').hidden"
    ));
}

fn written(browser: &mut Browser, id: &str, text: &str) {
    // An answer to what was written before may move the field away from the mouse.
    for _ in 0..10 {
        browser.click(&format!("#{id}"));
        if browser.evaluate("document.activeElement.id") == json!(id) {
            break;
        }
    }
    browser.type_text(text);
    browser.press("Enter", 13, "\r");
}

#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn a_leak_of_three_tanks_is_found_and_added() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let file = browser.folder.path().join("tanks.csv");
    let leak = record(Some(("leak_at_height", 0, &[3.0, 0.0])), 400, 11);
    std::fs::write(&file, csv(&leak)).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("document.querySelector('#records .alert')");
    assert!(browser.text("#empty").starts_with("Five steps"));

    // Nothing is fitted before it is said which tank was measured, and what was chosen until then stays.
    choose_plant(&mut browser, "three-tank");
    browser.until("document.activeElement.id === 'known-measured'");
    for (role, letters, header) in [
        ("input", "u1", "u1 [V]"),
        ("input_2", "u2", "u2 [V]"),
        ("output", "h3", "h3 [cm]"),
    ] {
        browser.choose(
            &format!("column-{role}"),
            letters,
            &format!("value === '{header}'"),
        );
    }
    browser.press("Tab", 9, "");
    browser.until("document.getElementById('model-error').innerText.includes('tank whose level')");
    assert!(!browser.text("#text").contains("three-tank"));
    // The two letters are two changes; the answer to the first one does not take the second one back.
    browser.choose("known-measured", "T3", "value === 'T3'");
    wait_for_models(&mut browser, 1);
    assert!(
        browser
            .evaluate("document.getElementById('text').textContent")
            .as_str()
            .unwrap()
            .contains("measured = \"T3\"")
    );
    assert_eq!(
        browser.evaluate("document.getElementById('known-measured').value"),
        json!("T3")
    );
    assert_eq!(browser.text("#model-error"), "");
    let about = browser.text("#records");
    assert!(about.contains("u1 ") && about.contains("u2 "), "{about}");

    written(&mut browser, "known-area", "154");
    written(&mut browser, "known-pipe_area", "0.5");
    browser.until("document.getElementById('model-error').innerText.includes('give both')");
    written(&mut browser, "known-gravity", "981");
    browser.until("document.getElementById('text').textContent.includes('gravity = 981')");
    wait_for_models(&mut browser, 1);

    browser.click("#diagnose");
    browser.until("document.querySelector('#add-found-0')");
    assert_eq!(browser.text("#findings .name"), "leak_at_height (T1)");
    browser.click("#add-found-0");
    wait_for_models(&mut browser, 2);
    let fell = trail(&mut browser);
    assert!(fell[1] < 0.056 && fell[1] < 0.9 * fell[0], "{fell:?}");
    let drawn = browser
        .evaluate("document.getElementById('plot-record-0').data.slice(-2).map((one) => one.name)");
    assert_eq!(drawn, json!(["input 1", "input 2"]));

    // Once the leak is taken out its tank does not stand in the way of a plant that has no such tank, nor does the second command.
    browser.click("#effects button[aria-label^='Remove']");
    browser.until("document.getElementById('text').textContent.includes('effects = []')");
    choose_plant(&mut browser, "single-tank");
    browser.until("document.getElementById('text').textContent.includes('single-tank') && !document.getElementById('column-input_2')");
    let text = browser.evaluate("document.getElementById('text').textContent");
    let text = text.as_str().unwrap();
    assert!(
        !text.contains("input_2") && !text.contains("measured"),
        "{text}"
    );
    browser.assert_quiet(&address);
}
