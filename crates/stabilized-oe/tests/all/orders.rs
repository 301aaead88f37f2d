//! Any order: plants with zeros and offsets, from samples of input and output alone.

use ct_lti::{Hold, Simulator, StateSpace, TransferFunction};
use ct_rls::{ContinuousRls, RecursiveEstimator, Weights};
use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stabilized_oe::{Full, IoSample, StabilizedOe, StateVariableFilters};

const OFFSET: f64 = 3.0;

/// The largest relative error of `(a, b, d)` after 2000 s of a random telegraph signal, from a start 30 % off.
fn error<const N: usize, const P: usize, const T: usize>(
    a: [f64; N],
    b: &[f64],
    lambda: f64,
    dt: f64,
) -> f64 {
    let whole: Vec<f64> = std::iter::once(1.0).chain(a).collect();
    let plant = TransferFunction::from_coefficients(b, &whole).unwrap();
    let mut plant = Simulator::new(StateSpace::controllable(&plant).unwrap(), Hold::Zero);
    let truth: Vec<f64> = a.iter().chain(b).copied().chain([OFFSET]).collect();
    let truth = SVector::<f64, P>::from_column_slice(&truth);
    // c is started at the a of the start
    let start = SVector::<f64, T>::from_fn(|i, _| 1.3 * if i < P { truth[i] } else { a[i - P] });
    let p0 = SMatrix::from_diagonal(&start.component_mul(&start));
    let weights = Weights::least_squares(0.02).unwrap();
    let rls = ContinuousRls::with_integrator(start, p0, weights).unwrap();
    let filters = StateVariableFilters::new(lambda).unwrap();
    let mut estimator = StabilizedOe::new(Full::<N, P, T>::new(rls), filters)
        .unwrap()
        .with_offset()
        .with_model_state(core::array::from_fn(|i| if i == 0 { OFFSET } else { 0.0 }))
        .unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut u, mut since) = (0.0, 0.0);
    for k in 0..(2000.0 / dt) as usize {
        // a telegraph signal after a moment of rest
        if k as f64 * dt > 1.0 && rng.random_range(0.0..1.0) < dt / 2.0 {
            u = if u > 0.0 { -1.0 } else { 1.0 };
        }
        let y = OFFSET + plant.update(u, since).unwrap();
        since = dt;
        assert!(estimator.update(&IoSample { u, y }, dt).outcome.used());
    }
    (estimator.theta() - truth).component_div(&truth).amax()
}

#[test]
fn without_noise_the_parameters_are_found() {
    let found = [
        error::<1, 3, 4>([2.0], &[1.5], 1.0, 0.05),
        error::<2, 4, 6>([2.0, 1.0], &[1.5], 2.0, 0.05),
        error::<2, 5, 7>([2.0, 1.0], &[1.5, 0.7], 2.0, 0.05),
        error::<3, 6, 9>([2.0, 2.0, 1.0], &[1.5, 0.7], 2.0, 0.05),
    ];
    println!("{found:?}");
    assert!(found.iter().all(|e| *e < 2e-3), "{found:?}");
}

/// With m = n the highest derivative of the filtered input has steps with the input, and linear interpolation between samples is of first
/// order.
#[test]
fn a_direct_path_is_of_first_order_in_the_step() {
    let [coarse, fine] = [0.05, 0.0125].map(|dt| error::<1, 4, 5>([2.0], &[1.5, 1.0], 1.0, dt));
    println!("{coarse:.1e} {fine:.1e}");
    assert!(coarse < 0.05 && fine < coarse / 2.0, "{coarse} {fine}");
}
