//! The same records, diagnosed with the plant as a model that is written as text.

use std::error::Error;

use ctid_tests::Rig;
use effect_search::{Diagnosis, Options, Problem, diagnose};

use crate::outcome::Answer;

/// The diagnosis with the text of the plant, on the measured command. The effects are those of the catalogue of tanks.
pub fn diagnosed(rig: &Rig, kernel: &missing_effect::Problem) -> Result<Diagnosis, Box<dyn Error>> {
    let mut record = kernel.records[0].clone();
    let spec = rig.plant.spec_of(&kernel.known, &mut record)?;
    record.references.clear();
    let general = rig.plant.general_effects(&spec);
    let problem = Problem::builder(spec, [record]).left_out(general).build()?;
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
