//! Parameters that can be changed together without a change of the residual have no standard error; the others keep theirs.

use approx::assert_relative_eq;
use ct_signals::noise;
use estimation::{Noise, Residuals, Sample, Stopping, coloured, fit_from, robust};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// `y = (x0 + x1) sin(k/10) + x2`, or `x0 sin(k/10) + x2` with `x1` fixed at zero.
struct Curve {
    y: Vec<f64>,
    free: Vec<usize>,
    samples: [usize; 1],
}

impl Residuals for Curve {
    fn free(&self) -> &[usize] {
        &self.free
    }
    fn bounds(&self) -> &[(f64, f64)] {
        &[(-10.0, 10.0); 3]
    }
    fn samples(&self) -> &[usize] {
        &self.samples
    }
    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        for (k, y) in self.y.iter().enumerate() {
            let s = (0.1 * k as f64).sin();
            let sample = Sample {
                output: 0,
                first: k == 0,
                missing: false,
            };
            let slopes = [s, s, 1.0];
            let mut row: Vec<f64> = self.free.iter().map(|&i| slopes[i]).collect();
            row.push(y - (x[0] + x[1]) * s - x[2]);
            each(sample, &mut row).then_some(())?;
        }
        Some(())
    }
}

#[test]
fn parameters_that_only_their_sum_determines_have_no_standard_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for correlation in [0.0, 0.8] {
        let e = noise::ar1(400, 0.2, correlation, &mut rng);
        let value = |(k, e): (usize, &f64)| 3.0 * (0.1 * k as f64).sin() + 1.0 + e;
        let y: Vec<f64> = e.iter().enumerate().map(value).collect();
        let of = |free: &[usize]| {
            let curve = Curve {
                y: y.clone(),
                free: free.to_vec(),
                samples: [y.len()],
            };
            let stopping = Stopping {
                evaluations: 50,
                cost: 1e-12,
            };
            let white = Noise::white(1);
            let fit = fit_from(&curve, vec![vec![0.0; 3].into()], &white, stopping).unwrap();
            let robust = robust(&curve, &fit, 4).unwrap();
            let own = coloured(&curve, fit.clone(), 4, stopping).unwrap();
            (fit, robust, own)
        };
        let (fit, robust, own) = of(&[0, 1, 2]);
        let (alone, robust_alone, own_alone) = of(&[0, 2]);
        assert!(!fit.is_determined() && alone.is_determined());
        for (errors, expected) in [
            (fit.std_errors(), alone.std_errors()),
            (robust.std_errors, robust_alone.std_errors),
            (own.std_errors(), own_alone.std_errors()),
        ] {
            assert_eq!(errors[..2], [None, None]);
            // One more fitted entry reduces the degrees of freedom by one of 398.
            assert_relative_eq!(
                errors[2].unwrap(),
                expected[2].unwrap(),
                max_relative = 0.01
            );
        }
        let (entries, matrix) = fit.correlations().unwrap();
        assert_eq!((entries, matrix), (vec![2], vec![vec![1.0]]));
    }
}
