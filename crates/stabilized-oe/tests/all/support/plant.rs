//! Plants of any order under sines.

use nalgebra::Complex;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use stabilized_oe::KnownSample;

/// A stable plant with a numerator of any order under sines, in its stationary state: `y` and its derivatives in closed form.
pub struct Plant<const N: usize, const U: usize> {
    pub a: [f64; N],
    pub b: [f64; U],
    /// Frequency, rad/s, phase, and the plant's response.
    sines: Vec<(f64, f64, Complex<f64>)>,
}

impl<const N: usize, const U: usize> Plant<N, U> {
    pub fn random(rng: &mut ChaCha8Rng, collinear: bool) -> Self {
        // product of (1 + s T)
        let mut whole = vec![1.0];
        for _ in 0..N {
            let time = rng.random_range(0.3..2.0);
            whole.resize(whole.len() + 1, 0.0);
            for i in (1..whole.len()).rev() {
                whole[i] += time * whole[i - 1];
            }
        }
        let a = core::array::from_fn(|i| whole[i + 1]);
        let b = core::array::from_fn(|i| rng.random_range(0.3..1.5) / (i + 1) as f64);
        // nearly collinear: frequencies within a thousandth, too few of them for the parameters
        let first = rng.random_range(0.4..2.0);
        let count = if collinear { 2 } else { 5 };
        let sines = (0..count).map(|i| {
            let w = if collinear {
                first * (1.0 + 1e-3 * f64::from(i))
            } else {
                rng.random_range(0.2..4.0)
            };
            let s = Complex::new(0.0, w);
            let numerator = b
                .iter()
                .rev()
                .fold(Complex::new(0.0, 0.0), |h, &b| h * s + b);
            let denominator = whole
                .iter()
                .rev()
                .fold(Complex::new(0.0, 0.0), |h, &a| h * s + a);
            (w, rng.random_range(0.0..6.0), numerator / denominator)
        });
        let sines = sines.collect();
        Self { a, b, sines }
    }

    pub fn sample(&self, t: f64) -> KnownSample<N, U> {
        // the k-th derivative of all sines, of the input or of the output
        let all = |k: i32, output: bool| -> f64 {
            let one = |&(w, phase, h): &(f64, f64, Complex<f64>)| {
                let turned = if output { h } else { Complex::new(1.0, 0.0) };
                (turned * Complex::new(0.0, w).powi(k) * Complex::from_polar(1.0, w * t + phase)).im
            };
            self.sines.iter().map(one).sum()
        };
        let u: [f64; U] = core::array::from_fn(|k| all(k as i32, false));
        let mut derivatives: [f64; N] = core::array::from_fn(|k| all(k as i32 + 1, true));
        let y = all(0, true);
        // the rounding error of the model's equation is assigned to the highest derivative
        let mut rest = -y;
        rest += self.b.iter().zip(&u).map(|(b, u)| b * u).sum::<f64>();
        rest -= self.a[..N - 1]
            .iter()
            .zip(&derivatives)
            .map(|(a, d)| a * d)
            .sum::<f64>();
        derivatives[N - 1] = rest / self.a[N - 1];
        KnownSample { u, y, derivatives }
    }
}
