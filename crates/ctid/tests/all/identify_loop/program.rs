//! The program in a loop: its files and errors.

use ct_signals::{Channel, Record, excitation};
use fcloe::{Noise, PlantModel, sampled_loop};
use linear_identification::{LevelChoice, Order, Request, identify};
use serde_json::Value;

use super::{METHODS, PI, controller, first_order, record};
use crate::common::Place;

fn csv(record: &Record) -> String {
    let mut text = "t [s],u [V],y [cm],r [cm]\n".to_owned();
    let r = &record.references.first().unwrap().values;
    for (k, time) in record.time.iter().enumerate() {
        let (u, y) = (record.inputs[0].values[k], record.outputs[0].values[k]);
        text += &format!("{time},{u:.6},{y:.6},{}\n", r[k]);
    }
    text
}

fn model(gain: f64, limits: &str) -> String {
    let time = PI.1;
    format!(
        "plant = \"single-tank-linear\"\n[controller]\ntype = \"PI\"\ngain = {gain}\nintegral_time = {time}\n{limits}"
    )
}

fn place() -> Place {
    let place = Place::empty();
    place.write(
        "loop.csv",
        csv(&record(&first_order(), &controller(), Some(25.0), 3)),
    );
    place.write("loop.toml", model(PI.0, ""));
    place
}

#[test]
fn the_program_writes_what_it_prints() {
    let place = place();
    for method in ["ls", "iv", "fcloe", "recursive-fcloe"] {
        let text = place.succeeds(&format!(
            "identify loop.csv --model loop.toml --method {method} --json out.json --report out.html"
        ));
        assert!(
            text.contains("The loop, and how it was estimated"),
            "{text}"
        );
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "wider than 80: {line}");
        }
        let json = place.json("out.json");
        assert_eq!(json["method"], method);
        let names = json["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| &p["name"]);
        assert_eq!(names.collect::<Vec<_>>(), ["a1", "b0"]);
        for parameter in json["parameters"].as_array().unwrap() {
            let known = parameter["std_error"].as_f64().is_some_and(|e| e > 0.0);
            assert_eq!(known, method != "ls", "{method}: {parameter}");
        }
        assert_eq!(json["in_loop"]["r"].as_array().unwrap().len(), 2);
        assert_eq!(json["trajectory"].is_null(), method != "recursive-fcloe");
        let page = place.read("out.html");
        let has = |id: &str| {
            let drawn = page.contains(&format!("\"id\":\"{id}\""));
            assert_eq!(drawn, page.contains(&format!("id=\"plot-{id}\"")), "{id}");
            drawn
        };
        assert!(has("fit"));
        assert_eq!(has("condition"), method.ends_with("fcloe"));
        assert_eq!(has("trajectory"), method == "recursive-fcloe");
    }
    // Without the model file there is no controller: open loop.
    let json: Value = place.result("identify loop.csv --method fcloe");
    assert_eq!(json["in_loop"]["r"], serde_json::json!([]));
}

#[test]
fn what_cannot_be_is_refused() {
    let place = place();
    let bad = |words: &str, says: &[&str]| {
        place.refuses(&format!("identify {words}"), says);
    };
    let loops = "loop.csv --model loop.toml --method";
    for method in ["ls", "iv", "fcloe", "recursive-fcloe"] {
        // no reference
        let text = place.read("loop.csv");
        let columns = text.lines().map(|line| line.rsplit_once(',').unwrap().0);
        place.write("open.csv", columns.collect::<Vec<_>>().join("\n"));
        bad(
            &format!("open.csv --model loop.toml --method {method}"),
            &["open.csv", "no reference r"],
        );
        // one that is constant
        let still = text
            .lines()
            .map(|line| match line.rsplit_once(',').unwrap() {
                (rest, r) if r.starts_with('r') => format!("{rest},{r}"),
                (rest, _) => format!("{rest},20"),
            });
        place.write("still.csv", still.collect::<Vec<_>>().join("\n"));
        bad(
            &format!("still.csv --model loop.toml --method {method}"),
            &["still.csv", "r is 20 throughout"],
        );
        // too short
        let short: Vec<&str> = text.lines().take(16).collect();
        place.write("short.csv", short.join("\n"));
        bad(
            &format!("short.csv --model loop.toml --method {method}"),
            &["short.csv", "15", "20 are needed"],
        );
        // another controller: the size of the mismatch is said
        place.write("other.toml", model(0.5, ""));
        bad(
            &format!("loop.csv --model other.toml --method {method}"),
            &[
                "loop.csv: the measured command disagrees with the controller of the model file",
                " V rms, ",
                "check gain, integral_time (s), u_min and u_max, the sign",
            ],
        );
        // the sign
        place.write("sign.toml", model(-PI.0, ""));
        bad(
            &format!("loop.csv --model sign.toml --method {method}"),
            &["loop.csv", "sign"],
        );
    }
    // Several methods say the same, in the row of each and where all refuse.
    let other = "the measured command disagrees with the controller of the model file";
    bad(
        "loop.csv --model other.toml --method ls,iv",
        &["loop.csv", other],
    );
    place.succeeds("identify loop.csv --model other.toml --method ls,ct-rls --json both.json");
    let json = place.json("both.json");
    let refused = &json["methods"][1]["refused"];
    assert!(refused.as_str().unwrap().contains(other), "{refused}");
    bad(
        &format!("{loops} iv --memory 100"),
        &["--memory does not go with"],
    );
    bad(
        &format!("{loops} iv --levels estimated"),
        &["--levels estimated is for fcloe only"],
    );
    bad(
        &format!("{loops} ct-rls --levels mean"),
        &["--levels does not go with"],
    );
    bad(
        &format!("{loops} fcloe --sensor-filter=-1"),
        &["sensor filter", "-1"],
    );
    bad(
        "loop.csv --method fcloe --sensor-filter 1",
        &["--sensor-filter is of a loop"],
    );
    bad(
        &format!("{loops} fcloe --bandwidth 0"),
        &["--bandwidth is 0"],
    );
}

/// A plant with the opposite sign of the gain: the signals grow, and no stable loop produces them.
#[test]
fn a_loop_that_is_not_stable_is_refused() {
    let plant = PlantModel::first_order(-1.0, 110.0).unwrap();
    let r = excitation::prbs(1500, 30, -1.0, 1.0, 7).unwrap();
    let data = sampled_loop(&plant, &controller(), 1.0, 1, &r, Noise::None, None).unwrap();
    let record = Record {
        name: "loop".into(),
        time: (0..r.len()).map(|k| k as f64).collect(),
        inputs: vec![Channel::new("u", "V", data.u)],
        outputs: vec![Channel::new("y", "cm", data.y)],
        references: vec![Channel::new("r", "cm", r)],
        ..Record::default()
    };
    for method in METHODS {
        let request = Request {
            controller: Some(controller()),
            levels: LevelChoice::Zero,
            ..Request::new(method, Order { n: 1, m: 0 })
        };
        let error = identify(&record, &request)
            .map(|found| found.parameters)
            .unwrap_err();
        let error = error.to_string();
        assert!(
            error.starts_with("loop: ") && error.contains("stab"),
            "{method:?}: {error}"
        );
    }
}

#[test]
fn a_command_at_its_limits_and_a_controller_a_little_off_are_said() {
    let place = place();
    place.write("limits.toml", model(PI.0, "u_min = 3.9\nu_max = 4.1\n"));
    let text = place.succeeds("identify loop.csv --model limits.toml --method fcloe");
    assert!(text.contains("the command is at its limits"), "{text}");
    place.write("off.toml", model(1.07 * PI.0, ""));
    let text = place.succeeds("identify loop.csv --model off.toml --method fcloe");
    assert!(text.contains("the controller misses"), "{text}");
}

#[test]
fn a_controller_by_its_polynomials_is_the_same_one() {
    let place = place();
    let law = |more: &str| {
        let r = format!("r = [{}, {}]", PI.0, PI.0 / PI.1);
        format!("plant = \"first-order\"\n[controller]\ntype = \"RS\"\n{r}\ns = [1.0, 0.0]\n{more}")
    };
    place.write("p.toml", law("variable = \"p\"\n"));
    let of =
        |model: &str| place.result(&format!("identify loop.csv --method fcloe --model {model}"));
    let [pi, p] = ["loop.toml", "p.toml"].map(|model| of(model)["parameters"].clone());
    assert_eq!(pi, p);
    place.write("sampled.toml", law(""));
    let words = "identify loop.csv --method fcloe --model sampled.toml";
    place.refuses(words, &["in continuous time", "variable = \"p\""]);
}
