//! Noise models of a loop against sums over impulse responses.

use super::*;
use crate::{Controller, PlantModel};

fn closed() -> ClosedLoop {
    let plant = PlantModel::new(&[3.0, 2.0], &[2.0, 0.5]).unwrap();
    ClosedLoop::new(&plant, &Controller::pi(0.5, 0.2).unwrap()).unwrap()
}

/// Response of H to one innovation.
fn impulse(noise: &NoiseModel, closed: &ClosedLoop, step: f64, n: usize) -> Vec<f64> {
    let ar = noise.ar.coefficients();
    let mut w: Vec<f64> = Vec::new();
    for k in 0..n {
        let past = ar.iter().enumerate().filter(|(i, _)| *i < k);
        let own: f64 = past.map(|(i, a)| a * w[k - 1 - i]).sum();
        w.push(own + if k == 0 { 1.0 } else { 0.0 });
    }
    if noise.path == NoisePath::Record {
        return w;
    }
    let system = StateSpace::controllable(&closed.disturbance().unwrap()).unwrap();
    filtered(&system, &system.sampled(Hold::Zero, step).unwrap(), &w)
}

/// The filter's double sum against one over the autocovariance of the impulse response.
#[test]
fn the_coloured_sum_is_the_double_sum() {
    let (closed, step) = (closed(), 0.4);
    let coefficients: [&[f64]; 3] = [&[], &[0.8], &[1.2, -0.5]];
    for ar in coefficients {
        for path in [NoisePath::Record, NoisePath::Loop] {
            let ar = ArModel::from_coefficients(ar, 1.0).unwrap();
            let noise = NoiseModel { path, ar };
            let h = impulse(&noise, &closed, step, 2000);
            let r = |lag: usize| -> f64 { h.iter().zip(&h[lag..]).map(|(a, b)| a * b).sum() };
            let rows: Vec<[f64; 2]> = (0..40)
                .map(|k| [(0.3 * k as f64).sin(), (0.05 * (k * k) as f64).cos()])
                .collect();
            let process = noise.process(&closed, step).unwrap();
            let mut filter = process.sum(2);
            rows.iter().for_each(|row| filter.push(row));
            let found = filter.finish();
            for (ij, found) in found.iter().enumerate() {
                let (i, j) = (ij / 2, ij % 2);
                let mut expected = 0.0;
                for (k, a) in rows.iter().enumerate() {
                    for (l, b) in rows.iter().enumerate() {
                        expected += a[i] * b[j] * r(k.abs_diff(l));
                    }
                }
                assert!((found - expected).abs() < 1e-9 * r(0) * 40.0, "{noise:?}");
            }
        }
    }
}

#[test]
fn the_inverse_undoes_the_loop() {
    let system = StateSpace::controllable(&closed().disturbance().unwrap()).unwrap();
    let sampled = system.sampled(Hold::Zero, 0.4).unwrap();
    let w: Vec<f64> = (0..500)
        .map(|k| (0.7 * (k * k % 31) as f64).sin())
        .collect();
    let back = unfiltered(&system, &sampled, &filtered(&system, &sampled, &w));
    assert!(w.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-11));
}
