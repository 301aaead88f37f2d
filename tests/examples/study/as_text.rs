//! The same records, diagnosed with the plant as a model that is written as text.

use std::error::Error;

use ctid_tests::{Rig, as_text};
use effect_search::{Diagnosis, Options, diagnose};

use crate::outcome::Answer;

/// The diagnosis with the text of the plant. The effects are those of the catalogue of tanks.
pub fn diagnosed(rig: &Rig, kernel: &missing_effect::Problem) -> Result<Diagnosis, Box<dyn Error>> {
    let (spec, builder) = as_text::of_plant(kernel)?;
    let general = rig.plant.general_effects(&spec);
    let problem = builder.left_out(general).build()?;
    Ok(diagnose(&problem, &Options::default(), &|_| {})?)
}

/// The answer, with the names of the catalogue of tanks.
pub fn answer(rig: &Rig, found: &Diagnosis) -> Result<Answer, Box<dyn Error>> {
    let spec = rig.plant.spec(&rig.known())?;
    let names = |ids: &[String]| -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in ids.iter().flat_map(|id| rig.plant.names_of(&spec, id)) {
            if !names.iter().any(|known| known == name) {
                names.push(name.to_string());
            }
        }
        names
    };
    let groups = found.groups.iter().map(|group| names(group)).collect();
    let named = (names(&found.effects), groups);
    Ok(Answer::new(rig, found.verdict, named, found.seconds))
}
