//! Instructions per recursive least squares update, counted by valgrind: the same on any machine of the same kind, however busy.
//!
//! The program runs itself under callgrind with one and with three rounds; the difference is two rounds of updates and nothing else.
#![allow(missing_docs, clippy::expect_used)]

mod rls_cases;

use std::hint::black_box;
use std::process::Command;

use rls_cases::{Dsmc, Dynamic, Factored, Operators, SAMPLES, samples};

const WHO: [&str; 4] = ["ct-rls", "run-time size", "operators", "dsmc"];

fn rounds<const P: usize>(who: &str, rounds: usize) {
    let samples = samples::<P>();
    let (mut ours, mut dynamic) = (Factored::<P>::new(), Dynamic::new(P));
    let (mut operators, mut dsmc) = (Operators::<P>::new(), Dsmc::new(P));
    for _ in 0..rounds {
        black_box(match who {
            "ct-rls" => ours.run(&samples),
            "run-time size" => dynamic.run(&samples),
            "operators" => operators.run(&samples),
            _ => dsmc.run(&samples),
        });
    }
}

/// Instructions of a whole run, or why there is no figure.
fn count(who: &str, p: usize, rounds: usize) -> Result<f64, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(["--rounds", who, &p.to_string(), &rounds.to_string()])
        .output()
        .map_err(|e| format!("valgrind does not start: {e}"))?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    text.lines()
        .find_map(|line| line.split("Collected : ").nth(1)?.trim().parse().ok())
        .ok_or_else(|| format!("valgrind says: {text}"))
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, who, p, n] = arguments.as_slice()
        && flag == "--rounds"
    {
        let n = n.parse().expect("a number of rounds");
        match p.as_str() {
            "2" => rounds::<2>(who, n),
            "5" => rounds::<5>(who, n),
            _ => rounds::<10>(who, n),
        }
        return;
    }
    println!("instructions per update:");
    println!("| p | {} |", WHO.join(" | "));
    println!("|---|---|---|---|---|");
    for p in [2, 5, 10] {
        let figures: Result<Vec<String>, String> = WHO
            .iter()
            .map(|who| {
                let two_rounds = count(who, p, 3)? - count(who, p, 1)?;
                Ok(format!("{:.1}", two_rounds / (2 * SAMPLES) as f64))
            })
            .collect();
        match figures {
            Ok(figures) => println!("| {p} | {} |", figures.join(" | ")),
            Err(reason) => {
                println!("skipped: {reason}");
                return;
            }
        }
    }
}
