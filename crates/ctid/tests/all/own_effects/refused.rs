//! Effects and candidates that are refused in one line.

use std::fmt::Write;

use super::{BLOCK, MODEL, place};

#[test]
fn what_cannot_be_added_is_refused_in_a_line() {
    let place = place();
    place.refuses(
        "add lagg(y) --model m.toml",
        &[
            "\"lagg(y)\" is not an effect that can act in Block",
            "did you mean lag(y)?",
        ],
    );
    place.refuses(
        "add lag(q) --model m.toml",
        &["lag may act here: lag(u), lag(Ta), lag(y)"],
    );
    place.refuses(
        "add lag(y) --model m.toml --where upper",
        &["--where is for the built-in plants only"],
    );
    place.refuses(
        "remove lag(y) --model m.toml",
        &["lag(y) is not in the model", "effects = []"],
    );
    place.refuses(
        "add lag(y) --model m.toml --from a.csv",
        &["a.csv: this is not a result of a model of your own"],
    );
    place.succeeds("compare a.csv --model m.toml --json bare.json");
    place.refuses(
        "add lag(y) --model m.toml --from bare.json",
        &["the result does not contain lag(y)"],
    );
    place.succeeds("add lag(y) --model m.toml");
    place.refuses(
        "add lag(y) --model m.toml",
        &["lag(y) is in the model already"],
    );
    place.write("other.mo", BLOCK.replace("Block", "Other"));
    place.write("other.toml", MODEL.replace("block.mo", "other.mo"));
    place.refuses(
        "add lag(y) --model other.toml --from bare.json",
        &["the result is for model Block, but this file has Other"],
    );
    let refused = |lines: &str, says: &[&str]| {
        let text = MODEL.replace("effects = []          # nothing yet", lines);
        place.write("bad.toml", text);
        place.refuses("compare a.csv --model bad.toml", says);
    };
    refused(
        "effects = [\"lag(y)\",\n \"lagg(u)\"]",
        &[
            "bad.toml:3: \"lagg(u)\" is not an effect",
            "did you mean lag(u)?",
        ],
    );
    refused(
        "effects = [\"lag(y)\", \"lag( y )\"]",
        &["bad.toml:2: lag(y) is listed twice"],
    );
    refused(
        "effect.\"lag(y)\".tua = 3.0",
        &["bad.toml:2: tua is not a parameter of lag(y): there are tau; did you mean tau?"],
    );
    refused(
        "effect.\"lag(y)\".record = { durations = 3.0 }",
        &[
            "bad.toml:2: durations is not a number of the record of lag(y)",
            "did you mean duration?",
        ],
    );
    refused(
        "effect.\"lag(y)\".tau = nan",
        &["bad.toml:2: tau has to be a finite number"],
    );
    refused(
        "effect.\"lag(y)\".fixed = [\"tau\"]",
        &["bad.toml:2: tau is fixed and has no value"],
    );
}

#[test]
fn a_candidate_that_cannot_be_is_refused_with_its_line_and_the_mend() {
    let place = place();
    let refused = |candidates: &str, says: &[&str]| {
        place.write("bad.toml", format!("{MODEL}\n{candidates}\n"));
        for command in ["compare", "diagnose"] {
            place.refuses(&format!("{command} a.csv --model bad.toml"), says);
        }
    };
    let one = |name: &str, parameters: &str, terms: &str| {
        format!("[candidates.{name}]\nparameters = {{ {parameters} }}\nterms = {{ {terms} }}\n")
    };
    refused(
        &one("draught", "c = { start = 0.1 }", "T = \"-c*(T - Tq)\""),
        &[
            "bad.toml:9: candidates.draught.terms.T: 1:9: `Tq` is not declared",
            "did you mean `Ta`?",
        ],
    );
    refused(
        &one("draught", "c = { start = 0.1 }", "Tq = \"-c*T\""),
        &[
            "bad.toml:9: candidates.draught.terms.Tq: `Tq` is not a state, named flow or output of Block",
            "T, y",
        ],
    );
    let twins = one("draught", "c = { start = 0.1 }", "T = \"-c*(T - Ta)^2\"")
        + &one("wind", "w = { start = 3.0 }", "T = \"-w*(T - Ta)^2\"");
    refused(
        &twins,
        &["bad.toml:10: candidates.wind: it is the same as draught: keep one of them"],
    );
    refused(
        &one("draught", "", "T = \"-0.1*(T - Ta)\""),
        &["bad.toml:7: candidates.draught: it has no parameter: give it one"],
    );
    refused(
        &one("draught", "c = { start = 0.1 }", ""),
        &["bad.toml:7: candidates.draught: it has no terms: write"],
    );
}

#[test]
fn a_thousand_candidates_end_in_bounded_time() {
    let place = place();
    let mut file = MODEL.to_string();
    for k in 1..=1000 {
        let term = format!("a*sin({}*time)", f64::from(k) / 1000.0);
        write!(file, "\n[candidates.c{k}]\nparameters = {{ a = {{ start = 1.0 }} }}\nterms = {{ T = \"{term}\" }}\n").unwrap();
    }
    place.write("m.toml", file);
    let said = place.succeeds("compare a.csv --model m.toml");
    let notes: Vec<&str> = said
        .lines()
        .filter(|line| line.contains("no part in"))
        .collect();
    assert!(
        said.contains("[candidates.c1], [candidates.c10], [candidates.c100] and 997 more"),
        "{notes:?}"
    );
    let begun = std::time::Instant::now();
    place.succeeds("diagnose a.csv --model m.toml --effort quick --json found.json");
    // The limit of this effort is 5 s; running steps are ended then.
    assert!(begun.elapsed().as_secs() < 40, "{:?}", begun.elapsed());
    let found = place.json("found.json");
    assert!(found["candidates"].as_u64().unwrap() > 1000);
}
