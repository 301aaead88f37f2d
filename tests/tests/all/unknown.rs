//! Model errors outside the catalogue: where they act, on which variable they depend, and that they can be kept as the user's own term.
#![allow(clippy::unwrap_used, clippy::panic)]

use ctid_tests::Rig;
use missing_effect::{Diagnosis, NotNoise, Options, Problem, Unknown, Verdict, compare, diagnose};
use plants::{Fitted, Place, Term, Variable};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A term that follows a function over a range.
fn term(
    place: Place,
    vessel: usize,
    variable: Variable,
    (low, high): (f64, f64),
    f: fn(f64) -> f64,
) -> Term {
    let knots: Vec<f64> = (0..200)
        .map(|i| low + (high - low) * f64::from(i) / 199.0)
        .collect();
    Term {
        name: "hidden".to_string(),
        place,
        vessel,
        variable,
        ordinates: knots.iter().map(|v| f(*v)).collect(),
        knots,
        fitted: Fitted::Scale,
    }
}

fn found(rig: &Rig, seed: u64) -> Diagnosis {
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
    diagnose(&rig.problem(record), &Options::default(), &|_| {}).unwrap()
}

fn kept(unknown: &Unknown, name: &str) -> Term {
    let (place, vessel) = match unknown.place.as_str() {
        "actuator" => (Place::Actuator, 0),
        "sensor" => (Place::Sensor, 0),
        "lower" => (Place::Vessel, 1),
        _ => (Place::Vessel, 0),
    };
    let variable = Variable::ALL
        .into_iter()
        .find(|v| v.name() == unknown.variable)
        .unwrap();
    Term {
        name: name.to_string(),
        place,
        vessel,
        variable,
        knots: unknown.knots.clone(),
        ordinates: unknown.ordinates.clone(),
        fitted: Fitted::Scale,
    }
}

/// A tank with a function of the level in its balance that no effect of the catalogue describes.
fn with_level(f: fn(f64) -> f64) -> Rig {
    Rig {
        terms: vec![term(Place::Vessel, 0, Variable::Level, (0.0, 40.0), f)],
        ..Rig::single_tank()
    }
}

/// A disturbance outside the catalogue may partly resemble an effect, but the diagnosis never says that it is that effect.
#[test]
fn a_wave_over_the_level_is_a_part_at_most() {
    let found = found(&with_level(|h| 2.5 * (1.1 * h).sin()), 1);
    assert!(
        matches!(found.verdict, Verdict::Unexplained | Verdict::Partial),
        "{:?}",
        found.verdict
    );
    assert!(found.residual_unexplained && found.unknown.is_some());
    let acceptance = found.acceptance.unwrap();
    assert!(
        acceptance
            .share
            .is_none_or(|share| share < acceptance.required)
    );
}

#[test]
fn a_function_of_the_level_is_named_and_can_be_kept() {
    let rig = with_level(|h| -4.0 * (-(h - 14.0_f64).powi(2)).exp());
    let found = found(&rig, 1);
    assert_eq!(found.verdict, Verdict::Unexplained);
    let unknown = found.unknown.as_ref().unwrap();
    assert_eq!(
        (unknown.place.as_str(), unknown.variable),
        ("vessel", "level")
    );
    assert_eq!(
        (unknown.unit.as_str(), unknown.variable_unit.as_str()),
        ("cm^3/s", "cm")
    );
    assert!(unknown.shares[0].share > 0.9 && unknown.shares[1].share < 0.8);
    assert!(
        (unknown.noise / rig.noise - 1.0).abs() < 0.1,
        "{}",
        unknown.noise
    );

    let records = |seed: u64| rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
    let problem = Problem {
        test: vec![records(101)],
        ..rig.problem(records(1))
    };
    let step = |problem: &Problem| {
        let compared = compare(problem, &Options::default()).unwrap();
        compared.steps[0].clone()
    };
    let before = step(&problem);
    let after = step(&Problem {
        terms: vec![kept(unknown, "mine")],
        ..problem.clone()
    });
    println!(
        "{:.3} -> {:.3} cm, held out {:.3} -> {:.3} cm",
        before.rmse,
        after.rmse,
        before.rmse_test.unwrap(),
        after.rmse_test.unwrap()
    );
    assert!(after.rmse < 1.2 * rig.noise);
    assert!(after.rmse_test.unwrap() < 0.25 * before.rmse_test.unwrap());
    // A scale of one confirms the identified shape.
    let scale = after
        .parameters
        .iter()
        .find(|p| p.name == "mine.scale")
        .unwrap();
    assert!(
        (scale.value - 1.0).abs() < 3.0 * scale.std_error.unwrap()
            && scale.std_error.unwrap() < 0.02
    );
    // The true term differs from the kept one by what the plant's own parameters imitate, and they come back right.
    for (name, truth) in [("pump_gain", 10.0), ("alpha", 12.5)] {
        let parameter = after.parameters.iter().find(|p| p.name == name).unwrap();
        assert!(
            (parameter.value / truth - 1.0).abs() < 0.02,
            "{name} = {}",
            parameter.value
        );
    }
}

#[test]
fn a_function_of_time_is_not_sold_as_one_of_the_level() {
    type Outside = fn(f64) -> (f64, f64);
    let outside: [(Option<f64>, Outside); 3] = [
        (Some(251.3), |t| (0.2 * (0.025 * t).sin(), 0.0)),
        (None, |t| {
            (
                if (600.0..1000.0).contains(&t) {
                    0.3
                } else {
                    0.0
                },
                0.0,
            )
        }),
        (None, |t| (0.3 * (0.01 * t).sin() * (0.0023 * t).cos(), 0.0)),
    ];
    for (period, outside) in outside {
        let rig = Rig {
            outside,
            ..Rig::single_tank()
        };
        let found = found(&rig, 1);
        // If an effect was accepted for the disturbance, the rest of the residual is still no function of the level.
        let Some(unknown) = &found.unknown else {
            continue;
        };
        println!("{:.2} of it is predicted", unknown.shares[0].share);
        assert_eq!(unknown.variable, "time", "{:?}", unknown.shares);
        let level = matches!(found.not_noise, Some(NotNoise::Level { .. }));
        assert!(!level, "{:?}", found.not_noise);
        assert_eq!(unknown.knots.len(), unknown.time.len());
        let Some(period) = period else { continue };
        let nearest = unknown.primitive.as_ref().unwrap();
        assert_eq!(nearest.name, "swing");
        assert!((nearest.at.unwrap() / period - 1.0).abs() < 0.05);
        // What it is in truth, in the unit of the flow, lies within the band beside the fitted model.
        let gain = found.steps[0].parameters[0].value;
        let truth = |t: f64| gain * outside(t).0;
        let worst = unknown
            .time
            .iter()
            .zip(&unknown.value)
            .map(|(t, v)| (v - truth(*t)).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1.5, "{worst}");
    }
}

#[test]
fn no_unknown_is_drawn_where_nothing_is_missing() {
    for rig in [Rig::single_tank(), Rig::linear_tank()] {
        let found = found(&rig, 5);
        assert_eq!(found.verdict, Verdict::Adequate);
        assert_eq!(found.unknown, None);
    }
    // Nor where the catalogue holds all of it.
    let rig = Rig {
        hidden: vec![("pump_saturation", 0, vec![5.5])],
        ..Rig::single_tank()
    };
    assert_eq!(found(&rig, 3).unknown, None);
}

/// `cargo test -p ctid-tests --test all unknown:: -- --ignored --nocapture`: of records on which something remains, how many
/// are called a function of what.
#[test]
#[ignore = "a study of some minutes"]
fn study() {
    let pulse: fn(f64) -> (f64, f64) = |t| {
        (
            if (600.0..1000.0).contains(&t) {
                0.3
            } else {
                0.0
            },
            0.0,
        )
    };
    let swing: fn(f64) -> (f64, f64) = |t| (0.2 * (0.025 * t).sin(), 0.0);
    let input = Term {
        variable: Variable::Input,
        ..term(Place::Actuator, 0, Variable::Input, (0.0, 10.0), |u| {
            0.15 * (4.0 * u).sin()
        })
    };
    let rigs = [
        ("a wave in the level", with_level(|h| 2.5 * (1.1 * h).sin())),
        (
            "a dip in the level",
            with_level(|h| -4.0 * (-(h - 14.0_f64).powi(2)).exp()),
        ),
        (
            "a wave in the command",
            Rig {
                terms: vec![input],
                ..Rig::single_tank()
            },
        ),
        (
            "a pulse in time",
            Rig {
                outside: pulse,
                ..Rig::single_tank()
            },
        ),
        (
            "a swing in time",
            Rig {
                outside: swing,
                ..Rig::single_tank()
            },
        ),
    ];
    for (name, rig) in rigs {
        let mut counts = std::collections::BTreeMap::<String, usize>::new();
        for seed in 1..=16 {
            let found = found(&rig, seed);
            let called = match &found.unknown {
                Some(unknown) => format!("{} ({})", unknown.variable, unknown.place),
                None => format!("{:?} without remainder", found.verdict),
            };
            *counts.entry(called).or_default() += 1;
        }
        println!("{name}: {counts:?}");
    }
}
