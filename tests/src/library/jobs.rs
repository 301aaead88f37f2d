//! The records that a study may make.

use ct_model::effects::{Visited, candidates};
use ctid_examples::model_records::DrivenModel;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Hidden, Job, outside, own};

/// Records of the models of these names, or of all where none is given: in each what may be hidden in it, in white and coloured noise, in
/// open and closed loop, with each of these structural errors over the noise. `records`: of each of them.
pub fn jobs(
    models: &[DrivenModel],
    of: &[String],
    ratios: &[f64],
    records: u64,
    rng: &mut ChaCha8Rng,
) -> Vec<Job> {
    let mut jobs = Vec::new();
    for (model, driven) in models.iter().enumerate() {
        if !of.is_empty() && !of.iter().any(|m| m == driven.name) {
            continue;
        }
        let all = candidates(&driven.spec, &Visited::nominal(&driven.spec));
        let effects: Vec<String> = all.iter().map(|c| c.id.clone()).collect();
        let own: Vec<String> = own::candidates(driven.name).into_keys().collect();
        let mut hidden: Vec<(&'static str, Hidden)> = Vec::new();
        hidden.extend(
            effects
                .iter()
                .map(|id| ("single", Hidden::Effects(vec![id.clone()]))),
        );
        hidden.extend(
            own.iter()
                .map(|id| ("own", Hidden::Effects(vec![id.clone()]))),
        );
        let both: Vec<&String> = effects.iter().chain(&own).collect();
        for _ in 0..both.len() {
            let a = both[rng.random_range(0..both.len())];
            // In about half of the cases one of the two is a user's own candidate.
            let b = if rng.random::<f64>() < 0.4 && !own.is_empty() {
                &own[rng.random_range(0..own.len())]
            } else {
                both[rng.random_range(0..both.len())]
            };
            if a != b {
                hidden.push(("pair", Hidden::Effects(vec![a.clone(), b.clone()])));
            }
        }
        hidden.extend((0..20).map(|_| ("clean", Hidden::Nothing)));
        hidden.extend(
            (0..3 * outside::KINDS.len())
                .map(|k| ("outside", Hidden::Outside(k % outside::KINDS.len()))),
        );
        let mut number = 0;
        for (kind, hidden) in hidden {
            for &ratio in ratios {
                for coloured in [false, true] {
                    for closed in [false, true] {
                        for _ in 0..records {
                            number += 1;
                            jobs.push(Job {
                                model,
                                kind,
                                hidden: hidden.clone(),
                                ratio,
                                coloured,
                                closed,
                                number,
                            });
                        }
                    }
                }
            }
        }
    }
    jobs
}
