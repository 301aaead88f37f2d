//! Models of the user's own on the page.

#![allow(clippy::unwrap_used)]

use super::super::own_findings::Diagnosed;
use super::super::own_work::Work;
use super::super::state::state;
use super::*;
use crate::edit::own::Findings;
use crate::numbers;
use serde_json::json;
use std::sync::atomic::AtomicBool;

fn write(session: &mut Session, text: Option<&str>, file: Option<&str>) {
    let (text, file) = (text.map(str::to_string), file.map(str::to_string));
    change(session, Change::Write { text, file }).unwrap();
}

/// Every example is a model with its record, and the columns are found.
#[test]
fn every_example_can_be_fitted() {
    for name in examples() {
        let mut session = Session::new(None, None, Vec::new());
        let name = name.to_string();
        change(&mut session, Change::Example { name }).unwrap();
        let state = state(&mut session);
        let own = &state["own"];
        assert!(
            own["text_error"].is_null() && own["file_error"].is_null(),
            "{own}"
        );
        assert!(state["records"][0]["read"].is_object(), "{state}");
        assert!(Work::new(&mut session).is_ok());
    }
    let mut session = Session::new(None, None, Vec::new());
    let name = "../../etc/passwd".to_string();
    let refused = change(&mut session, Change::Example { name }).unwrap_err();
    assert!(refused.to_string().starts_with("there is no example"));
}

/// Whatever path a model file names, the text is that of the page: no file of the computer is read.
#[test]
fn a_model_file_reads_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("secret.mo");
    std::fs::write(&secret, "model Secret").unwrap();
    for named in [
        secret.display().to_string(),
        "/etc/passwd".into(),
        "../x.mo".into(),
    ] {
        let mut session = Session::new(None, None, Vec::new());
        write(
            &mut session,
            Some(TEMPLATE),
            Some(&format!("model = {named:?}\n")),
        );
        let state = state(&mut session);
        assert!(state["own"]["file_error"].is_null(), "{state}");
        assert!(
            state["own"]["check"]
                .as_str()
                .unwrap()
                .starts_with("Block: ")
        );
    }
}

#[test]
fn what_is_wrong_is_said_with_its_place_and_the_records_stay_read() {
    let mut session = Session::new(None, None, Vec::new());
    let name = "heated-block".to_string();
    change(&mut session, Change::Example { name }).unwrap();
    let text = session.own.clone().unwrap().text;
    write(&mut session, Some(&text.replace("= g*u", "= gg*u")), None);
    let wrong = state(&mut session);
    let error = wrong["own"]["text_error"].as_str().unwrap();
    assert!(error.contains(": `gg` is not declared") && error.as_bytes()[0].is_ascii_digit());
    assert!(wrong["own"]["check"].is_null() && wrong["own"]["file_error"].is_null());
    assert!(wrong["records"][0]["read"].is_object(), "{wrong}");
    assert!(Work::new(&mut session).is_err());
    // The same for the model file.
    write(
        &mut session,
        Some(&text),
        Some("model = \"a.mo\"\n[known]\nzz = 1.0\n"),
    );
    let wrong = state(&mut session);
    let error = wrong["own"]["file_error"].as_str().unwrap();
    assert!(
        error.starts_with("model.toml:3: zz is not a parameter of HeatedBlock"),
        "{error}"
    );
}

#[test]
fn a_column_is_written_into_the_file_and_its_comments_stay() {
    let mut session = Session::new(None, None, Vec::new());
    write(
        &mut session,
        Some(TEMPLATE),
        Some("model = \"a.mo\"\n[columns]\nu = \"heater\" # the only one\n"),
    );
    let choose = |session: &mut Session, signal: &str, column: &str| {
        let (signal, column) = (signal.to_string(), column.to_string());
        change(session, Change::Column { signal, column }).unwrap();
        session.own.clone().unwrap().file
    };
    choose(&mut session, "u", "heater [%]");
    let file = choose(&mut session, "y", "block [degC]");
    assert_eq!(
        file,
        "model = \"a.mo\"\n[columns]\nu = \"heater [%]\" # the only one\ny = \"block [degC]\"\n"
    );
    let file = choose(&mut session, "y", "");
    assert!(!file.contains("block"));
}

/// A heated block whose heater answers 15 s late, every 5 s.
fn late() -> String {
    let mut text = String::from("t [s],heater [%],room [degC],block [degC]\n");
    let (mut block, mut seed) = (21.0, 7_u32);
    let mut past = [0.0; 3];
    for k in 0..300 {
        let u = f64::from(k / 17 * 31 % 80);
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.1 * (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5);
        text += &format!("{},{u},21,{:.4}\n", 5 * k, block + noise);
        block += 5.0 * (0.25 * past[0] - 0.15 * (block - 21.0)) / 52.0;
        past = [past[1], past[2], u];
    }
    text
}

/// A name that no effect has is given to the missing term of the diagnosis; the term can be taken out and added again.
#[test]
fn the_missing_term_gets_a_name() {
    let mut session = Session::new(None, None, Vec::new());
    let name = "heated-block".to_string();
    change(&mut session, Change::Example { name }).unwrap();
    let data = session.data;
    let own = session.own.as_mut().unwrap();
    let found = r#"{ "model": "HeatedBlock", "steps": [], "record_numbers": { "shape(T,u)": { "low": 0.0, "width": 50.0 } },
        "unknown": { "effect": "shape(T,u)", "parameters": [{ "name": "shape_T_u_h1", "value": 1.5 }] } }"#;
    own.diagnosis = Some(Diagnosed {
        id: 1,
        text: own.text.clone(),
        file: own.file.clone(),
        data,
        findings: Findings::of_text(found).unwrap(),
        effects: Vec::new(),
        body: json!({}),
    });
    let add = |session: &mut Session, effect: &str| {
        let effect = effect.to_string();
        change(session, Change::Add { effect }).map_err(|refused| refused.to_string())
    };
    let refused = add(&mut session, "k").unwrap_err();
    assert!(refused.contains("`k` is a variable"), "{refused}");
    add(&mut session, "heat_loss").unwrap();
    let shown = state(&mut session)["own"].clone();
    assert_eq!(shown["effects"], json!(["heat_loss"]), "{shown}");
    assert_eq!(shown["functions"], json!({ "heat_loss": "shape(T,u)" }));
    let file = shown["file"].as_str().unwrap();
    assert!(file.contains("h1 = 1.5"), "{file}");
    let effect = "heat_loss".to_string();
    change(&mut session, Change::Remove { effect }).unwrap();
    assert_eq!(state(&mut session)["own"]["effects"], json!([]));
    // Again, from another result: with its values, and not if its missing term is another function.
    let again = |session: &mut Session, found: &str| {
        let own = session.own.as_mut().unwrap();
        own.diagnosis.as_mut().unwrap().findings = Findings::of_text(found).unwrap();
        add(session, "heat_loss")
    };
    let other = found
        .replace("shape(T,u)", "course(T)")
        .replace("shape_T_u", "course_T");
    let refused = again(&mut session, &other).unwrap_err();
    assert!(refused.contains("give another name"), "{refused}");
    again(&mut session, &found.replace("1.5", "2.5")).unwrap();
    let shown = state(&mut session)["own"].clone();
    assert_eq!(shown["effects"], json!(["heat_loss"]));
    let file = shown["file"].as_str().unwrap();
    assert!(file.contains("h1 = 2.5"), "{file}");
}

/// The accepted effects outside a group are in the model of its experiment, and the experiment has the inputs' units.
#[test]
fn the_experiment_between_two_effects_of_a_group() {
    let mut session = Session::new(None, None, Vec::new());
    let name = "heated-block".to_string();
    change(&mut session, Change::Example { name }).unwrap();
    let upload = Upload::new("late.csv", false, late().into_bytes().into()).unwrap();
    session.take_alone(upload);
    let between = ["delay(u)", "lag(u)"].map(str::to_string);
    let early = Work::beside(&mut session, 0, &between).err().unwrap();
    assert!(early.to_string().contains("diagnose first"), "{early}");
    let data = session.data;
    let own = session.own.as_mut().unwrap();
    let found = r#"{ "model": "HeatedBlock", "steps": [], "unknown": null, "record_numbers": { "offset(y)": {} } }"#;
    own.diagnosis = Some(Diagnosed {
        id: 1,
        text: own.text.clone(),
        file: own.file.clone(),
        data,
        findings: Findings::of_text(found).unwrap(),
        effects: vec!["delay(u)".to_string(), "offset(y)".to_string()],
        body: json!({}),
    });
    let work = Work::beside(&mut session, 0, &between).unwrap();
    assert_eq!(work.model.effects.on, ["offset(y)"]);
    let inputs = json!([
        { "name": "u", "apply": true, "range": [0.0, 50.0], "slew": null },
        { "name": "Ta", "apply": false, "range": null, "slew": null },
    ]);
    let inputs: Vec<super::super::own_design::AppliedInput> =
        serde_json::from_value(inputs).unwrap();
    let limits = super::super::own_design::limits(&inputs, Some(900.0));
    assert_eq!(limits.inputs, ["u"]);
    let design = work
        .design(&between, &limits, &AtomicBool::new(false), &|_| {})
        .unwrap();
    work.settle_design(&mut session, &design);
    let shown = state(&mut session)["own"]["design"].clone();
    assert_eq!(shown["between"], json!(between));
    assert!(
        shown["limits"]
            .as_str()
            .unwrap()
            .contains("15 min with u 0.00 .. 50.0 %"),
        "{shown}"
    );
    assert_eq!(shown["inputs"].as_array().unwrap().len(), 1, "{shown}");
    assert_eq!(shown["inputs"][0]["unit"], "%");
    let reaches = shown["rows"][0]["reaches"][0].as_str().unwrap();
    assert!(
        reaches.starts_with("y ") && reaches.ends_with(" degC"),
        "{shown}"
    );
    assert!(!shown["sentences"].to_string().contains("--"), "{shown}");
    let design = session.own.as_ref().and_then(|own| own.design.clone());
    let record = design.unwrap().record.unwrap();
    assert!(
        record.starts_with("t [s],heater [%],room [degC]\n"),
        "{record}"
    );
}

#[test]
fn curves_errors_and_parameters_are_those_of_compare() {
    let mut session = Session::new(None, None, Vec::new());
    let name = "heated-block".to_string();
    change(&mut session, Change::Example { name }).unwrap();
    let work = Work::new(&mut session).unwrap();
    let found = work.compute(&AtomicBool::new(false)).unwrap();
    let [step] = &found.steps;
    let body = work.body(7, &found);
    assert_eq!(
        body["outputs"][0]["rmse"],
        numbers::significant(step.rmse_per_output["y"], 3)
    );
    assert_eq!(
        body["parameters"].as_array().unwrap().len(),
        step.parameters.len()
    );
    let curve = &body["curves"][0];
    for series in ["measured", "model", "residual"] {
        let of = |axis: &str| curve[series][axis].as_array().unwrap().len();
        assert!(of("x") == of("y") && of("x") > 100);
    }
    work.settle(&mut session, &found);
    assert_eq!(state(&mut session)["own"]["fitted"], true);
    // After a change of the text the result is not valid.
    write(&mut session, Some(TEMPLATE), None);
    let state = state(&mut session);
    assert_eq!(
        (&state["own"]["fitted"], state["own"]["fit"].is_u64()),
        (&false.into(), true)
    );
}

/// A controller of the model file has its reference from the record, and the page says what came of the loop.
#[test]
fn a_fit_says_whether_the_loop_was_simulated() {
    let mut session = Session::new(None, None, Vec::new());
    let name = "heated-block".to_string();
    change(&mut session, Change::Example { name }).unwrap();
    let file = session.own.clone().unwrap().file;
    // The heater of this record is driven in steps.
    let controller = "[controller.u]\ntype = \"PI\"\ngain = 1.0\nintegral_time = 100.0\nreference = \"room [degC]\"\n";
    write(&mut session, None, Some(&format!("{file}\n{controller}")));
    let work = Work::new(&mut session).unwrap();
    let found = work.compute(&AtomicBool::new(false)).unwrap();
    let body = work.body(1, &found);
    let said = body["loop"].as_str().unwrap();
    let expected = "The loop is not simulated: the measured command disagrees with the controller";
    assert!(said.starts_with(expected), "{said}");
    // A column that the record lacks.
    let other = controller.replace("room", "set point");
    write(&mut session, None, Some(&format!("{file}\n{other}")));
    let work = Work::new(&mut session).unwrap();
    let found = work.compute(&AtomicBool::new(false)).unwrap();
    let body = work.body(1, &found);
    let said = body["loop"].as_str().unwrap();
    assert!(said.contains("the record has no reference"), "{said}");
}
