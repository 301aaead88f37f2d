//! The traps that make a tool of this kind lie.
#![allow(clippy::unwrap_used)]

use ct_signals::Hold;
use ctid_tests::Rig;
use greybox::{Fit, Noise, Setup, Stopping, fit_from, random_starts};
use missing_effect::{Diagnosis, Options, Remark, Verdict, diagnose};
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

/// Two tanks whose model is exactly right: some starts end in a local minimum, where the residual has a structure that resembles an effect.
/// The program compares many starts, finds the best minimum more than once, and names no effect.
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
        let white = Noise::white(1);
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

/// A lag has a derivative at a time constant of zero, so its score test there is valid. On records without a lag none is found, and the
/// estimated size is within its statistical error; a lag of three samples is found with its size.
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

/// Fall of BIC with the best single effect if the noise is assumed white: the result of a tool without a noise model. The model without the
/// effect is fitted from the given starts.
fn gain_as_white(setup: &Setup, starts: &[Vec<f64>]) -> f64 {
    let white = Noise::white(1);
    let base = fit_from(setup, starts, &white, STOPPING).unwrap();
    let gains = setup.structure.candidates().into_iter().map(|placed| {
        let with = setup
            .with_structure(setup.structure.with(placed).unwrap())
            .unwrap();
        // From where the believed model ended, the effect at the first of its starts.
        let mut start = base.x[..setup.parameter_count()].to_vec();
        let parameters = with.structure.effect_parameters(placed);
        start.extend(parameters.iter().map(|info| info.starts[0]));
        start.extend(&base.x[setup.parameter_count()..]);
        start.resize(with.names().len(), 0.0);
        fit_from(&with, &[start], &white, STOPPING).map_or(0.0, |fit| base.bic() - fit.bic())
    });
    gains.fold(f64::NEG_INFINITY, f64::max)
}

/// Records without an effect, in autocorrelated noise: if the noise is assumed white, an effect is reported in more than half of them; with
/// the noise model, in none. The loss of detectability is reported, and the smallest size of an effect that would have been detected.
fn coloured_records_are_not_blamed(colours: &[f64], noise: f64, runs: u64) {
    let mut blamed_as_white = 0;
    for (&colour, seed) in colours
        .iter()
        .flat_map(|colour| (0..runs).map(move |seed| (colour, seed)))
    {
        let rig = Rig {
            noise,
            colour,
            samples: 800,
            ..Rig::single_tank()
        };
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(100 + seed));
        let records = [record.clone()];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, Default::default()).unwrap();
        let gain = gain_as_white(&setup, &random_starts(&setup, 12, 1));
        blamed_as_white += usize::from(gain > 6.0);
        let found = diagnose(&rig.problem(record), &Options::default(), &|_| {}).unwrap();
        assert!(found.effects.is_empty(), "seed {seed}: {:?}", found.effects);
        assert!(!found.noise[0].coefficients.is_empty());
        let coloured =
            |remark: &Remark| matches!(remark, Remark::ColouredNoise { ratio } if *ratio >= 1.2);
        assert!(
            found.remarks.iter().any(coloured),
            "seed {seed}: {:?}",
            found.remarks
        );
        let sizes = found
            .scores
            .iter()
            .filter_map(|score| score.smallest_visible);
        assert!(sizes.clone().count() >= 5 && sizes.clone().all(|size| size > 0.0));
    }
    let records = colours.len() * runs as usize;
    println!("colours {colours:?}: as white noise, {blamed_as_white} of {records} would be blamed");
    assert!(2 * blamed_as_white > records);
}

#[test]
fn coloured_noise_is_not_taken_for_an_effect() {
    coloured_records_are_not_blamed(&[0.8, 0.95], 0.1, 2);
}

/// `cargo test -p ctid-tests --test all traps:: -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn coloured_noise_is_not_taken_for_an_effect_in_36_records() {
    coloured_records_are_not_blamed(&[0.8, 0.95], 0.1, 18);
}

#[test]
fn a_slow_disturbance_is_not_taken_for_an_effect() {
    coloured_records_are_not_blamed(&[0.98], 0.3, 4);
}

/// `cargo test -p ctid-tests --test all traps:: -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn a_slow_disturbance_is_not_taken_for_an_effect_in_40_records() {
    coloured_records_are_not_blamed(&[0.98], 0.3, 40);
}

/// Two tanks fit almost as well with their time constants swapped, and from the wrong end an effect would be named. The
/// tool reaches the right end even where the user's guess lies in the wrong one, and scores the effects from there.
#[test]
fn effects_are_scored_from_the_better_of_two_basins() {
    let mut trapped = 0;
    for seed in 0..3 {
        // The fast tank is above: of two tanks with one area the larger coefficient is the faster.
        let rig = Rig {
            theta: vec![10.0, 16.0, 12.5],
            levels: vec![9.8, 16.0],
            samples: 600,
            ..Rig::cascaded_tanks()
        };
        let record = rig.run(&mut ChaCha8Rng::seed_from_u64(40 + seed));
        let records = [record.clone()];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, Default::default()).unwrap();
        let white = Noise::white(1);
        let ends: Vec<Fit> = random_starts(&setup, 16, seed)
            .into_iter()
            .filter_map(|start| fit_from(&setup, &[start], &white, STOPPING).ok())
            .collect();
        let best = ends
            .iter()
            .map(|end| end.cost)
            .fold(f64::INFINITY, f64::min);
        let Some(wrong) = ends
            .iter()
            .filter(|end| end.x[1] < end.x[2] && end.cost > 1.05 * best && end.cost < 20.0 * best)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
        else {
            continue;
        };
        trapped += usize::from(gain_as_white(&setup, std::slice::from_ref(&wrong.x)) > 6.0);
        let mut problem = rig.problem(record);
        for (name, guess) in setup.names().iter().zip(&wrong.x) {
            problem.start.insert(name.clone(), *guess);
        }
        let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate, "{:?}", found.effects);
        let parameters = &found.steps[0].parameters;
        for (parameter, truth) in parameters.iter().zip(&rig.theta) {
            let error = parameter.std_error.unwrap();
            assert!(
                (parameter.value - truth).abs() < 4.0 * error,
                "{parameter:?}"
            );
        }
    }
    println!("from {trapped} of 3 ends in the wrong basin an effect would be named");
    assert!(trapped > 0, "the trap is not there: the test shows nothing");
}

/// If a held command is interpolated linearly, the residual depends on the input ten times as much as with a leak of a drop a second, and a
/// wrong effect would be found; with the hold of the record none is.
#[test]
fn a_held_input_is_not_taken_for_a_continuous_one() {
    let leaking = Rig {
        hidden: vec![("const_leak", 0, vec![0.05])],
        ..Rig::single_tank()
    };
    let left = |rig: &Rig, hold: Hold| {
        let silent = Rig {
            noise: 0.0,
            ..rig.clone()
        };
        let mut record = silent.run(&mut ChaCha8Rng::seed_from_u64(5));
        record.inputs[0].hold = hold;
        let records = [record];
        let setup =
            Setup::from_records(rig.plant, rig.known(), &[], &records, Default::default()).unwrap();
        let starts = random_starts(&setup, 12, 1);
        fit_from(&setup, &starts, &Noise::white(1), STOPPING)
            .unwrap()
            .rmse[0]
    };
    let sound = Rig::single_tank();
    let (real, spurious) = (left(&leaking, Hold::Zero), left(&sound, Hold::First));
    println!("a leak of a drop a second leaves {real:.5} cm, the wrong hold {spurious:.5} cm");
    assert!(left(&sound, Hold::Zero) < 1e-6);
    assert!(spurious > 10.0 * real, "{spurious} {real}");

    let quiet = Rig {
        noise: 0.01,
        ..sound
    };
    let mut record = quiet.run(&mut ChaCha8Rng::seed_from_u64(5));
    let right = diagnose(&quiet.problem(record.clone()), &Options::default(), &|_| {}).unwrap();
    assert_eq!(right.verdict, Verdict::Adequate, "{:?}", right.effects);
    record.inputs[0].hold = Hold::First;
    let wrong = diagnose(&quiet.problem(record), &Options::default(), &|_| {}).unwrap();
    assert_ne!(wrong.verdict, Verdict::Adequate);
}
