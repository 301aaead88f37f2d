//! For any input, the estimates stay finite and `P` positive definite.

use ct_rls::{
    BlockIntegrator, ContinuousRls, Directional, Error, Euler, ExactHold, Guards, Integrator,
    Outcome, RandomWalk, RecursiveEstimator, Rk4, Sample, Weights, update_blocks,
};
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

/// Above 0, as large or as small as a number can be.
fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => (-307.0..308.0).prop_map(|x: f64| 10_f64.powf(x)),
        2 => (-5.0..5.0).prop_map(|x: f64| 10_f64.powf(x)),
        1 => prop::sample::select(vec![5e-324, f64::MIN_POSITIVE, f64::MAX]),
    ]
}

fn weights() -> impl Strategy<Value = Weights> {
    let eta = prop_oneof![Just(0.0), 0.0..10.0, positive()];
    let c = prop_oneof![
        (-307.0..40.0).prop_map(|x: f64| 10_f64.powf(x)),
        0.1..10.0,
        prop::sample::select(vec![5e-324, 1e40]),
    ];
    (c, prop_oneof![Just(1.0), 0.0..1.999], eta)
        .prop_filter_map("c is so small that gamma is 2 c", |(c, ratio, eta)| {
            Weights::new(c, c * ratio, eta).ok()
        })
}

fn estimator<const P: usize, I: Integrator>(
    spread: f64,
    weights: Weights,
    silent_below: f64,
) -> ContinuousRls<P, I> {
    let p = SMatrix::from_fn(|i, j| if i == j { spread } else { 0.3 * spread });
    let guards = Guards {
        trace_limit: f64::INFINITY,
        silent_below,
    };
    ContinuousRls::with_integrator(SVector::zeros(), p, weights)
        .and_then(|rls| rls.with_guards(guards))
        .unwrap()
}

type State<const P: usize> = (SVector<f64, P>, SMatrix<f64, P, P>);

fn state<const P: usize, I: Integrator>(rls: &ContinuousRls<P, I>) -> State<P> {
    (*rls.theta(), rls.covariance())
}

/// Finite and definite, and where the sample was not used as `before`.
fn sound<const P: usize, I: Integrator>(
    rls: &ContinuousRls<P, I>,
    before: &State<P>,
    outcome: Outcome,
) -> Result<(), TestCaseError> {
    let after = state(rls);
    let mut numbers = after.0.iter().chain(&after.1);
    prop_assert!(numbers.all(|x| x.is_finite()), "{outcome:?} {after:?}");
    if !outcome.used() {
        prop_assert_eq!(&after, before);
    }
    match rls.health() {
        Ok(health) => prop_assert!(health.smallest_pivot > 0.0, "{health:?}"),
        // the two rules for comparison may report this
        Err(Error::EulerLimit { .. } | Error::LostDefiniteness { .. }) => {
            let name = std::any::type_name::<I>();
            prop_assert!(name.ends_with("Euler") || name.ends_with("Rk4"));
        }
        Err(other) => prop_assert!(false, "{other}"),
    }
    Ok(())
}

type Hostile = ([f64; 3], f64, f64, Weights);

fn survives<I: Integrator>(
    mut rls: ContinuousRls<3, I>,
    samples: &[Hostile],
) -> Result<(), TestCaseError> {
    for (phi, y, dt, weights) in samples {
        let before = state(&rls);
        let innovation = rls.update_with(&Sample::new(*phi, *y), *dt, weights);
        if phi.iter().any(|x| !(0.0..=1e30).contains(&x.abs())) || innovation.epsilon.abs() > 1e100
        {
            prop_assert!(!innovation.outcome.used(), "{innovation:?}");
        }
        sound(&rls, &before, innovation.outcome)?;
    }
    Ok(())
}

fn survives_in_blocks<I: BlockIntegrator>(
    spread: f64,
    samples: &[(Hostile, Hostile)],
) -> Result<(), TestCaseError> {
    let start = Weights::least_squares(0.0).unwrap();
    let mut one = estimator::<3, I>(spread, start, 0.0);
    let mut two = estimator::<3, I>(1.0, start, 0.0);
    for ((phi1, epsilon, dt, w1), (phi2, _, _, w2)) in samples {
        one.set_weights(*w1);
        two.set_weights(*w2);
        let before = (state(&one), state(&two));
        let (phi1, phi2) = (SVector::from(*phi1), SVector::from(*phi2));
        let innovation = update_blocks((&mut one, &phi1), (&mut two, &phi2), *epsilon, *dt);
        sound(&one, &before.0, innovation.outcome)?;
        sound(&two, &before.1, innovation.outcome)?;
    }
    Ok(())
}

fn hostile() -> impl Strategy<Value = Hostile> {
    (
        prop::array::uniform3(number()),
        number(),
        positive(),
        weights(),
    )
}

/// Rules that raise `P` before they learn decide first whether they can: what would overflow changes nothing.
#[test]
fn a_step_that_would_overflow_is_refused_whole() {
    fn check<I: Integrator>(mut rls: ContinuousRls<3, I>, dt: f64) {
        let before = state(&rls);
        let outcome = rls.update(&Sample::new([9e29, 0.0, 1.0], 1.0), dt).outcome;
        assert_eq!(outcome, Outcome::NotFinite);
        assert_eq!(state(&rls), before);
        assert!(
            rls.update(&Sample::new([1.0, 0.0, 1.0], 1.0), 1.0)
                .outcome
                .used()
        );
    }
    let weights = Weights::new(1e40, 1e40, 1.0).unwrap();
    check(estimator::<3, Directional>(1e99, weights, 0.0), 290.0);
    // 290 memories too, so long that the walk is larger than P(0)
    let weights = Weights::new(1e40, 1e40, 2.9e-28).unwrap();
    let walk = estimator::<3, RandomWalk>(1.0, weights, 0.0);
    check(walk.with_intensity([1e60; 3].into()).unwrap(), 1e30);
}

/// The range of `P(0)` that is documented.
fn spread() -> impl Strategy<Value = f64> {
    (-99.0..99.0).prop_map(|x: f64| 10_f64.powf(x))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_weights_and_samples_leave_every_rule_finite(
        samples in prop::collection::vec(hostile(), 1..20),
        spread in spread(),
        silent_below in prop_oneof![Just(-1.0), Just(0.0), positive()],
        q in prop::array::uniform3(prop_oneof![Just(0.0), (-307.0..60.0).prop_map(|x: f64| 10_f64.powf(x))]),
    ) {
        let weights = Weights::least_squares(0.0).unwrap();
        survives(estimator::<3, ExactHold>(spread, weights, silent_below), &samples)?;
        survives(estimator::<3, Directional>(spread, weights, silent_below), &samples)?;
        let walk = estimator::<3, RandomWalk>(spread, weights, silent_below);
        survives(walk.with_intensity(q.into()).unwrap(), &samples)?;
        survives(estimator::<3, Euler>(spread, weights, silent_below), &samples)?;
        survives(estimator::<3, Rk4>(spread, weights, silent_below), &samples)?;
    }

    #[test]
    fn any_weights_and_samples_leave_two_blocks_finite(
        samples in prop::collection::vec((hostile(), hostile()), 1..20),
        spread in spread(),
    ) {
        survives_in_blocks::<ExactHold>(spread, &samples)?;
        survives_in_blocks::<Euler>(spread, &samples)?;
    }

    #[test]
    fn any_row_is_taken_whole_or_not_at_all(
        rows in prop::collection::vec((prop::array::uniform3(number()), number(), positive()), 1..20),
        spread in spread(),
    ) {
        let mut rls = estimator::<3, ExactHold>(spread, Weights::least_squares(0.0).unwrap(), 0.0);
        for (f, chi, weight) in rows {
            let f = SVector::from(f);
            for pull in [weight, f64::INFINITY] {
                let before = state(&rls);
                let relaxed = rls.relax(&f, chi, pull);
                sound(&rls, &before, relaxed.map_or(Outcome::NotFinite, |_| Outcome::Updated))?;
            }
            let before = state(&rls);
            let absorbed = rls.absorb(&f, chi, weight);
            sound(&rls, &before, absorbed.map_or(Outcome::NotFinite, |_| Outcome::Updated))?;
        }
    }
}
