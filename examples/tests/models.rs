//! The models in `examples/models` against their records, by the program: each is fitted to its noise, and its parameters are found.
#![allow(clippy::unwrap_used, clippy::panic)]

use clap::Parser;
use ctid::{Cli, look::Look, run};
use ctid_examples::model_records::{self, ModelRecord};
use serde_json::Value;

fn compared(name: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("found.json");
    let of = |ending: &str| model_records::folder().join(name).with_extension(ending);
    let (csv, model) = (of("csv"), of("toml"));
    let arguments = ["ctid", "compare"].map(Into::into).into_iter();
    let arguments = arguments.chain([csv.into(), "--model".into(), model.into()]);
    let arguments = arguments.chain(["--json".into(), json.clone().into_os_string()]);
    run(
        Cli::parse_from(arguments),
        &mut std::io::sink(),
        Look::plain(),
    )
    .unwrap_or_else(|error| panic!("{name}: {error}"));
    serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap()
}

#[test]
fn each_is_fitted_to_its_noise() {
    for ModelRecord {
        name, csv, noise, ..
    } in model_records::make().unwrap()
    {
        let found = compared(name);
        let rows = csv.lines().count() - 1;
        assert!((300..=1500).contains(&rows), "{name}: {rows} rows");
        // The error of a standard deviation that is estimated of so many rows, three times.
        let tolerance = 3.0 / (2.0 * rows as f64).sqrt();
        let outputs = found["steps"][0]["rmse_per_output"].as_object().unwrap();
        assert_eq!(outputs.len(), noise.len());
        for (output, sigma) in noise {
            let ratio = outputs[&output].as_f64().unwrap() / sigma;
            let too_small = ratio < 1.0 - 2.0 * tolerance;
            assert!(
                ratio < 1.0 + tolerance && !too_small,
                "{name}, {output}: {ratio} of its noise"
            );
        }
        let undetermined = &found["steps"][0]["not_determined"];
        assert!(undetermined.is_null(), "{name}: {undetermined}");
    }
}

#[test]
fn the_parameters_that_made_the_record_are_found() {
    for ModelRecord {
        name,
        parameters,
        guesses,
        ..
    } in model_records::make().unwrap()
    {
        let found = compared(name);
        let step = &found["steps"][0];
        let estimates = step["parameters"].as_array().unwrap();
        let mut off_as_guessed = 0;
        for ((parameter, truth), guess) in parameters.iter().zip(guesses) {
            let of_it = |estimate: &&Value| estimate["name"] == parameter.as_str();
            let estimate = estimates.iter().find(of_it).unwrap();
            let value = estimate["value"].as_f64().unwrap();
            let Some(std_error) = estimate["std_error"].as_f64() else {
                assert_eq!(value, *truth, "{name}, {parameter}: known");
                continue;
            };
            assert!(
                (value - truth).abs() < 4.0 * std_error && std_error < 0.05 * truth.abs(),
                "{name}, {parameter}: {value} with a standard error of {std_error} instead of {truth}"
            );
            off_as_guessed += usize::from((guess / truth - 1.0).abs() > 0.15);
        }
        // The text has guesses.
        assert!(off_as_guessed >= 2, "{name}");
        assert!(step["starts_agree"].as_u64().unwrap() >= 5, "{name}");
    }
}
