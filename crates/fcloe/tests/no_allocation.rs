//! Simulating and its sensitivities cost no memory, however long the record; nor does an update of the recursion.
#![allow(clippy::unwrap_used)]

use ct_lti::Hold;
use ct_rls::RecursiveEstimator;
use fcloe::{
    BLOCK, Controller, LoopSample, LoopSimulator, PlantModel, RecursiveFcloe, RecursiveSettings,
};

#[test]
fn nothing_is_allocated_per_sample() {
    let plant = PlantModel::new(&[3.0, 2.0], &[2.0, 1.0]).unwrap();
    let controller = Controller::pi(0.5, 0.2).unwrap();
    let mut simulator = LoopSimulator::new(&plant, &controller, Hold::Zero, 0.3).unwrap();
    let drive = vec![1.0; 50 * BLOCK];
    let mut sum = 0.0;
    let counted = allocation_counter::measure(|| {
        for drive in drive.chunks(BLOCK) {
            let block = simulator.sensitivities(drive);
            sum += block.y()[0] + block.sigma(3)[0];
        }
    });
    assert_eq!(counted.count_total, 0);
    assert!(sum.is_finite());
}

#[test]
fn nothing_is_allocated_per_update() {
    let plant = PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap();
    let controller = Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap();
    let settings = RecursiveSettings::new(1.0, 0.005, 1000.0, 0.02);
    let mut estimator = RecursiveFcloe::new(&plant, &controller, settings).unwrap();
    let counted = allocation_counter::measure(|| {
        for k in 0..2000 {
            let drive = if k / 30 % 2 == 0 { 1.0 } else { -1.0 };
            let y = if k % 3 == 0 { 0.5 * drive } else { -0.1 };
            estimator.update(&LoopSample { drive, y }, 1.0);
        }
    });
    assert_eq!(counted.count_total, 0);
    assert_ne!(estimator.theta(), plant.theta());
    assert!(allocation_counter::measure(|| drop(estimator.clone())).count_total > 0);
}
