//! The traps that make a tool of this kind lie.
#![allow(clippy::unwrap_used)]

use ct_signals::ArModel;
use ctid_tests::{Drive, Rig};
use greybox::{Setup, Stopping, fit_from, random_starts};
use missing_effect::{Diagnosis, Options, Verdict, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const STOPPING: Stopping = Stopping {
    evaluations: 150,
    cost: 1e-10,
};

fn run(rig: &Rig, seed: u64) -> Diagnosis {
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
    diagnose(&rig.problem(record), &Options::default(), &|_| {}).unwrap()
}

/// Two tanks whose model is exactly right: some starts end in a local minimum, where the residual holds structure and
/// would be blamed on an effect. The tool compares many starts, finds the best minimum more than once, and blames nothing.
#[test]
fn a_local_minimum_of_a_right_model_is_not_blamed_on_an_effect() {
    let mut trapped = 0;
    for seed in 0..6 {
        let rig = Rig {
            theta: vec![10.0, 16.0, 12.5],
            levels: vec![9.8, 16.0],
            ..Rig::cascaded_tanks()
        };
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
        let records = [record.clone()];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, Default::default()).unwrap();
        let white = ArModel::white(1.0);
        let costs: Vec<f64> = random_starts(&setup, 40, seed)
            .iter()
            .filter_map(|start| {
                fit_from(&setup, std::slice::from_ref(start), &white, STOPPING).ok()
            })
            .map(|fit| fit.cost)
            .collect();
        let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
        // A likelihood ratio of 38 is what an effect would need to be named.
        trapped += costs
            .iter()
            .filter(|cost| (*cost / best).ln() * record.len() as f64 > 38.0)
            .count();
        let found = diagnose(&rig.problem(record), &Options::default(), &|_| {}).unwrap();
        assert!(found.effects.is_empty(), "seed {seed}: {:?}", found.effects);
        assert_eq!(found.verdict, Verdict::Adequate);
        assert!(found.steps[0].starts >= 10 && found.steps[0].starts_agree >= 2);
    }
    println!("{trapped} of 240 starts end in a local minimum that would be blamed");
    assert!(trapped > 0, "the trap is not there: the test shows nothing");
}

/// A lag has a derivative where it vanishes: its score there is a number that means something. On records without a
/// lag none is named and the size found is within what chance shows; a lag of three samples is found with its size.
#[test]
fn a_lag_at_zero_scores_what_it_should() {
    for (seed, rig) in [
        (1, Rig::single_tank()),
        (2, Rig::cascaded_tanks()),
        (3, Rig::linear_tank()),
    ] {
        let found = run(&rig, seed);
        for score in found
            .scores
            .iter()
            .filter(|score| score.effect.ends_with("_lag"))
        {
            assert!(
                score.visibility > 1e-3 && score.visibility <= 1.0,
                "{score:?}"
            );
            assert!(score.bic_gain < 6.0, "{score:?}");
            let size = score.size.as_ref().unwrap().value;
            assert!(size < score.smallest_visible.unwrap(), "{score:?}");
        }
    }
    let lagging = Rig {
        hidden: vec![("sensor_lag", 0, vec![6.0])],
        ..Rig::single_tank()
    };
    let found = run(&lagging, 4);
    assert!(
        found.groups[0].iter().any(|effect| effect == "sensor_lag"),
        "{:?}",
        found.groups
    );
    let size = found
        .steps
        .last()
        .unwrap()
        .parameters
        .iter()
        .find(|p| p.name.ends_with("time_constant"))
        .unwrap();
    assert!(
        (size.value - 6.0).abs() < 4.0 * size.std_error.unwrap(),
        "{size:?}"
    );
}

/// A slow disturbance without any effect: taken for white noise, most records would be blamed; with its colour, none.
#[test]
fn a_slow_disturbance_is_not_taken_for_an_effect() {
    let mut blamed_as_white = 0;
    let runs = 10;
    for seed in 0..runs {
        let rig = Rig {
            noise: 0.3,
            colour: 0.98,
            drive: Drive::Open,
            ..Rig::single_tank()
        };
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(100 + seed));
        let records = [record.clone()];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, Default::default()).unwrap();
        let white = ArModel::white(1.0);
        let base = fit_from(&setup, &random_starts(&setup, 12, 1), &white, STOPPING).unwrap();
        let gain = setup
            .structure
            .candidates()
            .into_iter()
            .filter_map(|placed| {
                let with = setup
                    .with_structure(setup.structure.with(placed).ok()?)
                    .ok()?;
                let fit = fit_from(&with, &random_starts(&with, 12, 1), &white, STOPPING).ok()?;
                Some(base.bic() - fit.bic())
            })
            .fold(f64::NEG_INFINITY, f64::max);
        blamed_as_white += usize::from(gain > 6.0);
        let found = diagnose(&rig.problem(record), &Options::default(), &|_| {}).unwrap();
        assert!(found.effects.is_empty(), "seed {seed}: {:?}", found.effects);
        assert!(!found.noise.coefficients.is_empty());
    }
    println!("taken for white noise, {blamed_as_white} of {runs} records would be blamed");
    assert!(blamed_as_white * 2 > runs as usize);
}
