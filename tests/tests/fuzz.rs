//! Inputs drawn at random, two hundred of each kind, of models as text forty: none does what [`ctid_tests::fuzz::run`] calls a fault.

use std::env;
use std::process::ExitCode;

use ctid_tests::fuzz::{Kind, as_program, run};

/// Cases of a kind. A text whose words are exchanged may be simulated in many steps, until the time limit of a command.
fn cases(kind: Kind) -> u64 {
    if kind == Kind::Text { 40 } else { 200 }
}

/// The smallest and the largest share of cases with a result; a share outside would mean that nearly all inputs are valid or invalid.
const RESULTS: std::ops::Range<f64> = 0.05..0.95;

fn main() -> ExitCode {
    if let Some(code) = as_program() {
        return code;
    }
    // Arguments as in the standard test harness: a list, or a part of a name.
    let words: Vec<String> = env::args().skip(1).collect();
    let wanted = |kind: &Kind| {
        let mut names = words
            .iter()
            .filter(|word| !word.starts_with('-'))
            .peekable();
        names.peek().is_none() || names.any(|name| format!("fuzz::{kind}").contains(name.as_str()))
    };
    let mut failed = false;
    for kind in Kind::ALL.into_iter().filter(wanted) {
        if words.iter().any(|word| word == "--list") {
            println!("fuzz::{kind}: test");
            continue;
        }
        let cases = cases(kind);
        let report = run(kind, 0, cases, |_| ());
        let share = report.accepted as f64 / report.cases as f64;
        println!(
            "{kind}: {} cases, {:.0} % with a result, {} faults",
            report.cases,
            100.0 * share,
            report.faults.len()
        );
        for (number, fault) in &report.faults {
            println!("{kind} {number}: {fault}");
        }
        failed |= report.cases != cases || !report.faults.is_empty() || !RESULTS.contains(&share);
    }
    if failed {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
