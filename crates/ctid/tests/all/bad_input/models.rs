//! Invalid model files.

use std::fs;

use super::{both_refuse, model_refused, model_with, place};
use crate::common::bundled;

#[test]
fn an_unknown_plant() {
    model_refused(
        model_with("\"single-tank\" ", "\"single_tank\""),
        &[
            "bad.toml:1: unknown plant \"single_tank\"",
            "did you mean single-tank?",
        ],
    );
}

#[test]
fn no_plant() {
    model_refused(
        "effects = []\n",
        &["bad.toml: no plant is named", "write plant = "],
    );
}

#[test]
fn an_unknown_effect() {
    model_refused(
        model_with("effects = []", "effects = [\"overflw\"]"),
        &[
            "bad.toml:2: unknown effect \"overflw\"",
            "did you mean overflow?",
        ],
    );
}

#[test]
fn an_effect_that_is_no_list() {
    model_refused(
        model_with("effects = []", "effects = \"overflow\""),
        &["bad.toml:2: effects is a list; write effects = [\"overflow\"]"],
    );
}

#[test]
fn an_effect_twice() {
    model_refused(
        model_with("effects = []", "effects = [\"overflow\", \"overflow\"]"),
        &[
            "bad.toml:2: ",
            "`overflow` is listed twice",
            "delete one of them",
        ],
    );
}

#[test]
fn an_effect_of_another_plant() {
    model_refused(
        model_with("effects = []", "effects = [\"sqrt_outflow\"]"),
        &[
            "bad.toml:2: ",
            "`sqrt_outflow` does not act on plant `single-tank`",
        ],
    );
}

#[test]
fn an_unknown_key() {
    model_refused(
        model_with("area = 154.0", "aera = 154.0"),
        &["bad.toml:10: unknown key aera", "did you mean area?"],
    );
}

#[test]
fn bad_toml() {
    model_refused(
        model_with("effects = []", "effects = ["),
        &["bad.toml:", "array"],
    );
    model_refused(
        model_with("plant = \"single-tank\"", "plant = single-tank"),
        &["bad.toml:1: ", "quote"],
    );
}

#[test]
fn a_model_file_that_is_not_text() {
    model_refused(
        b"plant = \"\xff\xfe\"",
        &["bad.toml: ", "not UTF-8 text", "save it as UTF-8"],
    );
}

#[test]
fn a_negative_area() {
    model_refused(
        model_with("area = 154.0", "area = -154.0"),
        &[
            "bad.toml:10: area = -154 has to be above zero",
            "correct it",
        ],
    );
}

#[test]
fn a_word_for_a_number() {
    model_refused(
        model_with("area = 154.0", "area = \"154.0\""),
        &["bad.toml:10: ", "without quotes"],
    );
}

#[test]
fn an_unknown_start() {
    model_refused(
        bundled("tour.toml") + "\n[start]\nalfa = 11.0\n",
        &["bad.toml:13: ", "alfa", "did you mean alpha?"],
    );
}

#[test]
fn a_model_file_that_is_not_there() {
    let place = place();
    let says = [
        "none.toml: the model file cannot be opened",
        "check the path",
    ];
    both_refuse(&place, "tour.csv --model none.toml", &says);
    place.refuses("add overflow --model none.toml", &says);
    place.refuses("remove overflow --model none.toml", &says);
}

#[test]
fn a_folder_for_a_model_file() {
    let place = place();
    fs::create_dir(place.path("models")).unwrap();
    let says = ["models: ", "it is a folder", "name a file"];
    both_refuse(&place, "tour.csv --model models", &says);
    place.refuses("add overflow --model models", &says);
}

#[test]
fn record_and_model_exchanged() {
    let place = place();
    both_refuse(&place, "tour.toml --model tour.csv", &["tour.csv:1: "]);
}
