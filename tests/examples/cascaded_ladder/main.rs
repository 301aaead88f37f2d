//! The measured Cascaded Tanks of `../shared/data` beside the checkout, from the plain square-root model as a text: the effects that an
//! engineer would try, added one at a time.
//!
//! ```sh
//! cargo build --release && cargo run --release -p ctid-tests --example cascaded_ladder [-- --rungs N]
//! ```
//! Each rung is one of the two effects with which BIC falls most, in `ctid compare` from its many starts: the one with the smaller error in
//! a cross-validation, in which each quarter of the estimation record is left out of the fit. The test record is only scored: no choice
//! depends on it. Takes five minutes on two cores for six rungs.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Parser;
use ctid_tests::program::{program, result};
use serde_json::Value;

/// Effects of tanks, pumps and sensors. Parameters that change with a signal, and functions of time, are left out: they fit anything.
const CANDIDATES: [&str; 19] = [
    "overflow(h1,h2)",
    "limit(h1)",
    "limit(h2)",
    "leak_at_height(h1)",
    "leak_at_height(h2)",
    "coupling(h1,h2)",
    "constant(h1)",
    "constant(h2)",
    "dead_zone(u)",
    "saturation(u)",
    "nonlinearity(u)",
    "lag(u)",
    "delay(u)",
    "backlash(u)",
    "lag(y)",
    "offset(y)",
    "nonlinearity(y)",
    "saturation(y)",
    "sticking(y)",
];

/// Effects of a rung that are cross-validated.
const VALIDATED: usize = 2;
/// Parts of the estimation record, each of which is left out once.
const FOLDS: usize = 4;

/// Adds effects to the model of the Cascaded Tanks.
#[derive(Debug, Parser)]
struct Arguments {
    /// Largest number of effects.
    #[arg(long, default_value_t = 6)]
    rungs: usize,
}

/// A model with effects: its criterion, and its errors \[V\].
struct Rung {
    bic: f64,
    fitted: f64,
    /// Held out, with initial states fitted to the first 5 rows, which are not scored; `None` if no simulation reaches the end.
    held_out: Option<f64>,
    /// The same with 50 rows.
    held_out_50: Option<f64>,
    /// In the cross-validation.
    left_out: Option<f64>,
}

/// The program, its records and a folder for the model.
struct Tanks {
    program: PathBuf,
    records: [PathBuf; 2],
    folder: tempfile::TempDir,
}

fn main() {
    let Arguments { rungs } = Arguments::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = root.join("../../shared/data/cascaded_tanks");
    let records = ["estimation.csv", "test.csv"].map(|name| data.join(name));
    if !records.iter().all(|record| record.exists()) {
        println!("skipped: {} is not there", data.display());
        return;
    }
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().unwrap();
    let own = root.join("examples/cascaded_ladder");
    std::fs::copy(own.join("tanks.mo"), folder.path().join("tanks.mo")).unwrap();
    let text = std::fs::read_to_string(own.join("tanks.toml")).unwrap();
    let tanks = Tanks {
        program,
        records,
        folder,
    };
    let fitted = |effects: &[&str]| tanks.fitted(&text, effects);
    println!(
        "| model | BIC | error [V] | cross-validation [V] | held out, 5 rows [V] | held out, 50 rows [V] |"
    );
    println!("|---|---|---|---|---|---|");
    let mut last = fitted(&[]).unwrap();
    last.left_out = tanks.left_out(&text, &[]);
    print("two tanks, square-root outlets", &last);
    let mut effects: Vec<&str> = Vec::new();
    while effects.len() < rungs {
        let left = CANDIDATES.iter().filter(|id| !effects.contains(id));
        let tried = left.filter_map(|id| {
            let with = [effects.as_slice(), &[id]].concat();
            match fitted(&with) {
                Ok(rung) => Some((*id, rung)),
                Err(why) => {
                    eprintln!("{id}: left out: {why}");
                    None
                }
            }
        });
        let mut best: Vec<(&str, Rung)> = tried
            .filter(|(_, rung)| rung.bic < last.bic - 6.0)
            .collect();
        best.sort_by(|(_, a), (_, b)| a.bic.total_cmp(&b.bic));
        best.truncate(VALIDATED);
        for (id, rung) in &mut best {
            rung.left_out = tanks.left_out(&text, &[effects.as_slice(), &[*id]].concat());
        }
        let error = |rung: &Rung| rung.left_out.unwrap_or(f64::INFINITY);
        let least = best
            .into_iter()
            .min_by(|(_, a), (_, b)| error(a).total_cmp(&error(b)));
        let Some((id, rung)) = least else {
            break;
        };
        print(&format!("+ `{id}`"), &rung);
        effects.push(id);
        last = rung;
    }
}

impl Tanks {
    /// The last model of a comparison with these effects.
    fn compared(
        &self,
        text: &str,
        effects: &[&str],
        records: &[PathBuf],
        test: &Path,
    ) -> Result<Value, String> {
        let model = self.folder.path().join("tanks.toml");
        let quoted: Vec<String> = effects.iter().map(|id| format!("\"{id}\"")).collect();
        let with = format!("effects = [{}]\n{text}", quoted.join(", "));
        std::fs::write(&model, with).map_err(|error| error.to_string())?;
        let mut compare = Command::new(&self.program);
        compare.arg("compare").args(records).arg("--test").arg(test);
        let (found, _) = result(compare.arg("--model").arg(&model))?;
        let last = found["steps"].as_array().and_then(|steps| steps.last());
        last.cloned().ok_or("no model".to_string())
    }

    /// The model with effects, fitted to the estimation record and scored on the test record.
    fn fitted(&self, text: &str, effects: &[&str]) -> Result<Rung, String> {
        let [estimation, test] = &self.records;
        let step = self.compared(text, effects, std::slice::from_ref(estimation), test)?;
        let number = |value: &Value| value.as_f64().ok_or("a figure is missing".to_string());
        Ok(Rung {
            bic: number(&step["bic"])?,
            fitted: number(&step["rmse_per_output"]["y"])?,
            held_out: step["rmse_test_per_output"]["y"].as_f64(),
            held_out_50: step["outputs"][0]["rmse_test_50"].as_f64(),
            left_out: None,
        })
    }

    /// The error in the cross-validation \[V\]: each quarter of the estimation record is left out of a fit to the rows before and after it,
    /// which are two records.
    fn left_out(&self, text: &str, effects: &[&str]) -> Option<f64> {
        let record = std::fs::read_to_string(&self.records[0]).ok()?;
        let (header, rows) = record.split_once('\n')?;
        let rows: Vec<&str> = rows.lines().collect();
        let written = |name: &str, rows: &[&str]| -> Option<PathBuf> {
            let path = self.folder.path().join(name);
            std::fs::write(&path, format!("{header}\n{}\n", rows.join("\n"))).ok()?;
            Some(path)
        };
        let mut squares = 0.0;
        for fold in 0..FOLDS {
            let at = |fold: usize| rows.len() * fold / FOLDS;
            let (from, to) = (at(fold), at(fold + 1));
            let mut fitted = Vec::new();
            for (name, part) in [("before.csv", &rows[..from]), ("after.csv", &rows[to..])] {
                if !part.is_empty() {
                    fitted.push(written(name, part)?);
                }
            }
            let test = written("left-out.csv", &rows[from..to])?;
            let step = self.compared(text, effects, &fitted, &test).ok()?;
            squares += step["rmse_test_per_output"]["y"].as_f64()?.powi(2);
        }
        Some((squares / FOLDS as f64).sqrt())
    }
}

fn print(model: &str, rung: &Rung) {
    let volts = |error: Option<f64>| error.map_or(String::new(), |error| format!("{error:.3}"));
    println!(
        "| {model} | {:.0} | {:.3} | {} | {} | {} |",
        rung.bic,
        rung.fitted,
        volts(rung.left_out),
        volts(rung.held_out),
        volts(rung.held_out_50)
    );
}
