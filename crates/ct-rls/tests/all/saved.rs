//! A restored estimator continues with identical results, and damaged data are not restored.

use crate::support::{normal, normals, rng, spd};
use ct_rls::{
    ContinuousRls, Directional, DynamicRls, DynamicSample, Euler, ExactHold, FactoredIntegrator,
    Guards, Innovation, RandomWalk, RecursiveEstimator, Sample, UdFactor, Weights,
};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use serde_json::{Value, from_value, json, to_value};

const P: usize = 4;

fn bits(innovation: Innovation) -> (u64, u64, ct_rls::Outcome) {
    (
        innovation.epsilon.to_bits(),
        innovation.s.to_bits(),
        innovation.outcome,
    )
}

/// An estimator of each kind of size, the same.
fn twins<I: FactoredIntegrator>(guards: Guards) -> (ContinuousRls<P, I>, DynamicRls<I>) {
    let p = spd::<P>(&mut rng(3)) * 100.0;
    let weights = Weights::new(1.0, 0.7, 0.05).unwrap();
    let fixed = ContinuousRls::with_integrator(SVector::zeros(), p, weights).unwrap();
    let p = DMatrix::from_column_slice(P, P, p.as_slice());
    let dynamic = DynamicRls::with_integrator(DVector::zeros(P), &p, weights).unwrap();
    (
        fixed.with_guards(guards).unwrap(),
        dynamic.with_guards(guards).unwrap(),
    )
}

/// Both continue for some samples, a NaN among them; a low cap and a silent regressor occur.
fn run<I: FactoredIntegrator>(
    fixed: &mut ContinuousRls<P, I>,
    dynamic: &mut DynamicRls<I>,
    seed: u64,
) -> Vec<(u64, u64, ct_rls::Outcome)> {
    let mut rng = rng(seed);
    let mut all = Vec::new();
    for k in 0..400 {
        let size = if (100..250).contains(&k) { 0.01 } else { 1.0 };
        let phi = normals::<P>(&mut rng) * size;
        let y = if k == 70 { f64::NAN } else { normal(&mut rng) };
        let sample = DynamicSample {
            phi: DVector::from_column_slice(phi.as_slice()),
            y,
        };
        all.push(bits(fixed.update(&Sample { phi, y }, 0.5)));
        all.push(bits(dynamic.update(&sample, 0.5)));
    }
    all
}

fn through_text<T: serde::Serialize + serde::de::DeserializeOwned>(estimator: &T) -> T {
    let text = serde_json::to_string(estimator).unwrap();
    let restored: T = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&restored).unwrap(), text);
    restored
}

fn goes_on<I: FactoredIntegrator>(
    prepare: impl Fn((ContinuousRls<P, I>, DynamicRls<I>)) -> (ContinuousRls<P, I>, DynamicRls<I>),
) {
    let low = Guards {
        trace_limit: 1e3,
        silent_below: 0.015,
    };
    let none = Guards {
        trace_limit: f64::INFINITY,
        silent_below: -1.0,
    };
    for guards in [low, none] {
        let (mut fixed, mut dynamic) = prepare(twins::<I>(guards));
        run(&mut fixed, &mut dynamic, 1);
        let (mut fixed_again, mut dynamic_again) = (through_text(&fixed), through_text(&dynamic));
        assert_eq!(
            run(&mut fixed, &mut dynamic, 2),
            run(&mut fixed_again, &mut dynamic_again, 2)
        );
        assert_eq!(fixed.theta(), fixed_again.theta());
        assert_eq!(fixed.covariance(), fixed_again.covariance());
        assert_eq!(fixed.health(), fixed_again.health());
        assert_eq!(dynamic.theta(), dynamic_again.theta());
        assert_eq!(dynamic.covariance(), dynamic_again.covariance());
        assert_eq!(dynamic.health(), dynamic_again.health());
        assert_eq!(fixed.guards(), fixed_again.guards());

        // Estimators with fixed and with dynamic size read each other's saved state.
        let dynamic: DynamicRls<I> = from_value(to_value(&fixed).unwrap()).unwrap();
        let fixed: ContinuousRls<P, I> = from_value(to_value(&dynamic).unwrap()).unwrap();
        assert_eq!(fixed.theta(), fixed_again.theta());
        assert_eq!(fixed.covariance(), fixed_again.covariance());
    }
}

#[test]
fn restored_estimators_continue_to_the_bit() {
    goes_on::<ExactHold>(|both| both);
    goes_on::<Directional>(|both| both);
    goes_on::<RandomWalk>(|both| both);
    let q = SVector::from([0.1, 0.0, 2.0, 0.0]);
    goes_on::<RandomWalk>(|(fixed, dynamic)| {
        (
            fixed.with_intensity(q).unwrap(),
            dynamic.with_intensity(q.as_slice()).unwrap(),
        )
    });
}

#[test]
fn what_is_broken_is_not_restored() {
    let guards = Guards {
        trace_limit: 1e6,
        silent_below: 0.0,
    };
    let (fixed, _) = twins::<ExactHold>(guards);
    let good = to_value(&fixed).unwrap();
    let refused = |at: &str, value: Value, needle: &str| {
        let mut broken = good.clone();
        *broken.pointer_mut(at).unwrap() = value;
        let fixed = from_value::<ContinuousRls<P>>(broken.clone()).unwrap_err();
        let dynamic = from_value::<DynamicRls>(broken).unwrap_err();
        for error in [fixed.to_string(), dynamic.to_string()] {
            assert!(error.contains(needle), "{at}: {error}");
        }
    };
    refused("/integrator", json!("Directional"), "ExactHold");
    refused("/theta/1", Value::Null, "null");
    refused("/d/2", json!(0.0), "positive definite");
    refused("/d/2", json!(-1.0), "positive definite");
    refused("/d/0", json!(1e200), "trace");
    refused("/u/3", json!(1e300), "trace");
    refused("/u", json!([1.0, 2.0]), "");
    refused("/d", json!([1.0, 2.0, 3.0]), "");
    refused("/theta", json!([1.0, 2.0, 3.0, 4.0, 5.0]), "");
    refused("/intensity", json!([0.0, 0.0, 0.0, 0.0]), "random walk");
    refused("/weights/gamma", json!(5.0), "gamma");
    refused("/guards/trace_limit", json!(-1.0), "guard");
    refused("/trace_bound", json!(1.0), "trace_bound");
    refused("/trace_bound", json!(-1.0), "trace_bound");

    let walk = ContinuousRls::<2, RandomWalk>::with_integrator(
        SVector::zeros(),
        SMatrix::identity(),
        Weights::least_squares(0.0).unwrap(),
    );
    let mut walk = to_value(walk.unwrap()).unwrap();
    walk["intensity"] = json!([0.0, -1.0]);
    for error in [
        from_value::<ContinuousRls<2, RandomWalk>>(walk.clone()).unwrap_err(),
        from_value::<DynamicRls<RandomWalk>>(walk).unwrap_err(),
    ] {
        assert!(error.to_string().contains("intensity"), "{error}");
    }
}

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<ContinuousRls<3>>();
    crosses::<ContinuousRls<3, Directional>>();
    crosses::<ContinuousRls<3, RandomWalk>>();
    crosses::<ContinuousRls<3, Euler>>();
    crosses::<DynamicRls>();
    crosses::<UdFactor<3>>();
    crosses::<(Innovation, ct_rls::Health, ct_rls::Error)>();
};
