//! Results are written as JSON and read again, give the model that was found, and cross threads.

use ct_model::{Model, ModelSpec, Simulation};
use effect_search::{
    Believed, Diagnosis, Error, HeldOut, Options, Problem, ProblemBuilder, believed, design,
    diagnose,
};

use crate::records::{BLOCK, problem, record};

/// The outputs of a model on the inputs of the record of a problem, from the initial states that were fitted.
fn simulated(spec: ModelSpec, problem: &Problem, found: &Diagnosis) -> Vec<f64> {
    let model = Model::new(spec);
    let last = &found.steps[found.steps.len() - 1];
    let fitted = |name: &String| {
        last.parameters
            .iter()
            .find(|p| p.name == *name)
            .unwrap()
            .value
    };
    let states = model.spec().states.iter();
    let initial: Vec<f64> = states
        .map(|s| fitted(&format!("{}(0)", s.about.name)))
        .collect();
    let record = &problem.records[0];
    let mut simulation = Simulation::<f64>::new(&model, &model.parameters(), &initial, 0.0);
    let mut y = Vec::new();
    for k in 0..record.len() {
        let now: Vec<f64> = record.inputs.iter().map(|input| input.values[k]).collect();
        let mut reading = [0.0];
        simulation.read(&now, &mut reading);
        y.push(reading[0]);
        if let Some(next) = record.time.get(k + 1) {
            simulation.advance(&now, &now, *next).unwrap();
        }
    }
    y
}

#[test]
fn a_diagnosis_is_read_again_and_gives_the_model_that_was_found() {
    let lag = BLOCK
        .replace(
            "y(unit=\"degC\") = T;",
            "y(unit=\"degC\") = s;\n  Real s(start=20);",
        )
        .replace("end Block", "  25*der(s) = T - s;\nend Block");
    let problem = problem(BLOCK, record(&lag, 0.0, 0.2, 3));
    let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
    assert!(!found.effects.is_empty());

    let text = serde_json::to_string(&found).unwrap();
    let again: Diagnosis = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&again).unwrap(), text);

    // The model that was found simulates as the last step does, also that of a result that was read again.
    let own = &found.steps[found.steps.len() - 1].simulated[0];
    for found in [&found, &again] {
        let y = simulated(found.model(&problem).unwrap(), &problem, found);
        let off = y.iter().zip(own).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6);
    }

    // It has the parameters of the model that is fitted with these effects listed.
    let model = found.model(&problem).unwrap();
    let with = Problem {
        effects: found.effects.clone(),
        ..problem
    };
    let fitted = believed(&with, &Options::default()).unwrap();
    assert_eq!(names(&fitted.spec), names(&model));
}

fn names(spec: &ModelSpec) -> Vec<&String> {
    spec.parameters.iter().map(|p| &p.about.name).collect()
}

#[test]
fn what_a_builder_is_given_is_checked() {
    let record = record(BLOCK, 0.0, 0.2, 3);
    let spec = || ModelSpec::parse(BLOCK).unwrap();
    let build = |builder: ProblemBuilder| builder.build().map(|_| ()).map_err(|e| e.to_string());
    let whole = || Problem::builder(spec(), [record.clone()]);
    assert_eq!(build(whole()), Ok(()));
    assert!(build(Problem::builder(spec(), [])).is_err());
    assert!(build(whole().known("kk", 1.0)).unwrap_err().contains("kk"));
    let prior = greybox::PriorValue {
        value: 1.0,
        std_error: -1.0,
    };
    assert!(
        build(whole().prior("k", prior))
            .unwrap_err()
            .contains("prior of k")
    );
    assert!(
        build(whole().time_unit(0.0, "s"))
            .unwrap_err()
            .contains("above zero")
    );
    let mut other = record.clone();
    other.inputs.pop();
    assert!(
        build(whole().test([other]))
            .unwrap_err()
            .contains("1 inputs")
    );
}

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Problem>();
    crosses::<ProblemBuilder>();
    crosses::<Options<'static>>();
    crosses::<Diagnosis>();
    crosses::<Believed>();
    crosses::<HeldOut>();
    crosses::<design::Design>();
    crosses::<Error>();
};
