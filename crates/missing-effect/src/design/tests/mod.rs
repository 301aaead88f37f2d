#![allow(clippy::unwrap_used)]

mod power;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ct_signals::{Record, excitation, noise};
use greybox::{Noise, PriorValue, Setup, Triangle, fit_from, starts_around};
use plants::{EffectInfo, Known, Placed, Plant, Scales, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;

use crate::design::{
    Bounds, Candidacy, Fitted, Limits, Metric, NoExperiment, Prospect, Search, design, fitted,
    separation::{information, linear, misfit_before, noise_free, refitted, unlooped, vector},
    simulated::{Loop, simulate_experiment},
};
use crate::{
    Error, Options, Problem, Progress,
    base::time_limit::allow,
    fit::node::FINE,
    simulated::{self, INTERVAL, NOISE},
};

/// A tank with a hidden effect, under a command that is nearly constant.
fn problem(plant: Plant, hidden: (&str, f64), samples: usize) -> Problem {
    let known = Known {
        area: [(plant == Plant::SingleTank).then_some(154.0), None, None],
        tank_height: Some(60.0),
        input_range: Some(10.0),
        ..Known::default()
    };
    let command = (4.3, 5.7);
    let mut scales = Scales::from_ranges(command, (10.0, 22.0), INTERVAL, 600.0);
    scales.input_range = 10.0;
    let effect = EffectInfo::find(hidden.0).unwrap();
    let structure = Structure::new(plant, known.clone(), scales)
        .with(Placed { effect, vessel: 0 })
        .unwrap();
    let mut theta = if plant == Plant::SingleTank {
        vec![10.0, 12.5]
    } else {
        vec![6.4, 100.0, -16.0]
    };
    theta.push(hidden.1);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let record = simulated::record(&structure, &theta, command, samples, &mut rng);
    simulated::problem(plant, known, vec![record])
}

fn between(a: &str, b: &str) -> [Candidacy; 2] {
    [a, b].map(|id| Candidacy {
        effect: EffectInfo::find(id).unwrap(),
        vessel: None,
    })
}

/// A leak and a nonlinearity of the pump on the records, with the given noise model as weighting.
fn leak_or_curve(problem: &Problem) -> Fitted<'_> {
    let two = between("const_leak", "pump_nonlinearity");
    let mut fitted = fitted(problem, two, &Options::default()).unwrap();
    fitted.metric = Metric {
        noise: Noise::white(1),
        scales: vec![NOISE],
    };
    fitted
}

/// If the time limit has passed, only computed results are reported.
#[test]
fn what_there_is_no_time_for_is_not_claimed() {
    let problem = problem(Plant::SingleTank, ("const_leak", 4.0), 300);
    let two = between("const_leak", "pump_nonlinearity");
    let limited = |limit| Options {
        time_limit: Some(limit),
        ..Options::default()
    };
    let at_once = limited(Duration::ZERO);
    let none = design(&problem, two, &Limits::default(), &at_once, &|_| {});
    assert!(
        matches!(none, Err(Error::Design(NoExperiment::OutOfTime))),
        "{none:?}"
    );
    let hour = limited(Duration::from_secs(3600));
    let fitted = fitted(&problem, two, &hour).unwrap();
    let search = Search {
        problem: &problem,
        nodes: &fitted.nodes,
        metric: &fitted.metric,
        into: Loop::Open,
        time_constant: 100.0,
        progress: &|_| {},
    };
    let bounds = Bounds::new(&problem, &Limits::default(), false, 4).unwrap();
    allow(&fitted.base, 1.0);
    let before = search.before().unwrap();
    let (all, _) = search.predictions(&bounds, 1, &before).unwrap();
    allow(&fitted.base, 0.0);
    let (mut few, _) = search.predictions(&bounds, 1, &before).unwrap();
    assert!(
        (1..=4).contains(&few.len()) && few.len() < all.len(),
        "{} of {}",
        few.len(),
        all.len()
    );
    search.refit(&mut few, &bounds, &before);
    assert!(few.iter().all(|(candidate, _)| !candidate.refitted));
    allow(&fitted.base, 1.0);
    search.refit(&mut few, &bounds, &before);
    assert!(few[0].0.refitted);
    let left_out = fitted.base.setup.time_limit.as_ref().unwrap().left_out();
    assert_eq!(
        left_out,
        ["some of the experiments", "refits of experiments"]
    );
}

/// Without a given limit of the command.
#[test]
fn a_range_that_cannot_be_computed_with_is_refused() {
    let mut problem = problem(Plant::SingleTank, ("const_leak", 8.0), 100);
    problem.known.input_range = None;
    for range in [(-1.0, 1e300), (-1e300, 1.0), (-f64::MAX, f64::MAX)] {
        let limits = Limits {
            range: Some(range),
            ..Limits::default()
        };
        let pair = between("const_leak", "pump_deadzone");
        let found = design(&problem, pair, &limits, &Options::default(), &|_| {});
        assert!(
            matches!(found, Err(Error::Design(NoExperiment::TooWide { .. }))),
            "{found:?}"
        );
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let problem = problem(Plant::SingleTank, ("const_leak", 8.0), 100);
    let refused = |between, limits: Limits| match design(
        &problem,
        between,
        &limits,
        &Options::default(),
        &|_| {},
    ) {
        Err(Error::Design(refused)) => refused,
        other => panic!("{other:?}"),
    };
    let pair = between("const_leak", "pump_deadzone");
    let none = Limits::default();
    let range = |low, high| Limits {
        range: Some((low, high)),
        ..none
    };
    assert!(matches!(
        refused(between("overflow", "overflow"), none),
        NoExperiment::SameEffect { .. }
    ));
    for (low, high) in [
        (5.0, 5.0),
        (6.0, 2.0),
        (f64::NAN, 1.0),
        (1.0, f64::INFINITY),
    ] {
        assert!(matches!(
            refused(pair, range(low, high)),
            NoExperiment::Range { .. }
        ));
    }
    for (low, high) in [(-1.0, 5.0), (2.0, 10.5)] {
        let refused = refused(pair, range(low, high));
        assert!(matches!(refused, NoExperiment::Beyond { .. }));
        // Where the limit is written only the caller knows.
        assert!(
            refused
                .to_string()
                .contains("the input_range of the model;")
        );
        let said = refused.worded("tank.toml");
        assert!(said.contains("the input_range of tank.toml;"), "{said}");
    }
    for duration in [-5.0, 0.0, 20.0, f64::NAN] {
        let limits = Limits {
            duration: Some(duration),
            ..none
        };
        assert!(matches!(
            refused(pair, limits),
            NoExperiment::Duration { .. }
        ));
    }
    let endless = Limits {
        duration: Some(1e12),
        ..none
    };
    assert!(matches!(
        refused(pair, endless),
        NoExperiment::TooLong { .. }
    ));
    for slew in [-1.0, 0.0, 1e-6, f64::NAN] {
        let limits = Limits {
            slew: Some(slew),
            ..none
        };
        assert!(matches!(refused(pair, limits), NoExperiment::Slew { .. }));
    }
}

#[test]
fn a_tank_that_would_overflow_is_left_out() {
    let mut problem = problem(Plant::SingleTank, ("const_leak", 8.0), 300);
    problem.known.tank_height = Some(25.0);
    let limits = Limits {
        range: Some((2.0, 8.0)),
        ..Limits::default()
    };
    let pair = between("const_leak", "pump_nonlinearity");
    let found = design(&problem, pair, &limits, &Options::default(), &|_| {}).unwrap();
    assert!(found.overfull > 0);
    for candidate in &found.candidates {
        assert!(candidate.reaches.iter().all(|reach| reach.high <= 25.0));
    }
    let bounds: &Bounds = &found.limits;
    let within = |u: &f64| (bounds.low..=bounds.high).contains(u);
    assert!(found.experiment.values.iter().all(within));
}

/// A design that is stopped while sequences are applied simulates no more of them, and reports that it was stopped.
#[test]
fn a_design_that_is_stopped_simulates_nothing_more() {
    let problem = problem(Plant::SingleTank, ("const_leak", 4.0), 300);
    let fitted = leak_or_curve(&problem);
    let stop = AtomicBool::new(true);
    let mut node = fitted.nodes[0].clone();
    node.setup.stop = Some(&stop);
    let values = vec![5.0; 300];
    let simulated = || simulate_experiment(&node, &Loop::Open, &values, INTERVAL, 100.0).is_some();
    assert!(!simulated());
    stop.store(false, Ordering::Relaxed);
    assert!(simulated());

    let pair = between("const_leak", "pump_nonlinearity");
    let options = Options {
        stop: Some(&stop),
        ..Options::default()
    };
    let stop_there = |now: Progress| {
        if now.phase == "trying experiments" {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let refused = design(&problem, pair, &Limits::default(), &options, &stop_there);
    assert!(
        matches!(refused, Err(Error::Fit(greybox::Error::Stopped))),
        "{refused:?}"
    );
}
