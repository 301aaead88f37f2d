use super::*;

fn added(text: &str, effect: &str) -> String {
    with_effect("tank.toml", text, effect, None).unwrap().text
}

fn removed(text: &str, effect: &str) -> String {
    without_effect("tank.toml", text, effect).unwrap().text
}

const COMMENTED: &str = r#"# The tank in hall 3.
plant = "single-tank"   # as built
effects = []            # none yet

[known]  # measured with a tape
area = 154.0
"#;

#[test]
fn comments_and_layout_stay() {
    let with = added(COMMENTED, "overflow");
    assert_eq!(with, COMMENTED.replace("[]", "[\"overflow\"]"));
    assert_eq!(removed(&with, "overflow"), COMMENTED);
    let both = added(&with, "pump_lag");
    assert_eq!(
        both,
        COMMENTED.replace("[]", "[\"overflow\", \"pump_lag\"]")
    );
    assert_eq!(removed(&both, "overflow"), added(COMMENTED, "pump_lag"));
    assert_eq!(removed(&both, "pump_lag"), with);
}

#[test]
fn a_list_over_several_lines_keeps_its_lines() {
    let text = r#"plant = "single-tank"
effects = [
    "overflow",   # seen in May
    "pump_lag",   # the new drive
    # perhaps more
]
"#;
    let more = added(text, "sensor_lag");
    let expected = text.replace("more\n", "more\n    \"sensor_lag\",\n");
    assert_eq!(more, expected);
    assert_eq!(removed(&more, "sensor_lag"), text);
    let without = removed(text, "pump_lag");
    for comment in ["# seen in May", "# the new drive", "# perhaps more"] {
        assert!(without.contains(comment), "{without}");
    }
    let none = removed(&without, "overflow");
    for comment in ["# seen in May", "# the new drive", "# perhaps more"] {
        assert!(none.contains(comment), "{none}");
    }
    assert_eq!(model_file::parse("", &none).unwrap().effects, []);
}

#[test]
fn a_missing_line_is_made() {
    let text = "plant = \"single-tank\" # as built\n\n# sizes\n[known]\narea = 1.0\n";
    let with = added(text, "overflow");
    let line = "# as built\neffects = [\"overflow\"]\n";
    assert_eq!(with, text.replace("# as built\n", line));
}

#[test]
fn the_place_is_written_where_there_is_a_choice() {
    let text = "plant = \"cascaded-tanks\"\neffects = []\n";
    let edited = with_effect("tank.toml", text, "overflow", Some("lower")).unwrap();
    assert_eq!(
        edited.text,
        "plant = \"cascaded-tanks\"\neffects = [\"overflow\"]\n\n[effect.overflow]\nwhere = \"lower\"\n"
    );
    assert_eq!(
        edited.done,
        "tank.toml: added overflow at the lower vessel; effects = [\"overflow\"]"
    );
    let done = without_effect("tank.toml", &edited.text, "overflow").unwrap();
    assert!(
        done.done.contains("[effect.overflow] is kept"),
        "{}",
        done.done
    );
    // The table was kept: the place need not be given again.
    let again = with_effect("tank.toml", &done.text, "overflow", None).unwrap();
    assert_eq!(
        model_file::parse("", &again.text).unwrap().effects[0].vessel,
        1
    );
    let upper = with_effect("tank.toml", &done.text, "overflow", Some("upper")).unwrap();
    assert_eq!(upper.text.matches("where").count(), 1);
}

#[test]
fn what_cannot_be_done_is_refused() {
    let text = "plant = \"single-tank\"\neffects = [\"overflow\"]\n";
    let add = |effect, place| match with_effect("tank.toml", text, effect, place) {
        Err(error) => error.to_string(),
        Ok(edited) => edited.text,
    };
    assert_eq!(
        add("overflow", None),
        "tank.toml: overflow is in the model already; `ctid remove overflow` takes it out"
    );
    assert!(add("overflo", None).contains("did you mean overflow?"));
    assert!(add("sqrt_outflow", None).contains("does not act on plant"));
    assert!(add("const_leak", Some("upper")).contains("one vessel"));
    assert!(add("pump_lag", Some("upper")).contains("acts at the actuator"));
    let remove = without_effect("tank.toml", text, "pump_lag");
    assert_eq!(
        remove.err().unwrap().to_string(),
        "tank.toml: pump_lag is not in the model, so it cannot be removed; effects = [\"overflow\"]"
    );
}

#[test]
fn a_refused_change_leaves_the_file_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.toml");
    std::fs::write(&path, "plant = \"single-tank\"\r\neffects = []\r\n").unwrap();
    assert!(add(&path, "overfow", None).is_err());
    assert_eq!(
        std::fs::read(&path).unwrap(),
        b"plant = \"single-tank\"\r\neffects = []\r\n"
    );
    add(&path, "overflow", None).unwrap();
    assert_eq!(
        std::fs::read(&path).unwrap(),
        b"plant = \"single-tank\"\r\neffects = [\"overflow\"]\r\n"
    );
    // No temporary file is left in the folder.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A folder with a model file in it.
fn in_a_file(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.toml");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

const BARE: &str = "plant = \"single-tank\"\neffects = []\n";

/// An editor that writes between reading and writing loses nothing, and neither does the user who adds the effect.
#[test]
fn what_is_written_meanwhile_is_kept() {
    let (_folder, path) = in_a_file(BARE);
    let readings = std::cell::Cell::new(0);
    let done = change(&path, |text| {
        readings.set(readings.get() + 1);
        if readings.get() == 1 {
            std::fs::write(&path, format!("# measured in May\n{text}")).unwrap();
        }
        with_effect("tank.toml", text, "overflow", None)
    });
    assert!(done.unwrap().contains("added overflow"));
    assert_eq!(readings.get(), 2);
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(
        text,
        "# measured in May\nplant = \"single-tank\"\neffects = [\"overflow\"]\n"
    );
}

#[test]
fn a_file_that_never_rests_is_not_written() {
    let (_folder, path) = in_a_file(BARE);
    let last = std::cell::RefCell::new(String::new());
    let error = change(&path, |text| {
        last.replace(format!("# again\n{text}"));
        std::fs::write(&path, last.borrow().as_str()).unwrap();
        with_effect("tank.toml", text, "overflow", None)
    });
    assert!(matches!(error, Err(Error::Changed { .. })), "{error:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), last.into_inner());
}

#[test]
fn a_text_takes_the_place_of_the_one_that_was_seen_alone() {
    let (_folder, path) = in_a_file(BARE);
    let error = replace(&path, "plant = \"first-order\"\n", "# new\n");
    assert!(matches!(error, Err(Error::Changed { .. })), "{error:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), BARE);
    replace(&path, BARE, "# new\n").unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "# new\n");
    std::fs::remove_file(&path).unwrap();
    replace(&path, BARE, "# anew\n").unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "# anew\n");
}
