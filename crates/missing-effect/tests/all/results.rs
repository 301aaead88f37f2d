//! Results are written as JSON and read again, and cross threads.

use ct_signals::{Channel, Record, excitation, noise};
use missing_effect::{
    Diagnosis, Error, Fitted, Options, Problem, ProblemBuilder, design, diagnose,
};
use plants::{Known, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// A level that follows the command with a time constant of 60 s and, between 13 and 15 cm, a loss that no effect describes.
fn record() -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let u = excitation::steps(400, 15..=40, 3.0, 5.0, &mut rng).unwrap();
    let mut y = noise::ar1(400, 0.05, 0.5, &mut rng);
    let mut level = 16.0_f64;
    for (u, y) in u.iter().zip(&mut y) {
        *y += level;
        for _ in 0..20 {
            let loss = (1.0 - (level - 14.0).abs()).max(0.0) * 3.0;
            level += 0.1 * (4.0 * u - level - loss) / 60.0;
        }
    }
    let (u, y) = (Channel::new("u", "V", u), Channel::new("y", "cm", y));
    Record::sampled("record", 2.0, vec![u], vec![y])
}

#[test]
fn a_diagnosis_is_read_again() {
    let problem = Problem::builder(Plant::SingleTankLinear, Known::default(), [record()]);
    let problem = problem.build().unwrap();
    let found = diagnose(&problem, &Options::default(), &|_| {}).unwrap();
    let text = serde_json::to_string(&found).unwrap();
    let again: Diagnosis = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&again).unwrap(), text);
    assert_eq!(again.verdict, found.verdict);
    assert_eq!(again.groups, found.groups);

    // A name that does not exist is rejected.
    let broken = text.replacen("\"variable\":\"", "\"variable\":\"no ", 1);
    assert_eq!(
        serde_json::from_str::<Diagnosis>(&broken).is_err(),
        broken != text
    );
}

#[test]
fn a_problem_without_a_record_or_with_other_outputs_is_refused() {
    let none = Problem::builder(Plant::SingleTank, Known::default(), []);
    assert!(none.build().is_err());
    let mut two = record();
    two.outputs.push(two.outputs[0].clone());
    let two = Problem::builder(Plant::SingleTank, Known::default(), [two]);
    assert!(two.build().is_err());
}

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Diagnosis>();
    crosses::<Problem>();
    crosses::<ProblemBuilder>();
    crosses::<Options<'static>>();
    crosses::<Fitted<'static, 'static>>();
    crosses::<design::Design>();
    crosses::<Error>();
};
