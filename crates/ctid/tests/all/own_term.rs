//! An unexplained error through the program: written as CSV, kept as a user's own term, removed again.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::common::{Place, Tanks, lasting};
use plants::{Fitted, Term, Variable};

/// A tank with an oscillation as a function of the level that no effect describes.
fn wave(seed: u64) -> Tanks {
    let knots: Vec<f64> = (0..160).map(|i| 0.25 * f64::from(i)).collect();
    Tanks {
        terms: vec![Term {
            name: "wave".to_string(),
            place: plants::Place::Vessel,
            vessel: 0,
            variable: Variable::Level,
            ordinates: knots.iter().map(|h| 2.5 * (1.1 * h).sin()).collect(),
            knots,
            fitted: Fitted::Scale,
        }],
        seed,
        ..Tanks::single()
    }
}

fn place() -> Place {
    let place = Place::empty();
    place.write("a.csv", wave(1).csv());
    place.write("b.csv", wave(2).csv());
    place.write("tank.toml", wave(1).model());
    place
}

#[test]
fn the_unknown_is_written_kept_and_taken_out() {
    let place = place();
    let compare = "compare a.csv --model tank.toml --test b.csv";
    let before = place.result(compare);
    let text = place.succeeds(
        "diagnose a.csv --model tank.toml --test b.csv --unknown u.csv --json d.json --report r.html",
    );
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("acts in the vessel's balance and depends on the level"),
        "{text}"
    );
    assert!(text.contains("wrote u.csv"));
    let found = place.json("d.json");
    // An effect of the catalogue may imitate the larger part.
    let verdict = found["verdict"].as_str().unwrap();
    assert!(["unexplained", "partial"].contains(&verdict), "{verdict}");
    assert_eq!(found["unknown"]["variable"], "level");
    let csv = place.read("u.csv");
    assert!(
        csv.starts_with("place,variable,at [cm],value [cm^3/s],std_error [cm^3/s]\nvessel,level,")
    );
    let page = place.read("r.html");
    for id in [
        "plot-unknown-path",
        "plot-unknown-shape",
        "What it depends on",
    ] {
        assert!(page.contains(id), "{id}");
    }

    let model = place.read("tank.toml");
    let said = place.succeeds("add my_wave --from u.csv --model tank.toml");
    assert!(
        said.contains("added my_wave, a term in the level with"),
        "{said}"
    );
    let model_text = place.read("tank.toml");
    assert!(model_text.contains("effects = [\"my_wave\"]"));
    let lists = model_text.lines().filter(|line| line.contains(" = ["));
    for number in lists.flat_map(|line| line.split(['[', ',', ']']).skip(1)) {
        let digits = number.split(['e', 'E']).next().unwrap();
        let digits = digits.trim_start_matches(['-', '0', '.', ' ']);
        let count = digits.chars().filter(char::is_ascii_digit).count();
        assert!(count <= 6, "{number} in {model_text}");
    }
    let after = place.result(compare);
    let error = |result: &serde_json::Value, key: &str| result["steps"][0][key].as_f64().unwrap();
    for (key, part) in [("rmse", 0.25), ("rmse_test", 1.0)] {
        let (before, after) = (error(&before, key), error(&after, key));
        println!("{key}: {before:.3} -> {after:.3} cm");
        assert!(after < part * before, "{key}: {before} -> {after}");
    }
    assert_eq!(after["known_effects"][0], "my_wave");
    // The message appears only in this case.
    let says = |result: &serde_json::Value, words: &str| {
        let said = result["sentences"].as_array().unwrap();
        said.iter().any(|one| one.as_str().unwrap().contains(words))
    };
    let by = |result| error(result, "rmse_test") / error(result, "rmse");
    for result in [&before, &after] {
        let carries = !says(result, "does not hold for that record");
        assert_eq!(carries, by(result) <= 2.0, "{}", by(result));
    }
    let small = "With my_wave in the model the standard errors are too small";
    assert!(says(&after, small) && !says(&before, small));
    let parameters = after["steps"][0]["parameters"].as_array().unwrap();
    assert!(parameters.iter().any(|p| p["name"] == "my_wave.scale"));

    // Kept unchanged.
    let held = place.read("tank.toml") + "fixed = true\n";
    place.write("held.toml", held);
    let kept = place.result("compare a.csv --model held.toml");
    assert!(error(&kept, "rmse") < 0.25 * error(&before, "rmse"));

    let said = place.succeeds("remove my_wave --model tank.toml");
    assert!(
        said.contains("[term.my_wave] is kept in the file for when it is added again"),
        "{said}"
    );
    assert!(place.read("tank.toml").starts_with(&model));
    let said = place.succeeds(compare);
    assert!(
        said.starts_with("note: [term.my_wave] has no effect until `ctid add my_wave`\n"),
        "{said}"
    );
    place.refuses(
        "add my_wave --from u.csv --model tank.toml",
        &[
            "[term.my_wave] exists already",
            "or `ctid add my_wave` alone",
        ],
    );
    assert_eq!(lasting(place.result(compare)), lasting(before));
    place.succeeds("add my_wave --model tank.toml");
    assert_eq!(lasting(place.result(compare)), lasting(after));
    place.refuses(
        "add my_wave --model tank.toml",
        &["my_wave is in the model already"],
    );
}

#[test]
fn nothing_is_written_where_nothing_is_unexplained() {
    let place = Place::empty();
    place.write("a.csv", Tanks::single().csv());
    place.write("tank.toml", Tanks::single().model());
    let text = place.succeeds("diagnose a.csv --model tank.toml --unknown u.csv");
    assert!(text.contains("u.csv is not written"), "{text}");
    assert!(!place.path("u.csv").exists());
}

#[test]
fn a_shape_that_cannot_be_is_refused() {
    let place = place();
    let head = "place,variable,at [cm],value [cm^3/s]\n";
    place.write(
        "bad.csv",
        format!("{head}vessel,level,8,1\nvessel,level,9,one\n"),
    );
    place.refuses(
        "add mine --from bad.csv --model tank.toml",
        &["bad.csv:3: column \"value\" holds \"one\"", "correct it"],
    );
    place.write("where.csv", format!("{head}upper,level,8,1\n"));
    place.refuses(
        "add mine --from where.csv --model tank.toml",
        &["where.csv: \"upper\" is not a place of plant single-tank"],
    );
    place.write("pump.csv", "place,variable,at,value\nactuator,level,8,1\n");
    place.refuses(
        "add mine --from pump.csv --model tank.toml",
        &[
            "pump.csv",
            "at the actuator a term cannot depend on level",
            "input, time",
        ],
    );
    place.write(
        "good.csv",
        format!("{head}vessel,level,8,1\nvessel,level,9,2\n"),
    );
    place.refuses(
        "add overflow --from good.csv --model tank.toml",
        &["the catalogue has an effect"],
    );
    place.refuses(
        "add my-leak --from good.csv --model tank.toml",
        &["letters, digits and underscores"],
    );
    place.refuses(
        "add mine --from none.csv --model tank.toml",
        &["none.csv: the shape cannot be read"],
    );
    place.refuses(
        "diagnose a.csv --model tank.toml --unknown tank.toml",
        &["one of the inputs"],
    );
    place.write("notes.csv", "my,notes\n");
    place.refuses(
        "diagnose a.csv --model tank.toml --unknown notes.csv",
        &["ctid did not write it"],
    );
    // A shape in another unit than the record's.
    place.write(
        "other.csv",
        "place,variable,at [m],value [m^3/s]\nvessel,level,8,1\nvessel,level,9,2\n",
    );
    place.succeeds("add mine --from other.csv --model tank.toml");
    place.refuses(
        "compare a.csv --model tank.toml",
        &["[term.mine] has at in m, but with a.csv it would be in cm"],
    );
    // A damaged table.
    let good = place.read("tank.toml");
    place.write(
        "tank.toml",
        good.replace("at = [8.0, 9.0]", "at = [9.0, 8.0]"),
    );
    place.refuses(
        "compare a.csv --model tank.toml",
        &["tank.toml:", "knots have to rise"],
    );
    place.write(
        "tank.toml",
        good.replace("variable = \"level\"", "variable = \"flow\""),
    );
    place.refuses(
        "compare a.csv --model tank.toml",
        &["tank.toml:", "\"flow\" is not a variable"],
    );
}
