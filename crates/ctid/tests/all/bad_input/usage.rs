//! Invalid commands.

use super::{Rows, model_with, place};

#[test]
fn effects_that_cannot_be_added_or_removed() {
    let place = place();
    place.write(
        "on.toml",
        model_with("effects = []", "effects = [\"overflow\"]"),
    );
    for (words, says) in [
        (
            "add overfow --model tour.toml",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
        (
            "add overflow --model on.toml",
            [
                "on.toml: overflow is in the model already",
                "`ctid remove overflow`",
            ],
        ),
        (
            "add sqrt_outflow --model tour.toml",
            ["tour.toml: ", "does not act on plant `single-tank`"],
        ),
        (
            "add overflow --where upper --model tour.toml",
            ["tour.toml: ", "has one vessel"],
        ),
        (
            "remove overfow --model on.toml",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
        (
            "remove pump_lag --model on.toml",
            [
                "on.toml: pump_lag is not in the model",
                "effects = [\"overflow\"]",
            ],
        ),
        (
            "effects overfow",
            ["unknown effect \"overfow\"", "did you mean overflow?"],
        ),
    ] {
        place.refuses(words, &says);
    }
}

#[test]
fn wrong_usage() {
    let place = place();
    for (words, says) in [
        (
            "diagnos tour.csv --model tour.toml",
            ["'diagnos'", "diagnose"],
        ),
        (
            "diagnose tour.csv --modle tour.toml",
            ["'--modle'", "'--model'"],
        ),
        ("diagnose tour.csv", ["--model", "--help"]),
        ("diagnose --model tour.toml", ["DATA.csv", "--help"]),
        (
            "diagnose tour.csv --model tour.toml --max-effects 0",
            ["'0'", "--max-effects"],
        ),
        (
            "add overflow --where middle --model tour.toml",
            ["'middle'", "upper, lower"],
        ),
        ("remove overflow", ["--model", "--help"]),
        (
            "diagnose tour.csv --model tour.toml --max-effects -1",
            ["-1 is not in 1..", "--max-effects"],
        ),
        (
            "identify tour.csv --method ls --order -1,0",
            ["'--order <N,M>'", "n from 1 to 4 and m from 0 to n"],
        ),
        (
            "tables --runs -1",
            [
                "'-1' for '--runs <N>'",
                "20 or more for udink, 10 or more for baysse",
            ],
        ),
        (
            "tables --seed -1",
            ["'-1' for '--seed <S>'", "from 0 to 18446744073709551615"],
        ),
        (
            "design tour.csv --model tour.toml --between pump_lag sensor_lag --seed -1",
            ["'-1' for '--seed <S>'", "from 0 to 18446744073709551615"],
        ),
        (
            "identify tour.csv --method ct-rls --memory -3",
            ["memory", "-3"],
        ),
        (
            "identify tour.csv --method ls --bandwidth -3",
            ["bandwidth", "-3"],
        ),
        (
            "identify tour.csv --method ls --columns a,b,c",
            [
                "no column \"a\" for the time",
                "name it with --columns TIME,INPUT,OUTPUT",
            ],
        ),
        (
            "identify tour.csv --method ls --columns t,u,u",
            [
                "both as input and as output",
                "with --columns TIME,INPUT,OUTPUT",
            ],
        ),
        (
            "compare tour.toml --model tour.csv",
            [
                "tour.csv:1: ",
                "is this the record? --model takes the .toml",
            ],
        ),
        (
            "compare tour.toml --model tour.toml",
            [
                "tour.toml, row 1",
                "is this the model file? DATA takes the record, a .csv",
            ],
        ),
    ] {
        place.refuses(words, &says);
    }
}

#[test]
fn columns_that_the_option_has_to_name() {
    let place = place();
    let header = |names: [&str; 3]| {
        let rows = Rows::new().with(1, 0, names[0]).with(1, 1, names[1]);
        rows.with(1, 2, names[2]).text()
    };
    place.write("volts.csv", header(["t", "u [V]", "y"]));
    place.write("minutes.csv", header(["t [min]", "u", "y"]));
    place.write("inputs.csv", header(["t", "u_1", "u_2"]));
    for (words, says) in [
        (
            "volts.csv --columns t,u[m],y",
            "the file says V but --columns says m; write \"u [V]\" in --columns TIME,INPUT,OUTPUT",
        ),
        ("inputs.csv", "say which with --columns TIME,INPUT,OUTPUT"),
        ("minutes.csv --columns t,U,z", "--columns TIME,INPUT,OUTPUT"),
    ] {
        place.refuses(&format!("identify {words} --method ls"), &[says]);
    }
}
