//! For any numbers, the recursive estimator stays finite, and a rejected sample changes nothing.

use ct_rls::RecursiveEstimator;
use fcloe::start::{PipelineSettings, lambda_ladder, pipeline};
use fcloe::{
    Controller, Error, Filter, LoopRecord, LoopSample, Offsets, Orders, PlantModel, RecursiveFcloe,
    RecursiveSettings,
};
use proptest::prelude::*;

fn size() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => (-3.0..3.0).prop_map(|x: f64| 10_f64.powf(x)),
        1 => (-307.0..308.0).prop_map(|x: f64| 10_f64.powf(x)),
    ]
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -3.0..3.0,
        2 => (size(), any::<bool>()).prop_map(|(x, negative)| if negative { -x } else { x }),
        1 => prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, f64::MAX, 5e-324]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_numbers_leave_a_recursion_finite(
        a in prop::array::uniform2(size()),
        b in prop::array::uniform2(number()),
        gains in prop_oneof![Just(None), (number(), number()).prop_map(Some)],
        (gain, forgetting, fading, step_limit) in (size(), prop_oneof![Just(0.0), size()], size(), size()),
        range in size().prop_map(|x| 1.0 + x),
        fixed in any::<bool>(),
        scale in prop_oneof![2 => Just(None), 1 => prop::array::uniform4(number()).prop_map(Some)],
        samples in prop::collection::vec((number(), number(), size()), 1..40),
    ) {
        let controller = match gains {
            None => Controller::none(),
            Some((kp, ki)) => match Controller::pi(kp, ki) {
                Ok(controller) => controller,
                Err(_) => return Ok(()),
            },
        };
        let Ok(start) = PlantModel::new(&a, &b) else { return Ok(()) };
        let mut settings = RecursiveSettings::new(gain, forgetting, fading, step_limit);
        settings.range = range;
        if fixed {
            settings = settings.with_filter(Filter::Fixed);
        }
        let scale = scale.unwrap_or([a[0], a[1], b[0], b[1]]);
        let Ok(mut estimator) = RecursiveFcloe::with_scale(&start, &scale, &controller, settings) else {
            return Ok(());
        };
        for (drive, y, dt) in samples {
            let before = (estimator.theta().to_vec(), estimator.covariance());
            let outcome = estimator.update(&LoopSample { drive, y }, dt).outcome;
            let after = (estimator.theta().to_vec(), estimator.covariance());
            let mut numbers = after.0.iter().chain(&after.1);
            prop_assert!(numbers.all(|x| x.is_finite()), "{outcome:?} {after:?}");
            prop_assert!(outcome.used() || after == before, "{outcome:?}: {before:?} {after:?}");
            prop_assert!(estimator.residual_rms().is_finite());
        }
    }
}

#[test]
fn a_record_longer_than_the_largest_number_is_refused() {
    let n = 40_usize;
    let u: Vec<f64> = (0..n).map(|k| if k % 7 < 3 { 1.0 } else { -1.0 }).collect();
    let record = LoopRecord::open_loop(f64::MAX, u.clone(), u, Offsets::Deviations);
    let (records, controller) = ([record], Controller::none());
    let orders = Orders { n: 1, m: 0 };
    let settings = PipelineSettings::default();
    for error in [
        lambda_ladder(&records, &controller, None).unwrap_err(),
        pipeline(&records, &controller, orders, &settings).unwrap_err(),
    ] {
        assert!(matches!(error, Error::Setting { .. }), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_record_has_a_start_or_an_error(
        signals in prop::collection::vec((number(), number(), number()), 0..60),
        step in size(),
        lambdas in prop::collection::vec(number(), 0..3),
        closed in any::<bool>(),
    ) {
        let r = signals.iter().map(|s| s.0).collect();
        let u: Vec<f64> = signals.iter().map(|s| s.1).collect();
        let y = signals.iter().map(|s| s.2).collect();
        let (record, controller) = if closed {
            let controller = Controller::pi(0.2, 0.02).unwrap();
            (LoopRecord::closed_loop(step, r, Some(u), y, Offsets::Deviations), controller)
        } else {
            (LoopRecord::open_loop(step, u, y, Offsets::Deviations), Controller::none())
        };
        let settings = PipelineSettings { lambdas, ..PipelineSettings::default() };
        if let Ok(found) = pipeline(&[record], &controller, Orders { n: 2, m: 1 }, &settings) {
            for candidate in found {
                prop_assert!(candidate.residual_rms.is_finite());
                prop_assert!(candidate.plant.theta().iter().all(|x| x.is_finite()));
            }
        }
    }
}
