//! Whatever numbers come in, the estimates stay finite and `P` positive definite.
#![allow(missing_docs, clippy::unwrap_used)]

use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        4 => (-300.0..300.0, any::<bool>()).prop_map(|(x, negative): (f64, bool)| 10_f64.powf(x) * if negative { -1.0 } else { 1.0 }),
        1 => any::<f64>(),
        1 => prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn stays_finite_and_definite(
        samples in prop::collection::vec((prop::array::uniform3(number()), number(), number()), 1..40),
        ratio in 0.0..1.999,
        eta in prop_oneof![Just(0.0), 0.0..10.0],
    ) {
        let weights = Weights::new(1.0, ratio, eta).unwrap();
        let mut rls = ContinuousRls::<3>::new(SVector::zeros(), SMatrix::identity(), weights).unwrap();
        for (phi, y, dt) in samples {
            rls.update(&Sample::new(phi, y), dt.abs());
            prop_assert!(rls.theta().iter().all(|x| x.is_finite()), "theta {}", rls.theta());
            let health = rls.health().unwrap();
            prop_assert!(health.smallest_pivot > 0.0 && health.trace.is_finite(), "{:?}", health);
            prop_assert!(rls.covariance().iter().all(|x| x.is_finite()), "{}", rls.covariance());
        }
    }
}
