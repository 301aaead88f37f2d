//! The degrees of freedom of a fit, and the intervals that follow from them.

use crate::support::drive;
use ct_lti::Hold;
use fcloe::{
    Controller, Fit, LoopRecord, Noise, NoisePath, Offsets, PlantModel, Problem, Settings,
    Uncertainty, continuous_loop, noise_at_snr,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A short record in open loop with white output noise, fitted; the path of the noise is given.
fn short(seed: u64, samples: usize) -> (Fit, Uncertainty) {
    let plant = PlantModel::first_order(2.0, 5.0).unwrap();
    let none = Controller::none();
    let u = drive(samples);
    let clean = continuous_loop(&plant, &none, 1.0, &u, Hold::Zero, Noise::None).unwrap();
    let w = noise_at_snr(&clean.y, 20.0, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
    let y = clean.y.iter().zip(&w).map(|(y, w)| y + w).collect();
    let record = LoopRecord::open_loop(1.0, u, y, Offsets::Deviations);
    let problem = Problem::new(&[record], &none, plant.orders()).unwrap();
    let fit = problem.fit(&plant, &Settings::default()).unwrap();
    let found = problem.uncertainty(&fit, Some(NoisePath::Record)).unwrap();
    (fit, found)
}

/// Samples less parameters less the coefficients of the noise.
#[test]
fn what_is_fitted_is_not_free() {
    let (mut white, mut coloured) = (0, 0);
    for seed in 0..40 {
        let samples = 40;
        let (_, found) = short(seed, samples);
        let order = found.noise.ar.order();
        assert_eq!(found.freedom, (samples - 2 - order) as f64);
        if order == 0 {
            white += 1;
            // then equal to that of a white residual: its square over the same degrees of freedom
            let pairs = found.std_errors.iter().zip(&found.white_std_errors);
            for (of_colour, of_white) in pairs {
                assert!((of_colour / of_white - 1.0).abs() < 1e-9, "{found:?}");
            }
        } else {
            coloured += 1;
        }
    }
    assert!(white > 5 && coloured > 0, "{white} {coloured}");
}

/// Half widths are those of Student's distribution, on both sides, however many samples there are.
#[test]
fn half_widths_are_students() {
    let (_, found) = short(1, 40);
    for (freedom, level, quantile) in [
        (10.0, 0.95, 2.228_138_852),
        (3.0, 0.95, 3.182_446_305),
        (10.0, 0.99, 3.169_272_673),
        (300.0, 0.95, 1.967_903_011),
        (1e5, 0.95, 1.959_987_708),
        (1e7, 0.95, 1.959_964_222),
        (1e12, 0.95, 1.959_963_985),
    ] {
        let found = Uncertainty {
            freedom,
            ..found.clone()
        };
        let widths = found.half_widths(level).unwrap();
        for (width, error) in widths.iter().zip(&found.std_errors) {
            assert!(
                (width / error / quantile - 1.0).abs() < 1e-8,
                "{width} {error}"
            );
        }
    }
}
