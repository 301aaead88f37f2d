//! The five steps with the mouse, and by keyboard.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use ctid_tests::Rig;
use missing_effect::numbers;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde_json::Value;

use crate::browser::Browser;
use crate::server::{alone, bundled, command, csv, serve};

/// The falling error as the page writes it.
pub fn trail(browser: &mut Browser) -> Vec<f64> {
    let numbers = browser
        .evaluate("[...document.querySelectorAll('#trail .number')].map((one) => one.innerText)");
    let numbers: Vec<f64> = numbers
        .as_array()
        .unwrap()
        .iter()
        .map(|text| {
            let text = text.as_str().unwrap();
            text.split_whitespace()
                .next()
                .unwrap()
                .parse()
                .unwrap_or_else(|_| panic!("{text}"))
        })
        .collect();
    // The plot shows the same.
    if numbers.len() > 1 {
        let drawn = browser.evaluate("document.getElementById('plot-trail').data[0].y");
        assert_eq!(drawn.as_array().unwrap().len(), numbers.len());
        for (drawn, text) in drawn.as_array().unwrap().iter().zip(&numbers) {
            assert!(
                (drawn.as_f64().unwrap() - text).abs() <= 0.01 * text,
                "{drawn} is drawn, {text} is written"
            );
        }
    }
    numbers
}

/// Waits for fitted models in the error ladder, with the last one drawn.
pub fn wait_for_models(browser: &mut Browser, count: usize) {
    browser.until(&format!(
        "document.querySelectorAll('#trail .step').length === {count} && document.getElementById('plot-record-0')?.data?.length === {count} + 2 \
         && document.getElementById('working').hidden"
    ));
}

pub fn choose_plant(browser: &mut Browser, plant: &str) {
    browser.choose("plant", &plant[..1], &format!("value === '{plant}'"));
}

/// A tank of 154 cm^2, fitted before and after its area is said.
pub fn choose_measured_tank(browser: &mut Browser) {
    choose_plant(browser, "single-tank");
    wait_for_models(browser, 1);
    browser.click("#known-area");
    browser.type_text("154");
    browser.press("Enter", 13, "\r");
    browser.until("document.getElementById('text').textContent.includes('area = 154') && document.querySelector('#parameters').innerText.includes('cm3/(V s)')");
    wait_for_models(browser, 1);
}

/// Downloads the model by a click.
fn download(browser: &mut Browser) -> PathBuf {
    let folder = browser.folder.path().join("downloads");
    let behaviour = serde_json::json!({ "behavior": "allow", "downloadPath": folder });
    browser.call("Page.setDownloadBehavior", behaviour);
    browser.click("#download-model");
    let file = folder.join("model.toml");
    for _ in 0..200 {
        if file.exists() {
            return file;
        }
        sleep(Duration::from_millis(50));
    }
    panic!("no model was downloaded");
}

/// Result of `ctid compare` for a record and a model file.
fn compared(record: &Path, test: Option<&Path>, model: &Path) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("out.json");
    let path = |path: &Path| path.display().to_string();
    let mut words = vec![
        "compare".to_string(),
        path(record),
        "--model".into(),
        path(model),
        "--json".into(),
        path(&json),
    ];
    if let Some(test) = test {
        words.extend(["--test".into(), path(test)]);
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    command(&words);
    serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap()
}

fn assert_same_figures(browser: &mut Browser, found: &Value) {
    let step = &found["steps"][0];
    let last = browser.text("#trail li:last-child .number");
    let fitted = numbers::significant(step["rmse"].as_f64().unwrap(), 3);
    assert!(
        last.starts_with(&format!("{fitted} ")),
        "the page says {last}, ctid compare {fitted}"
    );
    if let Some(test) = step["rmse_test"].as_f64() {
        let test = numbers::significant(test, 3);
        let held = browser.text("#trail li:last-child .test");
        assert!(
            held.starts_with(&format!("held out {test} ")),
            "the page says {held}, ctid compare {test}"
        );
    }
    for parameter in step["parameters"].as_array().unwrap() {
        let (value, _) = numbers::value_and_error(
            parameter["value"].as_f64().unwrap(),
            parameter["std_error"].as_f64(),
        );
        let row = format!(
            "[...document.querySelectorAll('#parameters tr')].find((row) => row.cells[0].innerText === '{}')?.cells[1].innerText",
            parameter["name"].as_str().unwrap()
        );
        assert_eq!(
            browser.evaluate(&row),
            Value::String(value),
            "{}",
            parameter["name"]
        );
    }
}

/// Nothing is cut off or covered, in both colour schemes, on a desktop and on a phone.
fn look_around(browser: &mut Browser, name: &str) {
    for (width, height) in [(1440, 900), (390, 844)] {
        for scheme in ["light", "dark"] {
            browser.look(width, height, scheme);
            browser.until("document.getElementById('plot-record-0').querySelector('.main-svg')");
            sleep(Duration::from_millis(300));
            let wide = browser
                .evaluate("document.documentElement.scrollWidth")
                .as_u64()
                .unwrap();
            assert!(
                wide <= u64::from(width),
                "the page is {wide} px wide in {width} px"
            );
            for (part, at) in [
                ("top", "body"),
                ("found", "#missing"),
                ("fit", "#fit-part"),
                ("fails", "#fails-part"),
            ] {
                browser.evaluate(&format!(
                    "document.querySelector('{at}').scrollIntoView({{ behavior: 'instant' }})"
                ));
                browser.picture(&format!("{name}-{part}-{width}-{scheme}"));
            }
        }
    }
    browser.look(1440, 900, "light");
    browser.evaluate("scrollTo(0, 0)");
}

/// The bundled record: everything but a second effect, which it does not have.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn the_bundled_record_with_the_mouse() {
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    browser.picture("empty");
    browser.drop_files("#drop-fitted", &[&bundled("tour.csv")]);
    browser.until("document.querySelector('#records li')");
    assert!(browser.text("#records").contains("900 samples"));
    browser.drop_files("#drop-test", &[&bundled("tour-test.csv")]);
    browser.until("document.querySelectorAll('#records li').length === 2");
    // The columns are recognised, and their units.
    let columns = "['time', 'input', 'output'].map((role) => [document.getElementById(`column-${role}`).value, document.getElementById(`unit-${role}`).value])";
    assert_eq!(
        browser.evaluate(columns),
        serde_json::json!([["t [s]", "s"], ["u [V]", "V"], ["y [cm]", "cm"]])
    );

    choose_measured_tank(&mut browser);
    let failing = "document.getElementById('plot-record-0').layout.shapes.length";
    assert!(
        browser.evaluate(failing).as_u64().unwrap() > 0,
        "the failing windows are marked"
    );

    browser.click("#diagnose");
    browser.until("document.querySelector('#add-found-0')");
    assert!(browser.text("#findings").starts_with("Missing: overflow"));
    browser.click("#add-found-0");
    wait_for_models(&mut browser, 2);
    let fell = trail(&mut browser);
    assert!(fell[1] < 0.1 * fell[0], "{fell:?}");
    let file = download(&mut browser);
    assert!(
        std::fs::read_to_string(&file)
            .unwrap()
            .contains("effects = [\"overflow\"]")
    );
    let found = compared(&bundled("tour.csv"), Some(&bundled("tour-test.csv")), &file);
    assert_same_figures(&mut browser, &found);
    look_around(&mut browser, "tour");

    // Two chains, of which one is not fitted yet.
    browser.choose(
        "chain-b",
        "o",
        "selectedOptions[0].text.startsWith('overflow + leak')",
    );
    browser.click("#compare-chains");
    browser.until("document.querySelectorAll('#chain-result tbody tr').length > 5");
    assert_eq!(
        browser.evaluate("document.getElementById('plot-chains').data.length"),
        serde_json::json!(4)
    );
    browser.picture("tour-chains");

    // Without the mouse: removed, and added again.
    browser.evaluate("document.querySelector('#plant').focus()");
    browser.tab_to_and_enter("#effects button[aria-label='Remove overflow']");
    wait_for_models(&mut browser, 1);
    browser.evaluate("document.querySelector('#diagnose').focus()");
    browser.tab_to_and_enter("#add-found-0");
    wait_for_models(&mut browser, 2);
    browser.assert_quiet(&address);
}

/// A record that leaves two lags open: the page proposes what distinguishes them.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn two_undecided_effects_show_their_experiment() {
    let rig = Rig {
        samples: 300,
        hidden: vec![("sensor_lag", 0, vec![8.0])],
        ..Rig::single_tank()
    };
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    let file = browser.folder.path().join("lag.csv");
    std::fs::write(&file, csv(&rig.run(&mut ChaCha8Rng::seed_from_u64(1)))).unwrap();
    browser.drop_files("#drop-fitted", &[&file]);
    browser.until("document.querySelector('#records li')");
    browser.choose("plant", "s", "value === 'single-tank'");
    wait_for_models(&mut browser, 1);
    browser.click("#diagnose");
    browser.until("document.querySelector('#findings .groups li')");
    browser.picture("undecided");
    browser.click("[id^=tell-]");
    browser.until("document.querySelector('#experiment .lead')");
    browser.picture("experiment");
    let rows = browser.evaluate("document.querySelectorAll('#experiment tbody tr').length");
    assert!(rows.as_u64().unwrap() > 2, "{rows}");
    browser.click("#limit-low");
    browser.type_text("1.5");
    browser.click("#limit-high");
    browser.type_text("8.5");
    browser.click("#design-again");
    browser.until("document.querySelector('#experiment .lead').innerText.includes('from 1.50 to 8.50 V') && document.getElementById('plot-experiment')?.data");
    browser.picture("experiment-wider");
    let values = browser.evaluate("document.getElementById('plot-experiment').data[0].y");
    let values: Vec<f64> = values
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert!(values.len() >= 300 && values.iter().all(|u| (1.5..=8.5).contains(u)));
    // Of two effects that cannot be distinguished, one is in the model.
    browser.click("#add-found-0");
    wait_for_models(&mut browser, 2);
    let first = browser.text("#effects code");
    let other = "[id^=add-other-0-]";
    assert_eq!(browser.text(other), "Take instead");
    browser.click(other);
    browser.until(&format!(
        "document.querySelectorAll('#effects code').length === 1 && document.querySelector('#effects code').innerText !== '{first}'"
    ));
    wait_for_models(&mut browser, 2);
    assert_eq!(browser.text("#add-found-0"), "Take instead");
    browser.picture("instead");
    browser.assert_quiet(&address);
}

/// Page and commands edit the same file, and its comments stay.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn page_and_commands_are_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let (model, data) = (folder.path().join("tank.toml"), bundled("tour.csv"));
    let text = std::fs::read_to_string(bundled("tour.toml")).unwrap();
    std::fs::write(&model, format!("# ours\n{text}")).unwrap();
    let (model, data) = (model.display().to_string(), data.display().to_string());
    let address = serve(&[&data, "--model", &model]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    wait_for_models(&mut browser, 1);
    command(&["add", "overflow", "--model", &model]);
    wait_for_models(&mut browser, 2);
    let fell = trail(&mut browser);
    assert!(fell[1] < 0.1 * fell[0], "{fell:?}");
    browser.click("#effects button[aria-label='Remove overflow']");
    browser.until("document.querySelectorAll('#trail .step').length === 1");
    assert_eq!(
        std::fs::read_to_string(&model).unwrap(),
        format!("# ours\n{text}")
    );
    browser.assert_quiet(&address);
}

/// Entries without a field in the form stay in the file.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
fn the_form_deletes_nothing_that_it_does_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tank.toml");
    let text = std::fs::read_to_string(bundled("tour.toml")).unwrap();
    let text = format!("hold = \"first\"\n{text}");
    std::fs::write(&file, &text).unwrap();
    let path = file.display().to_string();
    let address = serve(&["--model", &path]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    browser.until("document.getElementById('known-area')?.value === '154'");
    browser.evaluate("const box = document.getElementById('known-area'); box.value = '155'; box.dispatchEvent(new Event('change', { bubbles: true }))");
    browser.until("document.getElementById('text').textContent.includes('155')");
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        text.replace("154.0 ", "155.0 ")
    );
    browser.assert_quiet(&address);
}

/// The measured benchmark, if it is next to the checkout: two effects, one after the other.
#[test]
#[cfg_attr(not(chromium), ignore = "chromium is not installed")]
#[cfg_attr(
    not(measured_records),
    ignore = "no measured records beside the checkout"
)]
fn the_measured_tanks_with_the_mouse() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/cascaded_tanks");
    let data = folder.join("estimation.csv").canonicalize().unwrap();
    let address = serve(&[]).to_string();
    let _alone = alone();
    let mut browser = Browser::open(&address);
    browser.drop_files("#drop-fitted", &[&data]);
    browser.until("document.querySelector('#records li')");
    choose_plant(&mut browser, "cascaded-tanks");
    wait_for_models(&mut browser, 1);
    browser.click("#diagnose");
    browser.until("!document.getElementById('working').hidden");
    browser.picture("measured-working");
    browser.until("document.querySelector('#add-found-1')");
    browser.click("#add-found-0");
    wait_for_models(&mut browser, 2);
    browser.click("#add-found-1");
    wait_for_models(&mut browser, 3);
    let fell = trail(&mut browser);
    println!("simulation error {fell:?} V");
    assert!(fell[1] < fell[0] && fell[2] < fell[1], "{fell:?}");
    let file = download(&mut browser);
    let found = compared(&data, None, &file);
    assert_same_figures(&mut browser, &found);
    look_around(&mut browser, "measured");
    browser.assert_quiet(&address);
}
