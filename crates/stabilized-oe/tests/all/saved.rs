//! A saved estimator goes on as if nothing had been, and what is broken is not restored.

use ct_constrained::Bounds;
use ct_lti::Hold;
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, from_value, to_value};
use stabilized_oe::{BlockDiagonal, Gain, IoSample, StabilizedOe, StateVariableFilters};

type Estimator<G> = StabilizedOe<2, 4, G, StateVariableFilters<2>>;
type Blocks = BlockDiagonal<2, 4>;

/// A model of second order with an offset.
fn estimator(hold: Hold) -> Estimator<Blocks> {
    let weights = Weights::least_squares(0.01).unwrap();
    let still = Weights::least_squares(0.0).unwrap();
    let theta = ContinuousRls::new(
        SVector::from([7.0, 12.0, 1.0, 0.0]),
        SMatrix::identity() * 100.0,
        weights,
    );
    let filter = ContinuousRls::new(SVector::from([7.0, 12.0]), SMatrix::identity(), still);
    let gain = BlockDiagonal::new(theta.unwrap(), filter.unwrap());
    StabilizedOe::new(gain, StateVariableFilters::with_input(1.0, hold).unwrap())
        .unwrap()
        .with_offset()
}

/// Samples of a noisy plant, some readings and inputs lost, steps of two lengths.
fn run<G: Gain<2, 4>>(estimator: &mut Estimator<G>, rows: std::ops::Range<usize>) -> Vec<u64> {
    let mut rng = ChaCha8Rng::seed_from_u64(rows.start as u64);
    let mut bits = Vec::new();
    for k in rows {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let u = if k / 40 % 2 == 0 { 1.0 } else { -0.5 };
        let u = if k % 97 == 5 { f64::NAN } else { u };
        let y = 1.5 + 2.0 * (k as f64 / 25.0).sin() + 0.05 * noise;
        let y = if k % 31 == 7 { f64::NAN } else { y };
        let dt = if k % 50 < 40 { 0.5 } else { 0.75 };
        bits.push(estimator.update(&IoSample { u, y }, dt).epsilon.to_bits());
        bits.extend(estimator.theta().iter().map(|x| x.to_bits()));
        bits.extend(estimator.filter().iter().map(|x| x.to_bits()));
        bits.push(estimator.model_output().to_bits());
    }
    bits
}

fn goes_on<G>(mut estimator: Estimator<G>)
where
    G: Gain<2, 4> + Clone + serde::Serialize + serde::de::DeserializeOwned,
{
    // Before the first sample, after it, and later.
    for (from, to) in [(0, 0), (0, 1), (1, 137)] {
        run(&mut estimator, from..to);
        let text = serde_json::to_string(&estimator).unwrap();
        let mut restored: Estimator<G> = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&restored).unwrap(), text);
        let expected = run(&mut estimator.clone(), 137..600);
        assert_eq!(run(&mut restored, 137..600), expected);
        let bounded = estimator.bounded();
        assert!(restored.bounded().theta >= bounded.theta);
    }
}

#[test]
fn a_restored_estimator_goes_on_to_the_bit() {
    goes_on(estimator(Hold::Zero));
    goes_on(estimator(Hold::First));
}

#[test]
fn its_bounds_are_saved_with_it() {
    let infinite = f64::INFINITY;
    let theta = Bounds::new([0.1, 0.1, -infinite, -0.2], [50.0, infinite, 3.0, 0.2]).unwrap();
    let filter = Bounds::new([1.0, 1.0], [30.0, infinite]).unwrap();
    let bounded = estimator(Hold::Zero)
        .with_theta_bounds(theta)
        .and_then(|estimator| estimator.with_filter_bounds(filter));
    let mut bounded = bounded.unwrap();
    goes_on(bounded.clone());
    run(&mut bounded, 0..137);
    assert!(bounded.bounded().theta > 0, "a bound should be met");
}

#[test]
fn one_matrix_for_both_is_saved_too() {
    let weights = Weights::least_squares(0.01).unwrap();
    let start = SVector::from([7.0, 12.0, 1.0, 0.0, 7.0, 12.0]);
    let rls = ContinuousRls::new(start, SMatrix::identity() * 10.0, weights).unwrap();
    let gain = stabilized_oe::Full::<2, 4, 6>::new(rls);
    goes_on(StabilizedOe::new(gain, StateVariableFilters::new(1.0).unwrap()).unwrap());
}

/// The saved estimator with another value at a place.
fn with(value: &Value, place: &str, other: impl Into<Value>) -> Value {
    let mut value = value.clone();
    *value.pointer_mut(place).unwrap() = other.into();
    value
}

#[test]
fn what_is_broken_is_not_restored() {
    let mut whole = estimator(Hold::Zero);
    run(&mut whole, 0..137);
    let saved = to_value(&whole).unwrap();
    let refused = |value: Value| {
        from_value::<Estimator<Blocks>>(value)
            .unwrap_err()
            .to_string()
    };
    let unstable = with(&saved, "/theta/0", -1.0);
    assert!(refused(unstable).contains("not stable"));
    assert!(refused(with(&saved, "/shortest", 0.0)).contains("not above 0"));
    assert!(refused(with(&saved, "/held/2", -0.5)).contains("not above 0"));
    let short = with(&saved, "/derivatives/u/derivatives", vec![1.0]);
    assert!(refused(short).contains("as many derivatives"));
    let other = with(&saved, "/filter_bounds/lower/0", 4.0);
    assert!(refused(with(&other, "/filter_bounds/upper/0", 3.0)).contains("bound"));
}
