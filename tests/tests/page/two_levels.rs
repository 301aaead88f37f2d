//! Two levels of one record with the mouse: what has to be said of them, and errors and figures of each.

use ctid_tests::Rig;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::json;

use crate::browser::Browser;
use crate::click_path::choose_plant;
use crate::server::{alone, csv, serve};

/// Fitted models in the trail, drawn over both readings and the command.
fn wait_for_models(browser: &mut Browser, count: usize) {
    browser.until(&format!(
        "document.querySelectorAll('#trail .several').length === {count} && document.getElementById('plot-record-0')?.data?.length === 2 * ({count} + 1) + 1 \
         && document.getElementById('working').hidden"
    ));
}

#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn both_levels_are_named_fitted_and_shown() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let rig = Rig {
        measured: vec![0, 1],
        hidden: vec![("overflow", 0, vec![24.0, 0.0])],
        samples: 500,
        ..Rig::cascaded_tanks()
    };
    let mut record = rig.run(&mut ChaCha8Rng::seed_from_u64(3));
    // Names come from files.
    "y<b>".clone_into(&mut record.outputs[0].name);
    let file = browser.folder.path().join("both.csv");
    std::fs::write(&file, csv(&record)).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("!document.getElementById('model').hidden");
    choose_plant(&mut browser, "cascaded-tanks");
    browser.until("document.getElementById('column-output_2')");

    // A second reading needs a word on which level it is; until then the model stays.
    browser.evaluate("document.getElementById('columns').open = true");
    for (role, letters, header) in [("output", "y", "y [cm]"), ("output_2", "y", "y<b> [cm]")] {
        let chosen = format!("value === '{header}'");
        browser.choose(&format!("column-{role}"), letters, &chosen);
    }
    browser.until("document.getElementById('model-error').innerText.includes('tanks whose levels') && document.getElementById('known-measured-2')");
    for (id, letter, level) in [
        ("known-measured", "l", "lower"),
        ("known-measured-2", "u", "upper"),
    ] {
        browser.choose(id, letter, &format!("value === '{level}'"));
    }
    wait_for_models(&mut browser, 1);
    let text = browser.evaluate("document.getElementById('text').textContent");
    let text = text.as_str().unwrap();
    assert!(text.contains("measured = [\"lower\", \"upper\"]"), "{text}");
    assert_eq!(browser.text("#model-error"), "");
    let fall = browser.text("#fall");
    assert!(
        fall.starts_with("Simulation error y ") && fall.contains("; y<b> "),
        "{fall}"
    );

    // The figures that show one output show the chosen one.
    let residual = "document.getElementById('plot-by-time').layout.yaxis.title.text";
    assert_eq!(browser.evaluate(residual), json!("residual of y [cm]"));
    browser.choose("shown-output", "y", "value === '1'");
    browser.until(&format!("{residual} === 'residual of y&lt;b&gt; [cm]'"));
    let panels = "document.getElementById('plot-record-0').data.map((one) => one.yaxis)";
    assert_eq!(
        browser.evaluate(panels),
        json!(["y", "y", "y2", "y2", "y3"])
    );

    browser.click("#diagnose");
    browser.until("document.querySelector('#add-found-0')");
    assert_eq!(browser.text("#findings .name"), "overflow (upper)");
    browser.click("#add-found-0");
    wait_for_models(&mut browser, 2);
    assert_eq!(browser.text("#shown-output option:checked"), "y<b>");
    browser.assert_quiet(&address);
}
