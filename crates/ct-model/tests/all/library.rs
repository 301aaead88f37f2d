//! The example models with the inputs of their records: compared with an adaptive solver, and their derivatives with differences.

use std::path::{Path, PathBuf};

use crate::support::{Case, check_outside, model};

/// Rows of a record that are simulated.
const ROWS: usize = 250;

/// Each model with the inputs of its record.
fn cases() -> Vec<(String, Case)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models");
    let paths = std::fs::read_dir(folder).unwrap();
    let paths = paths.map(|entry| entry.unwrap().path());
    let is_text = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "mo");
    let mut paths: Vec<PathBuf> = paths.filter(is_text).collect();
    paths.sort();
    paths.iter().map(|path| case(path)).collect()
}

fn case(path: &Path) -> (String, Case) {
    let read = |ending| std::fs::read_to_string(path.with_extension(ending)).unwrap();
    let (model, record) = (model(&read("mo")), read("csv"));
    let heads: Vec<&str> = record.lines().next().unwrap().split(',').collect();
    let rows = record.lines().skip(1).take(ROWS).map(|line| {
        let cells = line.split(',').zip(&heads);
        let value = |(cell, head): (&str, &&str)| {
            let of_thousands = f64::from(u16::from(head.contains("[W/m2]")));
            cell.parse::<f64>().unwrap() * 1e-3_f64.powf(of_thousands)
        };
        cells.map(value).collect::<Vec<f64>>()
    });
    let count = model.spec().inputs.len();
    let rows: Vec<Vec<f64>> = rows.collect();
    let case = Case {
        model,
        time: rows.iter().map(|row| row[0]).collect(),
        inputs: rows.iter().map(|row| row[1..=count].to_vec()).collect(),
        lines: read("toml").contains("hold = \"first\""),
        tolerance: ct_model::TOLERANCE,
    };
    (
        path.file_stem().unwrap().to_string_lossy().into_owned(),
        case,
    )
}

#[test]
fn outputs_agree_with_an_adaptive_solver() {
    let cases = cases();
    assert_eq!(cases.len(), 8);
    assert_eq!(cases.iter().filter(|(_, case)| case.lines).count(), 1);
    for (name, case) in cases {
        println!("{name}");
        check_outside(&case, 1e-7);
    }
}

#[test]
fn derivatives_agree_with_central_differences() {
    for (name, case) in cases() {
        println!("{name}");
        case.check_derivatives(1e-5);
    }
}
