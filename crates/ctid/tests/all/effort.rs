//! Time limits of a search, and its interruption.

use crate::common::{Place, Tanks};

#[test]
fn the_limit_is_chosen_and_written() {
    let place = Place::new();
    for (command, level) in [("compare", "quick"), ("diagnose", "thorough")] {
        let json = place.result(&format!(
            "{command} tour.csv --model tour.toml --effort {level}"
        ));
        assert_eq!(json["effort"]["interrupted"], false);
    }
    place.refuses(
        "diagnose tour.csv --model tour.toml --effort endless",
        &["endless", "quick, normal, thorough"],
    );
}

/// Warnings about the records and their time stamps come first.
#[test]
fn what_is_known_of_the_records_beforehand_is_said() {
    let place = Place::new();
    let said = |words: &str| {
        let text = place.succeeds(&format!("compare {words} --model tour.toml"));
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let text = place.read("tour.csv");
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    for (name, rows) in [("a.csv", &rows[..450]), ("b.csv", &rows[450..])] {
        place.write(name, format!("{header}\n{}\n", rows.join("\n")));
    }
    let continued = "note: a.csv, b.csv: the time stamps continue from file to file";
    assert!(said("a.csv b.csv").starts_with(continued));
    for other in ["tour.csv", "b.csv a.csv"] {
        let said = said(other);
        assert!(
            !said.contains("note:") && !said.contains("warning:"),
            "{said}"
        );
    }
    let mut step = String::from("t [s],u [V],y [cm]\n");
    for k in 0..400 {
        let (u, y) = if k < 50 { (4, 12.0) } else { (5, 15.0) };
        step += &format!("{},{u},{}\n", 2 * k, y + 0.05 * f64::from(k * 7 % 5));
    }
    place.write("step.csv", step);
    let warning = "warning: step.csv: the command makes a single step, from 4.00 to 5.00 V";
    assert!(said("step.csv").starts_with(warning));
}

/// The first interrupt gives the best result so far, the second one ends the program at once.
#[test]
#[cfg(unix)]
fn a_second_interrupt_ends_it_at_once() {
    use std::io::{BufRead, BufReader};
    use std::process::Command;

    let tanks = Tanks {
        rows: 20_000,
        hidden: vec![("pump_lag", 0, vec![25.0]), ("overflow", 1, vec![16.5])],
        ..Tanks::cascaded()
    };
    let place = Place::empty();
    place.write("data.csv", tanks.csv());
    place.write("model.toml", tanks.model());
    let mut child = place
        .command("diagnose data.csv --model model.toml --json result.json")
        .spawn()
        .unwrap();
    let interrupt = |id: u32| {
        let sent = Command::new("kill")
            .args(["-INT", &id.to_string()])
            .status();
        assert!(sent.unwrap().success());
    };
    // The program has read the record by then, and its search takes far longer.
    std::thread::sleep(std::time::Duration::from_millis(1500));
    interrupt(child.id());
    let mut said = String::new();
    let mut err = BufReader::new(child.stderr.take().unwrap());
    err.read_line(&mut said).unwrap();
    assert!(said.contains("best result so far"), "{said}");
    interrupt(child.id());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!place.path("result.json").exists());
}
