//! Results that would overwrite a file, or whose folder does not exist.

use std::fs;

use super::{Rows, both_refuse, place};

#[test]
fn a_result_in_a_folder_that_is_not_there() {
    let place = place();
    for command in ["compare", "diagnose"] {
        for result in ["--json no/out.json", "--report no/out.html"] {
            place.refuses(
                &format!("{command} tour.csv --model tour.toml {result}"),
                &["no/out.", "there is no folder no", "make it first"],
            );
        }
    }
}

#[test]
fn a_folder_for_a_result() {
    let place = place();
    fs::create_dir(place.path("results")).unwrap();
    for result in ["--json", "--report"] {
        place.refuses(
            &format!("diagnose tour.csv --model tour.toml {result} results"),
            &["results: it is a folder", "give the name of a file in it"],
        );
    }
}

#[test]
fn a_result_onto_an_input() {
    let place = place();
    for command in ["compare", "diagnose"] {
        for option in ["--json", "--report"] {
            for name in ["tour.csv", "tour-test.csv", "tour.toml", "./tour.csv"] {
                place.refuses(
                    &format!(
                        "{command} tour.csv --model tour.toml --test tour-test.csv {option} {name}"
                    ),
                    &[
                        &format!("{name}: it is one of the inputs"),
                        "choose another name",
                    ],
                );
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn a_result_onto_a_link_to_an_input() {
    let place = place();
    std::os::unix::fs::symlink(place.path("tour.csv"), place.path("link.json")).unwrap();
    place.refuses(
        "diagnose tour.csv --model tour.toml --json link.json",
        &["link.json: it is one of the inputs"],
    );
}

#[test]
fn results_onto_each_other() {
    place().refuses(
        "diagnose tour.csv --model tour.toml --json result --report ./result",
        &["result: two results cannot share a file"],
    );
}

#[test]
fn a_result_onto_a_foreign_file() {
    let place = place();
    place.write("notes.json", "{\"schema\": 3, \"mine\": true}");
    place.write("notes.html", "<html><p>my notes, made with ctid</p></html>");
    for command in ["compare", "diagnose"] {
        for result in [
            "--json notes.json --report out.html",
            "--json out.json --report notes.html",
            // A file of ctid, but of another kind.
            "--json out.html",
            "--report out.json",
        ] {
            place.refuses(
                &format!("{command} tour.csv --model tour.toml {result}"),
                &[
                    "the file exists already, and ctid did not write it",
                    "choose another name or delete it",
                ],
            );
        }
    }
}

#[test]
fn a_record_given_twice_or_fitted_and_held_out() {
    let place = place();
    both_refuse(
        &place,
        "tour.csv ./tour.csv --model tour.toml",
        &["./tour.csv: ", "given twice"],
    );
    both_refuse(
        &place,
        "tour.csv --model tour.toml --test ./tour.csv",
        &["./tour.csv: ", "both fitted and held out", "another record"],
    );
}

#[test]
fn two_records_of_one_name_are_told_apart() {
    let place = place();
    place.write("any.toml", "plant = \"single-tank\"\n");
    for (folder, unit) in [("monday", "y [cm]"), ("tuesday", "y [mm]")] {
        fs::create_dir(place.path(folder)).unwrap();
        place.write(
            &format!("{folder}/log.csv"),
            Rows::new().with(1, 2, unit).text(),
        );
    }
    both_refuse(
        &place,
        "monday/log.csv tuesday/log.csv --model any.toml",
        &[
            "tuesday/log.csv: column \"y\" is in mm",
            "monday/log.csv has it in cm",
        ],
    );
}
