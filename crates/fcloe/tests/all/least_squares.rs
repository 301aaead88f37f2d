//! The problem as one of the crate `estimation`: its rows, and the same minimum by another optimiser.

use crate::support::drive;
use ct_lti::Hold;
use estimation::{Residuals, Stopping, fit_from, linearise, residuals, rows};
use fcloe::{
    Controller, LoopRecord, Noise, Offsets, PlantModel, Problem, Settings, continuous_loop,
    noise_at_snr,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Two records of a loop with 20 dB of noise, the levels of the second estimated.
fn problem(plant: &PlantModel) -> Problem {
    let pi = Controller::pi(0.3, 0.004).unwrap();
    let record = |n: usize, offsets| {
        let r = drive(n);
        let clean = continuous_loop(plant, &pi, 4.0, &r, Hold::Zero, Noise::None).unwrap();
        let w = noise_at_snr(&clean.y, 20.0, &mut ChaCha8Rng::seed_from_u64(n as u64)).unwrap();
        let y = clean.y.iter().zip(&w).map(|(y, w)| y + w).collect();
        LoopRecord::closed_loop(4.0, r, None, y, offsets)
    };
    let records = [
        record(700, Offsets::Deviations),
        record(500, Offsets::Estimated),
    ];
    Problem::new(&records, &pi, plant.orders()).unwrap()
}

#[test]
fn another_optimiser_ends_in_the_same_minimum() {
    let plant = PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap();
    let problem = problem(&plant);
    let start = PlantModel::new(&[190.0, 10_000.0], &[5.5, 35.0]).unwrap();
    let ours = problem.fit(&start, &Settings::default()).unwrap();
    let mut x = start.theta().to_vec();
    x.extend([0.0, 0.0]);
    let stopping = Stopping {
        evaluations: 100,
        cost: 1e-14,
    };
    let white = estimation::Noise::white(1);
    let theirs = fit_from(&problem, vec![x.into()], &white, stopping).unwrap();
    assert!((theirs.cost / ours.cost - 1.0).abs() < 1e-10);
    for (a, b) in ours.plant.theta().iter().zip(&theirs.x) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }

    let rows = rows(&problem, &theirs.x).unwrap();
    assert_eq!((rows.columns, &rows.lengths[..]), (7, &[700, 500][..]));
    let (of_rows, alone) = (rows.residuals(), residuals(&problem, &theirs.x).unwrap());
    for (a, b) in of_rows.iter().flatten().zip(alone.iter().flatten()) {
        assert!((a - b).abs() < 1e-12);
    }
    // The first record contains no information about the levels of the second.
    assert!(
        rows.values[..700 * 7]
            .chunks(7)
            .all(|row| row[4..6] == [0.0, 0.0])
    );
    let triangle = linearise(&problem, &theirs.x, &white).unwrap();
    assert!((triangle.cost() / theirs.cost - 1.0).abs() < 1e-12);
}

#[test]
fn a_loop_that_is_not_stable_has_no_rows() {
    let problem = problem(&PlantModel::first_order(5.0, 210.0).unwrap());
    let unstable = [-210.0, 5.0, 0.0, 0.0];
    assert!(problem.each_row(&unstable, |_, _| true).is_none());
    assert!(problem.each_residual(&unstable, |_, _| true).is_none());
}
