//! The blind records with their plants as text beside the built-in plants: verdicts, effects and errors of both diagnoses.
//! `cargo run --release -p ctid-tests --example blind_as_text`
//!
//! The records and their model files lie in `../shared/blind/public` beside the checkout, or in the folder that is given as an argument; a
//! second argument selects the records whose names contain it. Both are simulated in the loop where the model file has a controller.

use std::error::Error;
use std::{env, fs};

use ct_model::ModelSpec;
use ctid_tests::{as_text, blind};
use plants::Plant;
use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let Some(public) = blind::folder() else {
        return Ok(());
    };
    let part = env::args().nth(2).unwrap_or_default();
    for (name, files) in blind::cases(&public, &part)? {
        let problem = files.read()?.problem;
        let built_in = missing_effect::diagnose(&problem, &Default::default(), &|_| {})?;
        let (spec, builder) = as_text::of_plant(&problem)?;
        let as_text = effect_search::diagnose(&builder.build()?, &Default::default(), &|_| {})?;
        let errors = |steps: Vec<Option<f64>>| {
            let known = [steps.first(), steps.last()];
            let known = known.into_iter().flatten().flatten();
            let texts: Vec<String> = known.map(|error| format!("{error:.4}")).collect();
            texts.join(" to ")
        };
        let truth = public.join(format!("../answers/{name}.answer.json"));
        let truth = match fs::read_to_string(truth) {
            Ok(text) => serde_json::from_str::<Value>(&text)?["class"].to_string(),
            Err(_) => "not known".to_string(),
        };
        println!("{name}, {}: {truth}", problem.plant.id());
        println!(
            "    built in  {:?} {}, {}, {:.1} s",
            built_in.verdict,
            groups(&built_in.groups),
            errors(built_in.steps.iter().map(|step| Some(step.rmse)).collect()),
            built_in.seconds
        );
        let named: Vec<Vec<String>> = as_text
            .groups
            .iter()
            .map(|group| in_catalogue(problem.plant, &spec, group))
            .collect();
        println!(
            "    as text   {:?} {}, {}, {:.1} s",
            as_text.verdict,
            groups(&named),
            errors(as_text.steps.iter().map(|step| step.rmse).collect()),
            as_text.seconds
        );
    }
    Ok(())
}

/// The names of the catalogue of tanks; an effect that has none there keeps its own.
fn in_catalogue(plant: Plant, spec: &ModelSpec, group: &[String]) -> Vec<String> {
    let names = group.iter().flat_map(|id| {
        let names = plant.names_of(spec, id);
        if names.is_empty() {
            vec![id.clone()]
        } else {
            names.into_iter().map(str::to_string).collect()
        }
    });
    let mut names: Vec<String> = names.collect();
    names.dedup();
    names
}

fn groups(groups: &[Vec<String>]) -> String {
    let groups: Vec<String> = groups.iter().map(|group| group.join("/")).collect();
    groups.join(" + ")
}
