//! What the catalogue does not hold: where it acts, on what it depends, and that it can be kept as a term of one's own.
#![allow(clippy::unwrap_used, clippy::panic)]

use ctid_tests::Rig;
use missing_effect::{Diagnosis, Options, Problem, Unknown, Verdict, compare, diagnose};
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

/// Functions that no effect of the catalogue describes, the place and the variable that should be named.
fn outside() -> Vec<(&'static str, &'static str, Rig)> {
    let single = Rig::single_tank;
    vec![
        (
            "vessel",
            "level",
            Rig {
                terms: vec![term(Place::Vessel, 0, Variable::Level, (0.0, 40.0), |h| {
                    -12.0 * (-((h - 16.0) / 2.0).powi(2)).exp()
                })],
                ..single()
            },
        ),
        (
            "vessel",
            "level",
            Rig {
                terms: vec![term(Place::Vessel, 0, Variable::Level, (0.0, 40.0), |h| {
                    6.0 * (1.1 * h).sin()
                })],
                ..single()
            },
        ),
        (
            "actuator",
            "input",
            Rig {
                terms: vec![term(Place::Actuator, 0, Variable::Input, (0.0, 10.0), |u| {
                    0.5 * (2.5 * u).sin()
                })],
                ..single()
            },
        ),
        (
            "sensor",
            "level",
            Rig {
                terms: vec![term(Place::Sensor, 0, Variable::Level, (0.0, 40.0), |h| {
                    0.6 * (1.3 * h).sin()
                })],
                ..single()
            },
        ),
        (
            "lower",
            "level",
            Rig {
                terms: vec![term(Place::Vessel, 1, Variable::Level, (0.0, 40.0), |h| {
                    -12.0 * (-((h - 16.0) / 2.0).powi(2)).exp()
                })],
                ..Rig::cascaded_tanks()
            },
        ),
        (
            "vessel",
            "time",
            Rig {
                outside: |t| (if (600.0..1000.0).contains(&t) { 0.6 } else { 0.0 }, 0.0),
                ..single()
            },
        ),
        (
            "vessel",
            "time",
            Rig {
                outside: |t| (0.5 * (0.025 * t).sin(), 0.0),
                ..single()
            },
        ),
    ]
}

#[test]
fn explore() {
    for (k, (place, variable, rig)) in outside().into_iter().enumerate() {
        for seed in 1..=2 {
            let begun = std::time::Instant::now();
            let d = found(&rig, seed);
            println!("== {k} {place} {variable}: {:?} {:?} {:.2} s", d.verdict, d.effects, begun.elapsed().as_secs_f64());
            println!("   {:?}", d.sentences);
            let Some(u) = &d.unknown else { continue };
            println!("   {:?}", u.places);
            println!("   {:?}", u.shares);
            println!("   {:?} rmse {} knots {:.1?} ord {:.2?} se {:.2?}", u.primitive, u.rmse, u.knots.iter().take(12).collect::<Vec<_>>(), u.ordinates.iter().take(12).collect::<Vec<_>>(), u.ordinate_errors.iter().take(12).collect::<Vec<_>>());
            let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
            let test = rig.run(&mut ChaCha8Rng::seed_from_u64(seed + 100));
            let mut p = Problem { test: vec![test], ..rig.problem(record) };
            let before = compare(&p, &Options::default()).unwrap();
            p.terms.push(kept(u, "mine"));
            let after = compare(&p, &Options::default()).unwrap();
            println!("   rmse {:.3} -> {:.3}; held out {:?} -> {:?} {:?}", before.steps[0].rmse, after.steps[0].rmse, before.steps[0].rmse_test, after.steps[0].rmse_test,
                after.steps[0].parameters.iter().map(|p| format!("{} {:.4} {:?}", p.name, p.value, p.std_error)).collect::<Vec<_>>());
        }
    }
    let _ = Verdict::Adequate;
}
