//! The paper's "larger values lead to numerical difficulties", of P(0): with Euler's rule they do, with the exact step they do not.
//!
//! The whole table: `cargo run --release -p stabilized-oe --example larger_p0`.
#![allow(clippy::unwrap_used)]

mod support;

use ct_rls::{Euler, ExactHold, RecursiveEstimator};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use stabilized_oe::{Error, Integrator, IoSample, LateDifference, StabilizedOe};
use support::tables::{Setting, TABLES, gain, square_wave};

/// Table 1 with `P(0)` times `scale`.
fn run<I: Integrator>(scale: f64, seed: u64) -> Result<(), Error> {
    let setting = Setting::FINE;
    let gain = gain::<I>(&setting, &TABLES[0], scale);
    let mut estimator = StabilizedOe::new(gain, LateDifference::<5>::new()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut y = setting.y0;
    for k in 0..3200 {
        let u = square_wave(f64::from(k) * setting.dt);
        let noise: f64 = StandardNormal.sample(&mut rng);
        estimator.update(
            &IoSample {
                u,
                y: y + 0.2 * noise,
            },
            setting.dt,
        );
        y += setting.dt / 10.0 * (u - y);
        if k % 100 == 0 {
            estimator.health()?;
        }
    }
    assert!(
        estimator
            .theta()
            .iter()
            .chain(&estimator.filter())
            .all(|x| x.is_finite())
    );
    estimator.health().map(|_| ())
}

#[test]
fn euler_fails_and_the_exact_step_does_not() {
    for seed in 0..3 {
        assert_eq!(run::<Euler>(1.0, seed), Ok(()));
        assert!(matches!(
            run::<Euler>(30.0, seed),
            Err(Error::Rls(ct_rls::Error::EulerLimit { .. }))
        ));
        for scale in [1.0, 30.0, 1e3, 1e5, 1e8] {
            assert_eq!(run::<ExactHold>(scale, seed), Ok(()));
        }
    }
}
