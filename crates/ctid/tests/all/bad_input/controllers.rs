//! Controllers that cannot have produced the record.

use super::{both_refuse, model_refused, place};
use crate::common::{Tanks, bundled};

/// A loop of which the model file says that it cannot be stable.
fn unstable(tanks: &Tanks, controller: &str) {
    let place = place();
    place.write("loop.csv", tanks.csv());
    place.write(
        "loop.toml",
        tanks.model() + "\n[controller]\ntype = \"PI\"\nu_min = 0.0\nu_max = 10.0\n" + controller,
    );
    let settings = controller.trim_end().replace('\n', ", ");
    both_refuse(
        &place,
        "loop.csv --model loop.toml",
        &["loop.toml: ", "unstable", "check", &settings],
    );
}

#[test]
fn a_controller_of_the_wrong_sign() {
    unstable(&Tanks::single(), "gain = -2\nintegral_time = 90\n");
}

#[test]
fn a_gain_beyond_all_reason_is_told_in_few_digits() {
    let place = place();
    let tanks = Tanks::single();
    place.write("loop.csv", tanks.csv());
    let controller =
        "type = \"PI\"\nu_min = 0.0\nu_max = 10.0\ngain = -1e12\nintegral_time = 1e-9\n";
    place.write("loop.toml", tanks.model() + "\n[controller]\n" + controller);
    both_refuse(
        &place,
        "loop.csv --model loop.toml",
        &[
            "loop.toml: ",
            "unstable",
            "grows more than a thousand times a sample",
        ],
    );
}

#[test]
fn constants_with_which_nothing_can_be_simulated() {
    let place = place();
    place.write(
        "small.toml",
        bundled("tour.toml").replace("154.0", "1e-300"),
    );
    both_refuse(
        &place,
        "tour.csv --model small.toml",
        &["tour.csv: none of ", "starts", "[known]"],
    );
}

#[test]
fn a_controller_that_integrates_too_fast() {
    unstable(&Tanks::cascaded(), "gain = 2\nintegral_time = 4\n");
}

#[test]
fn a_controller_that_cannot_work() {
    let controller = |lines: &str| bundled("tour.toml") + "\n[controller]\n" + lines;
    for (lines, says) in [
        (
            "type = \"PI\"\ngain = 0.0\nintegral_time = 90",
            ["gain = 0", "other than zero"],
        ),
        (
            "type = \"PI\"\ngain = nan\nintegral_time = 90",
            ["gain = NaN", "finite number"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = -90",
            ["integral_time = -90", "positive time"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = 90\nu_min = 10\nu_max = 0",
            ["u_min = 10 is not below u_max = 0", "swap them"],
        ),
        (
            "type = \"PI\"\ngain = 0.6\nintegral_time = 90\nu_min = nan",
            ["u_min = NaN", "finite number"],
        ),
        (
            "type = \"PID\"\ngain = 0.6\nintegral_time = 90",
            ["controller type \"PID\"", "write type = \"PI\""],
        ),
        ("type = \"PI\"\ngain = 0.6", ["no integral_time", "write"]),
    ] {
        model_refused(controller(lines), &[&["bad.toml:"], &says[..]].concat());
    }
}
