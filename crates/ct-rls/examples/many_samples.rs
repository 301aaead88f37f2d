//! A million samples of three parameters: the time that the estimator takes, which `python/benches/overhead.py` compares with that of the
//! Python package.

use std::time::Instant;

use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};

const SAMPLES: usize = 1_000_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut state = 1_u64;
    let mut number = || {
        state = state * 16807 % 2_147_483_647;
        state as f64 / 2_147_483_647.0 - 0.5
    };
    let phi: Vec<[f64; 3]> = (0..SAMPLES)
        .map(|_| [number(), number(), number()])
        .collect();
    let y: Vec<f64> = phi
        .iter()
        .map(|phi| phi[0] + 2.0 * phi[1] + 3.0 * phi[2])
        .collect();
    for (name, kept) in [("innovations", false), ("kept", true)] {
        let mut least = f64::INFINITY;
        let mut end = 0.0;
        for _ in 0..7 {
            let mut rls = ContinuousRls::<3>::new(
                SVector::zeros(),
                SMatrix::identity() * 1e3,
                Weights::least_squares(0.02)?,
            )?;
            let began = Instant::now();
            let mut theta = vec![0.0; if kept { 3 * SAMPLES } else { 0 }];
            let mut epsilon = vec![0.0; SAMPLES];
            for (k, (phi, y)) in phi.iter().zip(&y).enumerate() {
                epsilon[k] = rls.update(&Sample::new(*phi, *y), 0.1).epsilon;
                if kept {
                    theta[3 * k..3 * k + 3].copy_from_slice(rls.theta().as_slice());
                }
            }
            least = least.min(began.elapsed().as_secs_f64());
            std::hint::black_box((&theta, &epsilon));
            end = rls.theta()[0];
        }
        println!("{name} {least} {end:?}");
    }
    Ok(())
}
