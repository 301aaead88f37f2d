//! Runs without random numbers against a record of them, to 1e-6: the settings of the paper's tables, made by an independent program.
//!
//! Two of the rows stand here as well, so that the test is one everywhere.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;

use ct_rls::{Euler, ExactHold};
use support::tables::{Run, Setting, TABLES, noise_free_power, run};

/// Two rows of the record: `Setting::COARSE` and table 2 with the sine noise.
const KEPT: &str = "\
R1 v_k=0.2*sin(1.3*k^1.5) y0 power 0.429678947
  T2 Euler K 1.00726047 tau 9.8167341 c 0.10062634 sdc 0.2266469 E 342.51282 373.06234 378.01264 378.20038 P11 7.8718163 P12 0.45400187 P22 0.046002346 P2 0.96833081
  T2 exact K 1.00686671 tau 9.8032047 c 0.09711647 sdc 0.2233869 E 341.29370 371.24076 376.75673 376.95537 P11 8.1796290 P12 0.47683300 P22 0.047797067 P2 0.98068658
";

/// To 1e-6, or to the last digit of what was printed as 0.
fn agrees(printed: &str, found: f64) -> bool {
    let value: f64 = printed.parse().unwrap();
    (value - found).abs() <= (1e-6 * value.abs()).max(5e-8)
}

fn check(text: &str) -> usize {
    let (mut rows, mut wrong) = (0, Vec::new());
    let mut setting = Setting::COARSE;
    let mut noise: fn(usize) -> f64 = |_| 0.0;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [name @ ("R1" | "R2"), v, "y0", "power", power] => {
                setting = if *name == "R1" {
                    Setting::COARSE
                } else {
                    Setting::FINE
                };
                noise = if *v == "v=0" {
                    |_| 0.0
                } else {
                    |k| 0.2 * (1.3 * (k as f64).powf(1.5)).sin()
                };
                assert!(agrees(power, noise_free_power::<Euler>(&setting)));
            }
            [table, integrator, rest @ ..] => {
                let table = &TABLES[table[1..].parse::<usize>().unwrap() - 1];
                let found = match *integrator {
                    "Euler" => run::<Euler>(&setting, table, noise),
                    _ => run::<ExactHold>(&setting, table, noise),
                };
                rows += 1;
                let values = values(&found);
                let printed = rest.iter().filter(|w| w.parse::<f64>().is_ok());
                assert_eq!(printed.clone().count(), values.len(), "{line}");
                for (printed, found) in printed.zip(values) {
                    if !agrees(printed, found) {
                        wrong.push(format!("{line}\n    {printed} is {found}"));
                    }
                }
            }
            _ => {}
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    rows
}

fn values(run: &Run) -> [f64; 12] {
    let [k, tau, c] = run.average;
    let [e250, e500, e750, e1000] = run.criterion;
    let [p11, p12, p22] = run.p1;
    [
        k,
        tau,
        c,
        run.deviation_c,
        e250,
        e500,
        e750,
        e1000,
        p11,
        p12,
        p22,
        run.p2,
    ]
}

#[test]
fn two_rows_that_stand_here() {
    assert_eq!(check(KEPT), 2);
}

#[test]
fn all_rows_of_the_record() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/reproduction/udink-reference.txt");
    match std::fs::read_to_string(&file) {
        Ok(text) => assert_eq!(check(&text), 32),
        Err(_) => eprintln!("skipped: {} is not there", file.display()),
    }
}
