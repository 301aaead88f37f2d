//! What a verdict may claim: adequate is a model that leaves noise, and nothing else.
#![allow(clippy::unwrap_used)]

use ctid_tests::Rig;
use missing_effect::{Diagnosis, Options, Problem, Verdict, compare, diagnose};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn problem(rig: &Rig, seed: u64) -> Problem {
    Problem {
        plant: rig.plant,
        known: rig.known(),
        effects: Vec::new(),
        terms: Vec::new(),
        start: Default::default(),
        fixed: Vec::new(),
        controller: None,
        records: vec![rig.run(&mut ChaCha8Rng::seed_from_u64(seed))],
        test: Vec::new(),
    }
}

fn diagnosed(rig: &Rig, seed: u64, options: &Options) -> Diagnosis {
    diagnose(&problem(rig, seed), options, &|_| {}).unwrap()
}

/// A comparison takes a failure for no noise, and shows the simulation that comes nearest to the data, not one that a
/// noise which wanders lets drift off.
#[test]
fn a_comparison_shows_what_a_model_lacks() {
    for (effect, size) in [
        ("pump_deadzone", 1.0),
        ("laminar_outflow", 0.8),
        ("const_leak", 6.0),
        ("sensor_offset", 1.5),
    ] {
        let rig = Rig {
            hidden: vec![(effect, 0, vec![size])],
            ..Rig::single_tank()
        };
        for seed in 1..=2 {
            let problem = problem(&rig, seed);
            let compared = compare(&problem, &Options::default()).unwrap();
            assert_eq!(compared.verdict, Verdict::Unexplained, "{effect}, {seed}");
            let best = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
            let (shown, best) = (compared.steps[0].rmse, best.steps[0].rmse);
            assert!(shown < 1.01 * best, "{effect}, {seed}: {shown}, not {best}");
        }
    }
}

/// What no effect of the catalogue describes: a swing of the sensor, a jump of it, and a flow that nobody recorded.
#[test]
fn what_is_outside_the_catalogue_is_not_called_noise() {
    type Outside = fn(f64) -> (f64, f64);
    let outside: [(&str, Outside); 7] = [
        ("period of about 20 s", |t| (0.0, 0.1 * (0.314 * t).sin())),
        ("period of about 100 s", |t| (0.0, 0.5 * (0.0628 * t).sin())),
        ("wanders", |t| (0.0, 0.5 * (0.00209 * t).sin())),
        ("sudden, from 1002", |t| {
            (0.0, if t > 1000.0 { 3.0 } else { 0.0 })
        }),
        ("sudden, from 1002", |t| {
            (0.0, if t > 1000.0 { 0.3 } else { 0.0 })
        }),
        ("sudden", |t| {
            (
                if (900.0..1100.0).contains(&t) {
                    0.5
                } else {
                    0.0
                },
                0.0,
            )
        }),
        ("wanders", |t| (0.0, t / 2000.0)),
    ];
    for (says, outside) in outside {
        let rig = Rig {
            outside,
            ..Rig::single_tank()
        };
        let problem = problem(&rig, 1);
        let compared = compare(&problem, &Options::default()).unwrap();
        let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
        for found in [compared, found] {
            assert_eq!(found.verdict, Verdict::Unexplained, "{says}");
            assert!(found.effects.is_empty(), "{says}: {:?}", found.effects);
            assert!(
                found.sentences[0].contains(says),
                "{says}: {:?}",
                found.sentences
            );
            // What cannot be predicted is little more than the instrument's noise.
            assert!(
                found.noise_floor < 2.5 * rig.noise,
                "{says}: {}",
                found.noise_floor
            );
        }
    }
}

/// A limit on the number of effects bounds what is added, and neither what is known of the noise nor what is said.
#[test]
fn a_search_that_is_stopped_says_so() {
    let rig = Rig {
        hidden: vec![
            ("pump_saturation", 0, vec![5.5]),
            ("sensor_lag", 0, vec![8.0]),
        ],
        ..Rig::single_tank()
    };
    let options = Options {
        max_effects: 1,
        ..Options::default()
    };
    let found = diagnosed(&rig, 3, &options);
    assert_eq!(found.effects, ["pump_saturation"]);
    assert!(matches!(
        found.verdict,
        Verdict::Effect | Verdict::Undecided
    ));
    let said = found.sentences.join(" ");
    assert!(
        said.contains("stopped at 1 effect: the data call for 2"),
        "{said}"
    );
    assert!((found.noise_floor - rig.noise).abs() < 0.1 * rig.noise);
    let found = diagnosed(&rig, 3, &Options::default());
    assert_eq!(found.effects.len(), 2);
    assert!(!found.sentences.join(" ").contains("stopped"));
}

/// The believed model makes of an unmeasured level what fits without the rim: the rim may be far below all of it.
#[test]
fn an_overflow_of_a_tank_that_is_not_measured_is_named() {
    let rig = Rig {
        hidden: vec![("overflow", 0, vec![22.0, 0.5])],
        ..Rig::cascaded_tanks()
    };
    for seed in 1..=2 {
        let found = diagnosed(&rig, seed, &Options::default());
        assert_eq!(found.effects, ["overflow"], "seed {seed}");
        let last = found.steps.last().unwrap();
        assert_eq!(last.place.as_deref(), Some("upper"));
        let rim = last
            .parameters
            .iter()
            .find(|p| p.name == "overflow.rim")
            .unwrap();
        let error = rim.std_error.unwrap();
        assert!(
            (rim.value - 22.0).abs() < 4.0 * error,
            "{} +- {error}",
            rim.value
        );
        assert!(last.rmse < 1.05 * rig.noise);
    }
}
