//! The loop's output and its sensitivities compared with an adaptive integration of the plant and the controller, which shares only the
//! coefficients with the simulation.

use crate::support::{drive, integrate};
use ct_lti::{Hold, Polynomial};
use fcloe::{Controller, LoopSimulator, PlantModel};

/// Largest error of y^ and of each sensitivity, over the largest value of each.
fn check(a: &[f64], b: &[f64], controller: &Controller, step: f64) {
    let plant = PlantModel::new(a, b).unwrap();
    let drive = drive(150);
    let mut simulator = LoopSimulator::new(&plant, controller, Hold::Zero, step).unwrap();
    let mut y = Vec::new();
    let mut sigma = vec![Vec::new(); plant.theta().len()];
    for drive in drive.chunks(fcloe::BLOCK) {
        let block = simulator.sensitivities(drive);
        y.extend_from_slice(block.y());
        for (j, sigma) in sigma.iter_mut().enumerate() {
            sigma.extend_from_slice(block.sigma(j));
        }
    }
    simulator.reset();
    assert_eq!(y, simulator.outputs(&drive));
    simulator.reset();
    let (again, u) = simulator.outputs_and_inputs(&drive);
    assert_eq!(y, again);

    let size = |v: &[f64]| v.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    let far = |a: &[f64], b: &[f64]| {
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        size(&difference) / size(b)
    };
    let (reference, command) = integrate(&plant, controller, step, &drive);
    assert!(far(&y, &reference) < 1e-9, "y: {:.1e}", far(&y, &reference));
    assert!(far(&u, &command) < 1e-8, "u: {:.1e}", far(&u, &command));
    for (j, sigma) in sigma.iter().enumerate() {
        // Central differences of fourth order: the step balances their error and the integrator's.
        let by = 4e-3 * plant.theta()[j];
        let at = |times: f64| {
            let mut theta = plant.theta().to_vec();
            theta[j] += times * by;
            let moved = PlantModel::from_theta(plant.orders(), &theta).unwrap();
            integrate(&moved, controller, step, &drive).0
        };
        let (one, minus) = (at(1.0), at(-1.0));
        let (two, minus_two) = (at(2.0), at(-2.0));
        let differences: Vec<f64> = (0..drive.len())
            .map(|k| (8.0 * (one[k] - minus[k]) - (two[k] - minus_two[k])) / (12.0 * by))
            .collect();
        let error = far(sigma, &differences);
        println!("n={} m={} sigma {j}: {error:.1e}", a.len(), b.len() - 1);
        assert!(error < 1e-7, "sigma {j}: {error:.1e}");
    }
}

#[test]
fn first_order_with_pi() {
    check(
        &[110.0],
        &[6.0],
        &Controller::pi(0.2292, 0.0021).unwrap(),
        4.0,
    );
}

#[test]
fn first_order_with_filtered_pid() {
    let pid = Controller::pid(0.2292, 0.0021, 0.8, 4.0).unwrap();
    check(&[110.0], &[6.0], &pid, 4.0);
}

#[test]
fn second_order_with_pi_and_pid() {
    let pi = Controller::pi(0.3, 0.004).unwrap();
    check(&[210.0, 9000.0], &[5.0, 40.0], &pi, 8.0);
    let pid = Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap();
    check(&[210.0, 9000.0], &[5.0, 40.0], &pid, 8.0);
    check(&[210.0, 9000.0], &[5.0], &pid, 8.0);
}

#[test]
fn third_order_with_pi_and_sensor_filter() {
    let pi = Controller::pi(0.3, 0.004).unwrap();
    let filtered = pi.clone().with_sensor_filter(0.2).unwrap();
    check(&[230.0, 13000.0, 180000.0], &[5.0, 40.0, 100.0], &pi, 8.0);
    check(&[230.0, 13000.0, 180000.0], &[5.0], &filtered, 8.0);
}

#[test]
fn a_direct_term_and_a_controller_of_gain_alone() {
    let gain = Controller::new(Polynomial::from(0.5), Polynomial::one()).unwrap();
    check(&[3.0, 2.0], &[2.0, 1.0, 0.4], &gain, 0.3);
    let pi = Controller::pi(0.5, 0.2).unwrap();
    check(&[3.0], &[2.0, 0.7], &pi, 0.3);
}

#[test]
fn open_loop() {
    check(&[3.0, 2.0], &[2.0, 1.0], &Controller::none(), 0.3);
    check(&[3.0, 2.0], &[2.0, 1.0, 0.5], &Controller::none(), 0.3);
    check(&[3.0], &[2.0], &Controller::none(), 0.3);
}

/// The code for a number of states that the compiler does not know.
#[test]
fn many_states() {
    let lag = Polynomial::new([1.0, 1.0]).unwrap().pow(9);
    let gain = Polynomial::new([0.3, 0.1]).unwrap();
    let controller = Controller::new(gain, lag).unwrap();
    check(&[3.0, 2.0], &[2.0, 1.0], &controller, 0.3);
}
