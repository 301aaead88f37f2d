//! Two tanks in series whose pump saturates at a fifth of the recorded range of the command: the result of a diagnosis, the range of the
//! unmeasured level in its models, and the computing time. In every second record no constant of the plant is given. `cargo run --release -p
//! ctid-tests --example low_saturation`.

use std::{collections::BTreeMap, error::Error, fs, path::PathBuf};

use clap::Parser;
use ctid_tests::Rig;
use greybox::Setup;
use missing_effect::{Diagnosis, Options, Problem, Step, TIME_LIMIT, compare, diagnose};
use plants::{EffectInfo, Known, Placed};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// Diagnoses two tanks whose pump saturates low.
#[derive(Debug, Parser)]
struct Arguments {
    /// Rows of a record, one a second.
    #[arg(default_value_t = 3700)]
    rows: usize,
    /// Number of records, each with a separate seed.
    #[arg(long, default_value_t = 2)]
    records: u64,
    /// Writes every record's outcome.
    #[arg(long)]
    json: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let rig = Rig {
        theta: vec![25.0, 11.2, 12.5],
        levels: vec![20.0, 16.0],
        hidden: vec![("pump_saturation", 0, vec![2.0])],
        command: (0.0, 10.0),
        noise: 0.02,
        hold: (150, 400),
        samples: arguments.rows,
        interval: 1.0,
        ..Rig::cascaded_tanks()
    };
    let mut all = Vec::new();
    let options = Options {
        time_limit: Some(TIME_LIMIT),
        ..Options::default()
    };
    for seed in 0..arguments.records {
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
        let mut problem = rig.problem(record);
        if seed % 2 == 1 {
            problem.known = Known::default();
        }
        let compared = compare(&problem, &options)?;
        let found = diagnose(&problem, &options, &|_| {})?;
        let first = found
            .effects
            .first()
            .is_some_and(|effect| effect == "pump_saturation");
        println!(
            "record {seed}: {:?} {:?}, pump_saturation {}; compare {:.1} s, diagnose {:.1} s",
            found.verdict,
            found.groups,
            if first { "first" } else { "NOT FIRST" },
            compared.seconds,
            found.seconds
        );
        let mut upper = Vec::new();
        for (k, step) in found.steps.iter().enumerate() {
            let largest = largest_upper_level(&rig, &problem, &found, k);
            upper.push(largest);
            println!(
                "  {:<20} error {:.4} cm, upper level up to {} cm",
                step.added.as_deref().unwrap_or("believed"),
                step.rmse,
                largest.map_or("?".to_string(), |level| format!("{level:.1}"))
            );
            print_parameters(step);
        }
        all.push(json!({
            "record": seed,
            "verdict": found.verdict,
            "groups": found.groups,
            "first": first,
            "upper_level": upper,
            "compare_seconds": compared.seconds,
            "seconds": found.seconds,
        }));
    }
    if let Some(path) = &arguments.json {
        fs::write(path, serde_json::to_string_pretty(&all)? + "\n")?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

fn print_parameters(step: &Step) {
    let values: Vec<String> = step
        .parameters
        .iter()
        .map(|own| format!("{} {:.4}", own.name, own.value))
        .collect();
    println!("    {}", values.join(", "));
}

/// The largest level of the upper tank in the model of a step.
fn largest_upper_level(rig: &Rig, problem: &Problem, found: &Diagnosis, k: usize) -> Option<f64> {
    let effects = found.steps[..=k].iter().filter_map(|step| {
        let effect = EffectInfo::find(step.added.as_deref()?)?;
        effect
            .sites(rig.plant, &rig.known())
            .map(|vessel| Placed { effect, vessel })
            .find(|placed| placed.place_name(rig.plant, &rig.known()) == step.place.as_deref())
    });
    let effects: Vec<Placed> = effects.collect();
    let records = &problem.records;
    let setup = Setup::from_records(
        rig.plant,
        problem.known.clone(),
        &effects,
        records,
        BTreeMap::new(),
    )
    .ok()?;
    let value = |name: &String| {
        let mut parameters = found.steps[k].parameters.iter();
        parameters
            .find(|own| own.name == *name)
            .map(|own| own.value)
    };
    let x: Vec<f64> = setup.names().iter().map(value).collect::<Option<_>>()?;
    Some(setup.simulate(&x).ok()?.level[0].1)
}
