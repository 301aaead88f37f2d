//! Experiments that distinguish two effects.

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Record, noise};
use effect_search::design::{Design, Kind, Limits, NoExperiment, Prospect, design};
use effect_search::{Error, Options, Problem};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::records::{BLOCK, problem, record};

/// The block whose heater lags.
fn lagging() -> String {
    let with_lag = BLOCK.replace("C*der(T) = g*u", "6*der(q) = u - q;\n  C*der(T) = g*q");
    with_lag.replace("  Real T(unit", "  Real q(start=0);\n  Real T(unit")
}

const NOISE: f64 = 0.4;

fn proposed(problem: &Problem, between: [&str; 2], limits: &Limits) -> Result<Design, Error> {
    design(problem, between, limits, &Options::default(), &|_| {})
}

/// Response of the block with a lagging heater to an experiment.
fn answer(design: &Design, of: &Record, seed: u64) -> Record {
    let model = Model::new(ModelSpec::parse(&lagging()).unwrap());
    let parameters = model.parameters();
    let mut simulation =
        Simulation::<f64>::new(&model, &parameters, &model.starts(&parameters), 0.0);
    let sequences = &design.experiment;
    let mut read = [0.0];
    let mut y = Vec::new();
    for (k, time) in sequences.time.iter().enumerate() {
        let now: Vec<f64> = sequences.inputs.iter().map(|u| u.values[k]).collect();
        simulation.read(&now, &mut read);
        y.push(read[0]);
        let step = sequences.time[1] - sequences.time[0];
        simulation.advance(&now, &now, time + step).unwrap();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let e = noise::white(y.len(), NOISE, &mut rng);
    y.iter_mut().zip(e).for_each(|(y, e)| *y += e);
    let inputs = of.inputs.iter().zip(&sequences.inputs);
    Record {
        name: "experiment".to_string(),
        time: sequences.time.clone(),
        inputs: inputs
            .map(|(of, own)| of.with_values(own.values.clone()))
            .collect(),
        outputs: vec![of.outputs[0].with_values(y)],
        ..Record::default()
    }
}

#[test]
fn the_experiment_decides_for_the_truth() {
    let limits = Limits {
        inputs: vec!["u".to_string()],
        duration: Some(1500.0),
        ..Limits::default()
    };
    let mut decided = 0;
    for seed in 0..4 {
        let own = record(&lagging(), 0.0, NOISE, seed);
        let mut problem = problem(BLOCK, own.clone());
        let design = proposed(&problem, ["lag(u)", "delay(u)"], &limits).unwrap();
        let best = &design.experiments[0];
        assert!(best.refitted && best.power.power > 6.0, "{best:?}");
        assert_eq!(design.prospect, Prospect::Decides);
        // The room temperature is held; the heater stays within its previous range.
        assert!(
            design.experiment.inputs[1]
                .values
                .iter()
                .all(|v| *v == design.experiment.inputs[1].values[0])
        );
        let range = |values: &[f64]| {
            values
                .iter()
                .fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)))
        };
        let (low, high) = range(&own.inputs[0].values);
        let applied = range(&design.experiment.inputs[0].values);
        assert!(applied.0 >= low && applied.1 <= high);
        // The repetition of the previous experiment has less power than the best one.
        let again = design.again.as_ref().unwrap();
        assert_eq!(again.inputs[0].kind, Kind::Again);
        assert!(again.power.power < best.power.power);
        problem.records.push(answer(&design, &own, 100 + seed));
        let after = proposed(&problem, ["lag(u)", "delay(u)"], &limits).unwrap();
        decided += usize::from(after.bic_ahead > 6.0);
    }
    assert!(decided >= 3, "{decided} of 4");
}

#[test]
fn what_is_the_same_in_every_experiment_is_called_twins() {
    let problem = problem(BLOCK, record(BLOCK, 0.0, NOISE, 1));
    let design = proposed(&problem, ["offset(y)", "constant(T)"], &Limits::default()).unwrap();
    assert!(design.twins(), "{:?}", design.experiments[0]);
}

#[test]
fn limits_that_allow_no_experiment_are_refused() {
    let mut own = record(BLOCK, 0.0, NOISE, 1);
    own.inputs[1].values.fill(18.0);
    let problem = problem(BLOCK, own);
    let refused = |between: [&str; 2], limits: &Limits| match proposed(&problem, between, limits) {
        Err(Error::Design(refused)) => refused,
        other => panic!("{other:?}"),
    };
    let between = ["lag(u)", "delay(u)"];
    let of = |input: &str| Limits {
        inputs: vec![input.to_string()],
        ..Limits::default()
    };
    let same = refused(["lag(u)", "lag(u)"], &Limits::default());
    assert!(matches!(same, NoExperiment::SameEffect { .. }));
    assert!(matches!(
        refused(between, &of("x")),
        NoExperiment::UnknownInput { .. }
    ));
    assert!(matches!(
        refused(between, &of("Ta")),
        NoExperiment::NoRange { .. }
    ));
    let mut limits = of("u");
    limits.ranges.insert("u".to_string(), (3.0, 3.0));
    assert!(matches!(
        refused(between, &limits),
        NoExperiment::Range { .. }
    ));
    let mut limits = of("u");
    limits.slews.insert("u".to_string(), 1e-6);
    assert!(matches!(
        refused(between, &limits),
        NoExperiment::Slew { .. }
    ));
    let short = Limits {
        duration: Some(20.0),
        ..Limits::default()
    };
    assert!(matches!(
        refused(between, &short),
        NoExperiment::Duration { .. }
    ));
    let unknown = proposed(&problem, ["lag(u)", "lag(z)"], &Limits::default());
    assert!(matches!(unknown, Err(Error::UnknownEffect { .. })));
}
