//! The parts of a result without the findings: fitted models, noise floors, records.

use ct_signals::Clock;
use greybox::Noise;

use crate::{
    Diagnosis, Effort, NoiseFloor, NoiseSource, Problem, Rankings, Shown, Step, Verdict,
    result::Floors,
};

/// The noise floors of a noise model.
pub(crate) fn floors(problem: &Problem, noise: &Noise, source: NoiseSource) -> Floors {
    let outputs = problem.records[0].outputs.iter().zip(noise.iter());
    let floors = outputs.map(|(output, noise)| NoiseFloor {
        output: output.name.clone(),
        level: noise.stationary_std(),
        innovation: noise.sigma(),
        coefficients: noise.coefficients().to_vec(),
        source,
        of_innovation: false,
    });
    Floors(floors.collect())
}

/// Everything but the findings.
pub(crate) fn assemble(
    problem: &Problem,
    verdict: Verdict,
    steps: Vec<Step>,
    noise: Floors,
) -> Diagnosis {
    let noise = noise.0;
    let outputs = &problem.records[0].outputs;
    Diagnosis {
        schema: 4,
        verdict,
        effects: Vec::new(),
        groups: Vec::new(),
        in_doubt: Vec::new(),
        places: Vec::new(),
        acceptance: None,
        rankings: Rankings::default(),
        effort: Effort::default(),
        residual_unexplained: false,
        not_noise: None,
        ranked: Vec::new(),
        steps,
        noise_floor: match &noise[..] {
            [only] => only.level,
            _ => f64::NAN,
        },
        noise,
        scores: Vec::new(),
        unknown: None,
        control_loop: None,
        remarks: Vec::new(),
        gaps: None,
        clock: Clock::of(problem.records.iter().chain(&problem.test)),
        plant: problem.plant.id().to_string(),
        known_effects: problem
            .effects
            .iter()
            .map(|placed| placed.effect.id.to_string())
            .chain(problem.terms.iter().map(|term| term.name.clone()))
            .collect(),
        input_unit: problem.records[0].inputs[0].unit.clone(),
        outputs: outputs.iter().map(|output| output.name.clone()).collect(),
        output_unit: outputs[0].unit.clone(),
        output_units: Vec::new(),
        records: problem
            .records
            .iter()
            .map(|record| Shown::of(record, false))
            .chain(problem.test.iter().map(|record| Shown::of(record, true)))
            .collect(),
        seconds: 0.0,
    }
}
