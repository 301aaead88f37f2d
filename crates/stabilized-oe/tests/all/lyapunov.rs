//! Without noise `V = delta' P^-1 delta` over `(theta, c)` falls in every step for the full and the constant gain, for any plant and input;
//! for the adaptive block-diagonal gain it need not.

use crate::support::second_order;
use ct_constrained::Bounds;
use ct_lti::{Hold, Polynomial, Simulator, StateSpace, TransferFunction};
use ct_rls::{ContinuousRls, ExactHold, Guards, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{BlockDiagonal, Full, Gain, Known, KnownSample, StabilizedOe};

/// A stable plant of order `N` with `B = b_0`, and its exact derivatives under a held input.
struct Plant<const N: usize> {
    a: [f64; N],
    b: f64,
    simulator: Simulator,
}

impl<const N: usize> Plant<N> {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        // product of (1 + s T)
        let mut whole = Polynomial::one();
        for _ in 0..N {
            let time: f64 = rng.random_range(0.3..3.0);
            whole = &whole * &Polynomial::new([1.0, time]).unwrap();
        }
        let coefficients = whole.coefficients();
        let b = rng.random_range(0.5..2.0);
        let system = TransferFunction::from_coefficients(&[b], coefficients).unwrap();
        let system = StateSpace::controllable(&system).unwrap();
        Self {
            a: core::array::from_fn(|i| coefficients[i + 1]),
            b,
            simulator: Simulator::new(system, Hold::Zero),
        }
    }

    fn sample(&mut self, u: f64, dt: f64) -> KnownSample<N, 1> {
        let y = self.simulator.update(u, dt).unwrap();
        // the controllable form's states are x, x', .. with y = scale x
        let state = self.simulator.state();
        let scale = self.simulator.system().c()[0];
        let mut derivatives = [0.0; N];
        let mut rest = self.b * u - y;
        for i in 1..N {
            derivatives[i - 1] = scale * state[i];
            rest -= self.a[i - 1] * derivatives[i - 1];
        }
        derivatives[N - 1] = rest / self.a[N - 1];
        KnownSample {
            u: [u],
            y,
            derivatives,
        }
    }
}

/// The largest rise of `V`, relative to it, over a run, and `V` at the end over that at the start.
fn rise<const N: usize, const P: usize, G: Gain<N, P>>(
    gain: G,
    plant: &mut Plant<N>,
    rng: &mut ChaCha8Rng,
    dt: f64,
    distance: impl Fn(&G, &SVector<f64, P>, &SVector<f64, N>) -> f64,
) -> Result<(f64, f64), TestCaseError> {
    let mut theta = SVector::<f64, P>::zeros();
    for i in 0..N {
        theta[i] = plant.a[i];
    }
    theta[N] = plant.b;
    let c = SVector::from(plant.a);
    // no floor at all: the truth obeys it, but a shortened step would not be one of the equations
    let mut free = [f64::NEG_INFINITY; P];
    free[..N].fill(0.0);
    let bounds = Bounds::new(free, [f64::INFINITY; P]).unwrap();
    let mut estimator = StabilizedOe::new(gain, Known::<N, 1>::new(false))
        .unwrap()
        .with_theta_bounds(bounds)
        .unwrap();
    let first = distance(estimator.gain(), &theta, &c);
    let (mut worst, mut before) = (0.0_f64, first);
    for k in 0..300 {
        let u = if rng.random_range(0.0..1.0) < 0.5 {
            1.0
        } else {
            -1.0
        };
        let since = if k == 0 { 0.0 } else { dt };
        let unstable = estimator.bounded().unstable;
        let innovation = estimator.update(&plant.sample(u, since), dt);
        prop_assert!(
            innovation.outcome.used(),
            "{innovation:?} {:?}",
            estimator.health()
        );
        let after = distance(estimator.gain(), &theta, &c);
        if estimator.bounded().unstable == unstable {
            worst = worst.max(after - before);
        }
        before = after;
    }
    Ok((worst / first, before / first))
}

fn unguarded() -> Guards {
    stabilized_oe::UNGUARDED
}

fn start<const N: usize, const T: usize>(rng: &mut ChaCha8Rng, plant: &Plant<N>) -> [f64; T] {
    core::array::from_fn(|i| {
        let truth = if i < N { plant.a[i] } else { plant.b };
        let truth = if i > N { plant.a[i - N - 1] } else { truth };
        truth * rng.random_range(0.6..1.6)
    })
}

fn full_falls<const N: usize, const P: usize, const T: usize>(
    seed: u64,
    p0: f64,
    ratio: f64,
    eta: f64,
) -> Result<(), TestCaseError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut plant = Plant::<N>::random(&mut rng);
    let start = SVector::from(start::<N, T>(&mut rng, &plant));
    let weights = Weights::new(1.0, ratio, eta).unwrap();
    let rls =
        ContinuousRls::<T, ExactHold>::with_integrator(start, SMatrix::identity() * p0, weights)
            .unwrap()
            .with_guards(unguarded())
            .unwrap();
    let Ok(_) = StabilizedOe::new(Full::<N, P, T>::new(rls.clone()), Known::<N, 1>::new(false))
    else {
        // a start that is not stable
        return Ok(());
    };
    let distance = |gain: &Full<N, P, T>, theta: &SVector<f64, P>, c: &SVector<f64, N>| {
        let both = SVector::from_fn(|i, _| if i < P { theta[i] } else { c[i - P] });
        gain.rls().distance(&both)
    };
    let (worst, left) = rise(Full::new(rls), &mut plant, &mut rng, 0.1, distance)?;
    prop_assert!(worst < 1e-9, "V rose by {worst} of its start");
    prop_assert!(left < 1.0);
    Ok(())
}

fn constant_falls<const N: usize, const P: usize>(seed: u64, p0: f64) -> Result<(), TestCaseError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut plant = Plant::<N>::random(&mut rng);
    let theta = SVector::from(start::<N, P>(&mut rng, &plant));
    let c = SVector::from(core::array::from_fn(|i| {
        plant.a[i] * rng.random_range(0.6..1.6)
    }));
    let gain = BlockDiagonal::<N, P>::constant(
        (theta, SMatrix::identity() * p0),
        (c, SMatrix::identity() * (2.0 * p0)),
        0.7,
    )
    .unwrap();
    if StabilizedOe::new(gain.clone(), Known::<N, 1>::new(false)).is_err() {
        return Ok(());
    }
    let (worst, left) = rise(gain, &mut plant, &mut rng, 0.1, block_distance)?;
    prop_assert!(worst < 1e-9, "V rose by {worst} of its start");
    prop_assert!(left < 1.0);
    Ok(())
}

fn block_distance<const N: usize, const P: usize>(
    gain: &BlockDiagonal<N, P>,
    theta: &SVector<f64, P>,
    c: &SVector<f64, N>,
) -> f64 {
    gain.theta_block().distance(theta) + gain.filter_block().distance(c)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn full(seed: u64, p0 in -3.0..3.0f64, ratio in 0.0..1.95f64, eta in 0.0..0.05f64) {
        full_falls::<1, 2, 3>(seed, 10f64.powf(p0), ratio, eta)?;
        full_falls::<2, 3, 5>(seed, 10f64.powf(p0), ratio, eta)?;
        full_falls::<3, 4, 7>(seed, 10f64.powf(p0), ratio, eta)?;
    }

    #[test]
    fn constant(seed: u64, p0 in -3.0..2.0f64) {
        constant_falls::<1, 2>(seed, 10f64.powf(p0))?;
        constant_falls::<2, 3>(seed, 10f64.powf(p0))?;
        constant_falls::<3, 4>(seed, 10f64.powf(p0))?;
    }
}

#[test]
fn the_adaptive_block_diagonal_gain_lets_v_grow() {
    let gain = second_order::block_diagonal::<ExactHold>(second_order::weights(0.0));
    let mut estimator = StabilizedOe::new(gain, Known::<2, 1>::new(true)).unwrap();
    let (theta, c) = (
        SVector::from(second_order::THETA),
        SVector::from([1.0, 1.0]),
    );
    let mut lowest = f64::INFINITY;
    let mut grown = 0.0_f64;
    for k in 0..20_000 {
        let t = f64::from(k) * 0.05;
        estimator.update(&second_order::sample(t, [0.0; 3]), 0.05);
        let v = block_distance(estimator.gain(), &theta, &c);
        lowest = lowest.min(v);
        grown = grown.max(v / lowest);
    }
    assert!(grown > 10.0, "{grown}");
}
