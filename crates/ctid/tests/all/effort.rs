//! How long a search may take, and how it is ended earlier.

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

/// The first interrupt asks for the best so far, the second ends the program at once.
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
    // It has read the record by then, and searches for far longer.
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
