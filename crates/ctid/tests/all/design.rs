//! `ctid design` through the program: its proposals, files and errors.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::common::{Place, Tanks};

/// A tank with a lag of the reading, or of the pump.
fn lagging() -> Place {
    let tanks = Tanks {
        hidden: vec![("sensor_lag", 0, vec![8.0])],
        rows: 300,
        ..Tanks::single()
    };
    let place = Place::empty();
    place.write("a.csv", tanks.csv());
    place.write("tank.toml", tanks.model());
    place
}

/// Numbers of a column of a CSV.
fn column(text: &str, at: usize) -> Vec<f64> {
    let cells = text
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(at).unwrap());
    cells.map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn an_undecided_verdict_points_to_the_experiment_that_is_then_written() {
    let place = lagging();
    let verdict = place.succeeds("diagnose a.csv --model tank.toml");
    let said = verdict.split_whitespace().collect::<Vec<_>>().join(" ");
    let command = said.split("`ctid design ... ").nth(1).unwrap();
    let between = command.split('`').next().unwrap();
    let words = format!("design a.csv --model tank.toml {between} --range 1.5 8.5 --json d.json");
    let text = place.succeeds(&words);
    assert!(
        text.contains("wrote d.json") && text.contains("wrote next.csv"),
        "{text}"
    );

    let found = place.json("d.json");
    assert_eq!(found["schema"], 1);
    for alternative in found["between"].as_array().unwrap() {
        assert!(between.contains(alternative["effect"].as_str().unwrap()));
    }
    // The printed result equals the written one.
    let best = &found["candidates"][0];
    let power = best["power"]["power"].as_f64().unwrap();
    assert_eq!(best["refitted"], true);
    assert!(power > found["again"]["power"]["power"].as_f64().unwrap());
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for sentence in found["sentences"].as_array().unwrap() {
        assert!(said.contains(sentence.as_str().unwrap()), "{sentence}");
    }

    let next = place.read("next.csv");
    assert!(next.starts_with("t [s],u [V]\n0,"));
    let applied = column(&next, 1);
    assert_eq!(applied.len(), 300);
    assert!(applied.iter().all(|u| (1.5..=8.5).contains(u)));
    let series = found["experiment"]["values"].as_array().unwrap();
    assert_eq!(series.len(), applied.len());

    // No file is overwritten, and the same request has the same result.
    let before = place.read("next.csv");
    place.succeeds(&words);
    assert_eq!(place.read("next.csv"), before);
    assert_eq!(place.read("next-2.csv"), before);
}

#[test]
fn limits_and_units_are_kept() {
    let place = lagging();
    let model = place.read("tank.toml") + "tank_height = 60.0\n\n[columns]\ntime = \"t [min]\"\n";
    place.write("tank.toml", model);
    let minutes = place.read("a.csv").replace("t [s]", "t [min]");
    place.write("a.csv", minutes);
    let text = place.succeeds(
        "design a.csv --model tank.toml --between sensor_lag pump_lag --range 1.5 8.5 --slew 0.005 --duration 48000 --seed 3 --out plan.csv",
    );
    assert!(text.contains("wrote plan.csv"), "{text}");
    let plan = place.read("plan.csv");
    assert!(plan.starts_with("t [min],u [V]\n0,"));
    let (time, applied) = (column(&plan, 0), column(&plan, 1));
    // A sample is 2 min: 400 of them in 48000 s.
    assert_eq!((time.len(), time[1]), (400, 2.0));
    assert!(applied.iter().all(|u| (1.5..=8.5).contains(u)));
    let steps = applied.windows(2).map(|w| (w[1] - w[0]).abs());
    assert!(steps.fold(0.0, f64::max) <= 0.005 * 120.0 + 1e-8);
}

#[test]
fn twins_are_said_to_be_twins_and_nothing_is_written() {
    let place = lagging();
    place.write("line.toml", "plant = \"single-tank-linear\"\n");
    // Steps that are small enough for a line.
    let tanks = Tanks {
        hidden: vec![("sensor_lag", 0, vec![8.0])],
        rows: 300,
        noise: 0.5,
        ..Tanks::single()
    };
    place.write("b.csv", tanks.csv());
    let text = place
        .succeeds("design b.csv --model line.toml --between sensor_lag pump_lag --json d.json");
    assert_eq!(place.json("d.json")["prospect"], "twins");
    assert!(
        !place.path("next.csv").exists() && !text.contains("next.csv"),
        "{text}"
    );
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("No experiment within these limits distinguishes them"),
        "{text}"
    );
    assert!(said.contains("Step the pump and watch the jet"), "{text}");
    let text = place
        .succeeds("design b.csv --model line.toml --between sensor_lag pump_lag --out to-play.csv");
    assert!(text.contains("to-play.csv is not written: no experiment is worth applying"));
    assert!(!place.path("to-play.csv").exists());
}

#[test]
fn of_two_tanks_the_places_can_be_named() {
    let tanks = Tanks {
        hidden: vec![("const_leak", 1, vec![4.0])],
        rows: 400,
        ..Tanks::cascaded()
    };
    let place = Place::empty();
    place.write("a.csv", tanks.csv());
    place.write("tanks.toml", tanks.model());
    let text = place.succeeds(
        "design a.csv --model tanks.toml --between const_leak:upper const_leak:lower --json d.json",
    );
    assert!(text.contains("const_leak (upper)"), "{text}");
    let found = place.json("d.json");
    assert_eq!(found["between"][0]["place"], "upper");
    assert_eq!(found["between"][1]["place"], "lower");
    // With the other level measured too, the place of the loss is determined.
    let second = &found["second_sensor"];
    let power = |of: &str| second[of]["power"].as_f64().unwrap();
    assert_eq!(second["level"], "level_upper");
    assert!(power("existing_with") > power("existing_without"));
}

#[test]
fn what_does_not_go_together_is_one_line() {
    let place = lagging();
    place.write("notes.csv", "mine\n");
    place.write(
        "on.toml",
        "plant = \"single-tank\"\neffects = [\"pump_lag\"]\n",
    );
    place.write(
        "full.toml",
        "plant = \"single-tank\"\n[known]\ninput_range = 10.0\n",
    );
    place.write(
        "low.toml",
        "plant = \"single-tank\"\n[known]\ntank_height = 28.0\n",
    );
    let pair = "design a.csv --model tank.toml --between sensor_lag pump_lag";
    for (words, says) in [
        (
            "design a.csv --model tank.toml --between sensor_leg pump_lag",
            &["did you mean sensor_lag?"][..],
        ),
        (
            "design a.csv --model tank.toml --between pump_lag pump_lag",
            &["cannot be distinguished from itself"],
        ),
        (
            "design a.csv --model tank.toml --between pump_lag",
            &["--between"],
        ),
        (
            "design a.csv --model tank.toml --between pump_lag:upper sensor_lag",
            &["has one tank"],
        ),
        (
            "design a.csv --model tank.toml --between sqrt_outflow sensor_lag",
            &["tank.toml", "sqrt_outflow"],
        ),
        (
            "design a.csv --model on.toml --between pump_lag sensor_lag",
            &["on.toml", "in the model already", "ctid remove"],
        ),
        (
            &format!("{pair} --range 6 4"),
            &["--range 6 4", "smaller value comes first"],
        ),
        (&format!("{pair} --range nan 4"), &["--range"]),
        (&format!("{pair} --range 4"), &["--range"]),
        (
            "design a.csv --model full.toml --between pump_lag sensor_lag --range -1 11",
            &["0 .. 10", "input_range"],
        ),
        (
            "design a.csv --model low.toml --between pump_lag sensor_lag --range 8 9",
            &["tank_height of 28", "--range"],
        ),
        (
            &format!("{pair} --duration 10"),
            &["--duration 10 s holds 5 samples", "at least 40 s"],
        ),
        (&format!("{pair} --duration -1"), &["--duration"]),
        (
            &format!("{pair} --duration 1e9"),
            &["--duration", "shorter"],
        ),
        (
            &format!("{pair} --slew 0.0001"),
            &["--slew 0.0001", "at least"],
        ),
        (&format!("{pair} --slew 0"), &["--slew 0"]),
        (
            &format!("{pair} --out a.csv"),
            &["a.csv", "one of the inputs"],
        ),
        (
            &format!("{pair} --out notes.csv"),
            &["notes.csv", "the file exists already"],
        ),
        (
            &format!("{pair} --out no/next.csv"),
            &["there is no folder"],
        ),
        (
            &format!("{pair} --json notes.csv"),
            &["notes.csv", "did not write it"],
        ),
        (
            "design b.csv --model tank.toml --between pump_lag sensor_lag",
            &["b.csv"],
        ),
    ] {
        place.refuses(words, says);
    }
}
