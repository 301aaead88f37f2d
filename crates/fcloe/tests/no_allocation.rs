//! Simulating and its sensitivities cost no memory, however long the record.
#![allow(clippy::unwrap_used)]

use ct_lti::Hold;
use fcloe::{BLOCK, Controller, LoopSimulator, PlantModel};

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
