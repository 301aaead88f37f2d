//! Signals of the sample.

pub(super) const PERIOD: f64 = 4.0;

pub(super) const NOISE: f64 = 0.08;

/// Simulates the two tanks for this command: lower and upper level \[V\].
pub(super) fn simulate(input: &[f64], rim: f64, deadzone: f64, gain: f64) -> [Vec<f64>; 2] {
    let (mut upper, mut lower) = (2.0_f64, 3.0_f64);
    let fine = 8;
    let levels = input
        .iter()
        .map(|u| {
            let readings = (lower, upper);
            for _ in 0..fine {
                let dt = PERIOD / f64::from(fine);
                let between = 0.085 * upper.max(0.0).sqrt();
                upper = (upper + dt * (gain * (u - deadzone).max(0.0) - between)).clamp(0.0, rim);
                lower = (lower + dt * (between - 0.075 * lower.max(0.0).sqrt())).max(0.0);
            }
            readings
        })
        .unzip();
    levels.into()
}

/// A repeatable, nearly Gaussian sequence.
pub(super) fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut state = seed;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..n)
        .map(|_| NOISE * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0))
        .collect()
}

pub(super) fn input(n: usize, shift: f64) -> Vec<f64> {
    (0..n)
        .map(|k| {
            let k = k as f64 + shift;
            let slow = 3.0 + 1.6 * (k / 130.0).sin() + 1.3 * (k / 37.0).sin() * (k / 201.0).cos();
            ((slow + 0.9 * (k / 11.0).sin().signum()) * 20.0).round() / 20.0
        })
        .map(|u: f64| u.clamp(0.2, 6.5))
        .collect()
}
