//! Texts of model files before and after a change in the form.

use super::*;

const COMMENTED: &str = r#"# The tank in hall 3.
plant = "single-tank"   # as built
effects = ["overflow"]  # seen in May

[known]  # with a tape
area = 154   # cm^2

[effect.overflow]
rim = 20.0
"#;

#[test]
fn what_is_not_changed_stays_as_it_is_written() {
    let same = Settings::of(COMMENTED).written_into("m.toml", COMMENTED);
    assert_eq!(same.unwrap().text, COMMENTED);
}

/// A form that was filled before another tab has written overwrites nothing, and says what has changed.
#[test]
fn a_form_of_an_older_text_is_refused() {
    let form = |from: &str, to: &str| Form {
        from: Settings::of(from),
        to: Settings::of(to),
    };
    let newer = COMMENTED.replace("154 ", "150.5 ");
    let error = form(COMMENTED, COMMENTED).written_into("m.toml", &newer);
    assert!(
        matches!(&error, Err(Error::Changed { what, .. }) if what.starts_with("known.area changed"))
    );
    // Parts of the file without a field in the form may change: an effect, a comment.
    let other = COMMENTED.replace("\"overflow\"]", "\"overflow\", \"sensor_lag\"] # both");
    let said = form(COMMENTED, &newer)
        .written_into("m.toml", &other)
        .unwrap();
    assert_eq!(said.text, other.replace("154 ", "150.5 "));
    // Values that cannot be displayed are no change.
    let endless = COMMENTED.replace("154 ", "inf ");
    let error =
        form(&COMMENTED.replace("area = 154 ", ""), COMMENTED).written_into("m.toml", &endless);
    assert!(!matches!(error, Err(Error::Changed { .. })));
}

#[test]
fn a_changed_number_keeps_its_comment_and_a_new_table_is_appended() {
    let mut settings = Settings::of(COMMENTED);
    settings.known.area = Some(150.5);
    settings.columns.outputs = vec!["y [cm]".into()];
    let text = settings.written_into("m.toml", COMMENTED).unwrap().text;
    let expected = COMMENTED.replace("154 ", "150.5 ");
    assert!(text.contains("[columns]\noutput = \"y [cm]\"\n"), "{text}");
    let rest: String = text.replace("\n[columns]\noutput = \"y [cm]\"\n", "");
    assert_eq!(rest, expected);
}

#[test]
fn an_empty_text_becomes_a_model_file() {
    let settings = Settings {
        plant: "cascaded-tanks".into(),
        controller: Some(Controller {
            kind: "PI".into(),
            gain: Some(0.6),
            integral_time: Some(90.0),
            ..Controller::default()
        }),
        ..Settings::default()
    };
    let text = settings.clone().written_into("m.toml", "").unwrap().text;
    assert!(
        text.starts_with("plant = \"cascaded-tanks\"\neffects = []\n"),
        "{text}"
    );
    assert_eq!(Settings::of(&text), settings);
}

#[test]
fn an_effect_that_was_taken_out_does_not_stand_in_the_way_of_another_plant() {
    let of = |effects: &str| {
        format!(
            "plant = \"three-tank\"\neffects = [{effects}]\n[known]\nmeasured = \"T3\"\n[effect.leak_at_height]\nwhere = \"T1\"\n"
        )
    };
    let settings = Settings {
        plant: "single-tank".into(),
        ..Settings::default()
    };
    let edited = settings.clone().written_into("m.toml", &of("")).unwrap();
    assert!(!edited.text.contains("where"), "{}", edited.text);
    // An effect in the model is not moved silently.
    let refused = settings.written_into("m.toml", &of("\"leak_at_height\""));
    assert!(refused.is_err_and(|error| error.to_string().contains("T1")));
}

#[test]
fn three_tanks_are_written_as_they_are_read() {
    let settings = Settings {
        plant: "three-tank".into(),
        columns: Columns {
            inputs: vec!["u1 [V]".into(), "u2 [V]".into()],
            ..Columns::default()
        },
        known: Known {
            area: Some(154.0),
            pipe_area: Some(0.5),
            gravity: Some(981.0),
            measured: Some(Measured::One("T3".into())),
            ..Known::default()
        },
        ..Settings::default()
    };
    let text = settings.clone().written_into("m.toml", "").unwrap().text;
    assert_eq!(Settings::of(&text), settings);
}

#[test]
fn what_the_form_cannot_show_is_not_deleted() {
    let settings = Settings {
        plant: "single-tank".into(),
        ..Settings::default()
    };
    let text = "plant = \"single-tank\"\n[known]\narea = \"154\"\n[controller]\ntype = \"PI\"\n";
    assert_eq!(Settings::of(text), Settings::default());
    let error = settings.written_into("m.toml", text).err().unwrap();
    assert!(error.to_string().starts_with("m.toml:3: not a number"));
}

#[test]
fn what_no_model_file_may_say_is_refused() {
    let settings = Settings {
        plant: "cascaded-tanks".into(),
        known: Known {
            area: Some(1.0),
            ..Known::default()
        },
        ..Settings::default()
    };
    let error = settings
        .written_into("m.toml", "")
        .err()
        .unwrap()
        .to_string();
    assert!(error.contains("area_upper"), "{error}");
}
