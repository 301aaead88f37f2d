//! Results are written as JSON and read again, and cross threads.

use ct_signals::{Channel, Record, excitation, noise};
use missing_effect::{
    Diagnosis, Error, Fitted, NotNoise, NotSimulated, Options, Problem, ProblemBuilder, Remark,
    design, diagnose,
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

/// Numbers that JSON cannot hold are read as NaN, and do not make a result unreadable.
#[test]
fn findings_are_read_again() {
    let read = |value: &serde_json::Value| serde_json::from_value::<NotNoise>(value.clone());
    let drift = NotNoise::Slow {
        output: "y".to_string(),
        correlation_time: f64::INFINITY,
        time_constant: 140.0,
    };
    let again = read(&serde_json::to_value(&drift).unwrap()).unwrap();
    assert!(
        matches!(again, NotNoise::Slow { correlation_time, time_constant, .. } if correlation_time.is_nan() && time_constant == 140.0)
    );
    let noisy = Remark::ColouredNoise {
        ratio: f64::INFINITY,
    };
    let again: Remark = serde_json::from_value(serde_json::to_value(&noisy).unwrap()).unwrap();
    assert!(matches!(again, Remark::ColouredNoise { ratio } if ratio.is_nan()));
    let other = NotSimulated::OtherController {
        share: f64::INFINITY,
    };
    let again: NotSimulated =
        serde_json::from_value(serde_json::to_value(&other).unwrap()).unwrap();
    assert!(matches!(again, NotSimulated::OtherController { share } if share.is_nan()));
    // Finite values come back as they are.
    for remark in [
        Remark::EffectLimit { most: 1, needed: 2 },
        Remark::Quantisation {
            output: "y".to_string(),
            step: 0.1,
            share: 0.5,
        },
        Remark::ReplacedByTime {
            effects: vec!["pump_gain_drift".to_string()],
        },
    ] {
        let value = serde_json::to_value(&remark).unwrap();
        assert_eq!(serde_json::from_value::<Remark>(value).unwrap(), remark);
    }
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
