//! Records of nine models in which effects are hidden, from `../shared/domains` beside the checkout: what `ctid` says of each, and the
//! answer where it lies beside.
//!
//! ```sh
//! cargo build --release && cargo run --release -p ctid-tests --example domains [-- [--seeds N] CASE...]
//! ```
//! `--seeds 5` fits the believed models alone, from starts of five seeds each, and says how far their errors are from the answers'.
//!
//! Prints for each case the error of the believed model at each output as `compare` has it, against that of the answer, which was fitted
//! with white noise or in the noise's own weighting, and the verdict of `diagnose`; then how many are right.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;
use ctid_tests::program::{program, result};
use serde_json::Value;

/// Diagnoses records with hidden effects.
#[derive(Debug, Parser)]
struct Arguments {
    /// Names of the cases to run.
    cases: Vec<String>,
    /// Fits the believed models alone, from starts of so many seeds each.
    #[arg(long, value_name = "N")]
    seeds: Option<u64>,
}

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/domains");
    let Ok(folder) = std::fs::read_dir(root.join("public")) else {
        println!("skipped: {} is not there", root.display());
        return;
    };
    let Some(program) = program() else { return };
    let Arguments {
        cases: wanted,
        seeds,
    } = Arguments::parse();
    let mut cases: Vec<String> = folder
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|case| wanted.is_empty() || wanted.contains(case))
        .collect();
    cases.sort();
    let run = |case: &str, command: &[&str]| -> (Value, f64) {
        let own = root.join("public").join(case);
        let mut run = Command::new(&program);
        run.args(command).args(records(&own));
        run.arg("--model").arg(own.join("model.toml"));
        let found = result(&mut run).map_err(|why| format!("{case}: {why}"));
        found.unwrap()
    };
    let answer_of = |case: &str| -> Option<Value> {
        let text = std::fs::read_to_string(root.join(format!("answers/{case}.json"))).ok()?;
        Some(serde_json::from_str(&text).unwrap())
    };
    if let Some(seeds) = seeds {
        with_seeds(&cases, seeds, &run, &answer_of);
        return;
    }
    let mut right: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    for case in cases {
        let (compared, _) = run(&case, &["compare"]);
        let (found, seconds) = run(&case, &["diagnose"]);
        println!(
            "{case}: {} {} ({seconds:.1} s)",
            found["verdict"], found["groups"]
        );
        let Some(answer) = answer_of(&case) else {
            continue;
        };
        println!("    hidden: {} {}", answer["type"], answer["truth"]);
        for (i, (output, rmse)) in compared["steps"][0]["rmse_per_output"]
            .as_object()
            .unwrap()
            .iter()
            .enumerate()
        {
            let against = |key: &str| {
                100.0 * (rmse.as_f64().unwrap() / answer[key][i].as_f64().unwrap() - 1.0)
            };
            println!(
                "    {output}: {:+.2} % of the answer's fit in white noise, {:+.2} % of that in the noise's weighting",
                against("rmse_base_white_fit"),
                against("rmse_base")
            );
        }
        let kind = answer["type"].as_str().unwrap().to_string();
        let count = right.entry(kind.clone()).or_default();
        count.1 += 1;
        count.0 += usize::from(is_right(&kind, &answer, &found));
    }
    for (kind, (right, of)) in right {
        println!("{kind}: {right} of {of} right");
    }
}

/// The errors of the believed models from starts of several seeds, against those of the answers' fits: of white noise, as `compare` fits.
fn with_seeds(
    cases: &[String],
    seeds: u64,
    run: &impl Fn(&str, &[&str]) -> (Value, f64),
    answer_of: &impl Fn(&str) -> Option<Value>,
) {
    let (mut compared, mut within, mut unlike) = (0, [0, 0], 0);
    for case in cases {
        let errors: Vec<Vec<f64>> = (1..=seeds)
            .map(|seed| {
                let (found, _) = run(case, &["compare", "--seed", &seed.to_string()]);
                let outputs = found["steps"][0]["rmse_per_output"].as_object().unwrap();
                outputs
                    .values()
                    .map(|rmse| rmse.as_f64().unwrap())
                    .collect()
            })
            .collect();
        let spread = (0..errors[0].len()).map(|o| {
            let of = |pick: fn(f64, f64) -> f64| errors.iter().map(|e| e[o]).reduce(pick);
            of(f64::max).unwrap() / of(f64::min).unwrap() - 1.0
        });
        let spread = spread.fold(0.0, f64::max);
        if spread > 1e-3 {
            unlike += 1;
            println!("{case}: {:.2} % between seeds", 100.0 * spread);
        }
        let Some(answer) = answer_of(case) else {
            continue;
        };
        let keys = ["rmse_base", "rmse_base_white_fit"].map(|key| {
            let worst = errors.iter().flat_map(|errors| {
                let pairs = errors.iter().zip(answer[key].as_array().unwrap());
                pairs.map(|(own, other)| own / other.as_f64().unwrap() - 1.0)
            });
            worst.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
        });
        compared += 1;
        let near = keys.map(|off| off.abs() <= 0.01);
        for (within, near) in within.iter_mut().zip(near) {
            *within += usize::from(near);
        }
        if near != [true; 2] {
            println!(
                "{case}: at most {:+.2} % of the answer's fit in the noise's weighting, {:+.2} % of that in white noise",
                100.0 * keys[0],
                100.0 * keys[1]
            );
        }
    }
    println!(
        "of {compared} cases with an answer {} are within 1 % of its fit in the noise's weighting, {} of that in white noise; {unlike} of {} depend on \
         the seed by more than 0.1 %",
        within[0],
        within[1],
        cases.len()
    );
}

fn records(folder: &Path) -> Vec<PathBuf> {
    ["data.csv", "data2.csv"]
        .map(|name| folder.join(name))
        .into_iter()
        .filter(|path| path.exists())
        .collect()
}

/// Single effects and pairs: the truth, or what cannot be distinguished from it, is in the groups; nothing hidden: adequate; from outside
/// the candidates: unexplained or partial.
fn is_right(kind: &str, answer: &Value, found: &Value) -> bool {
    let verdict = found["verdict"].as_str().unwrap();
    let claims = ["effect", "undecided", "partial"].contains(&verdict);
    match kind {
        "none" => verdict == "adequate",
        "outside" => verdict == "unexplained" || verdict == "partial",
        _ => {
            let named: Vec<&Value> = found["groups"]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|group| group.as_array().unwrap())
                .collect();
            let mut sets = vec![&answer["truth"]];
            sets.extend(answer["also_right"].as_array().unwrap());
            let all_named = |set: &&Value| match set.as_array() {
                Some(set) => set.iter().all(|id| named.contains(&id)),
                None => named.contains(set),
            };
            claims && sets.iter().any(all_named)
        }
    }
}
