//! The tool's answers on the blind records: `cargo run --release -p ctid-tests --example blind_answers` writes
//! `tests/blind-answers.json`.
//!
//! The records and their model files lie in `../shared/blind/public` beside the checkout, or in the folder that is given as an
//! argument. The answers are written without a look at the truth, so that they can be scored elsewhere. Where the truth lies in
//! `answers` beside `public`, the scores are printed: the first answer in the truth's class, and by how much the error over that
//! of the true structure falls.

use std::{error::Error, fs, path::Path};

use ctid_tests::blind;
use missing_effect::{Diagnosis, Options, Verdict, diagnose};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Some(public) = blind::folder() else {
        return Ok(());
    };
    let mut answers = Vec::new();
    let (mut right, mut scored, mut falls) = (0, 0, Vec::new());
    for (name, files) in blind::cases(&public, "")? {
        let found = diagnose(&files.read()?.problem, &Options::default(), &|_| {})?;
        answers.push(answer(&name, &found));
        let truth = public.join(format!("../answers/{name}.answer.json"));
        let mut line = format!("{name} {:?} {}", found.verdict, first(&found));
        if truth.exists() {
            let truth: Value = serde_json::from_str(&fs::read_to_string(truth)?)?;
            let hit = in_class(&first(&found), &truth["class"]);
            scored += 1;
            right += usize::from(hit);
            line += &format!(
                ", class {}: {}",
                truth["class"],
                if hit { "right" } else { "WRONG" }
            );
            let (before, after) = (found.steps.first(), found.steps.last());
            let floor = truth["noise_floor_rmse"].as_f64();
            if let (false, Some(before), Some(after), Some(floor)) =
                (found.effects.is_empty(), before, after, floor)
            {
                // The residual of the true structure is the floor; additional errors add to it as squares.
                let excess = |rmse: f64| (rmse * rmse - floor * floor).max(0.0).sqrt();
                let fall = 1.0 - excess(after.rmse) / excess(before.rmse);
                falls.push(fall);
                line += &format!(", excess error falls by {:.1} %", 100.0 * fall);
            }
        }
        println!("{line}, {:.1} s", found.seconds);
    }
    if scored > 0 {
        falls.sort_by(f64::total_cmp);
        let median = falls.get(falls.len() / 2).copied().unwrap_or(f64::NAN);
        println!(
            "{right} of {scored} right; the excess error falls by a median of {:.1} %",
            100.0 * median
        );
    }
    let path = package.join("blind-answers.json");
    fs::write(&path, serde_json::to_string_pretty(&answers)? + "\n")?;
    println!("wrote {}", path.display());
    Ok(())
}

fn answer(name: &str, found: &Diagnosis) -> Value {
    json!({
        "case": name,
        "verdict": found.verdict,
        "effects": found.effects,
        "groups": found.groups,
        "ranked": found.ranked,
        "rmse": found.steps.iter().map(|step| step.rmse).collect::<Vec<_>>(),
        "noise_floor": found.noise_floor,
    })
}

/// The first answer as the classes write it: `none`, an effect, or a pair joined by a plus in the order of the alphabet.
fn first(found: &Diagnosis) -> String {
    match found.verdict {
        Verdict::Adequate => "none".to_string(),
        Verdict::Unexplained => "unexplained".to_string(),
        _ => joined(&found.effects),
    }
}

fn joined(effects: &[String]) -> String {
    let mut effects = effects.to_vec();
    effects.sort_unstable();
    effects.join("+")
}

fn in_class(answer: &str, class: &Value) -> bool {
    class
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .any(|member| {
            let effects: Vec<String> = member.split('+').map(str::to_string).collect();
            joined(&effects) == answer
        })
}
