//! Baysse, Carrillo, Habbadi, (13), without noise: `y - y^ = P^/P (theta - theta^)' sigma`, exact for parameters that differ by any amount.

use ct_lti::{Hold, Polynomial, Simulator, StateSpace, TransferFunction};
use fcloe::{ClosedLoop, Controller, LoopSimulator, PlantModel};

use crate::support::drive;

/// Largest difference of both sides over the largest error of the loop, with `(theta - theta^)' sigma` linear between samples; each held
/// value of the drive spans `parts` of them.
fn difference(
    plant: &PlantModel,
    model: &PlantModel,
    controller: &Controller,
    parts: usize,
) -> f64 {
    let step = 8.0 / parts as f64;
    let drive: Vec<f64> = drive(150)
        .into_iter()
        .flat_map(|value| std::iter::repeat_n(value, parts))
        .collect();
    let outputs = |of: &PlantModel| {
        LoopSimulator::new(of, controller, Hold::Zero, step)
            .unwrap()
            .outputs(&drive)
    };
    let (y, modelled) = (outputs(plant), outputs(model));
    let mut simulator = LoopSimulator::new(model, controller, Hold::Zero, step).unwrap();
    let mut right = Vec::with_capacity(drive.len());
    for drive in drive.chunks(fcloe::BLOCK) {
        let block = simulator.sensitivities(drive);
        right.extend((0..drive.len()).map(|k| {
            let parameters = plant.theta().iter().zip(model.theta()).enumerate();
            parameters
                .map(|(j, (truth, estimate))| (truth - estimate) * block.sigma(j)[k])
                .sum::<f64>()
        }));
    }
    let characteristic = |of: &PlantModel| {
        ClosedLoop::new(of, controller)
            .unwrap()
            .characteristic()
            .clone()
    };
    let ratio = TransferFunction::new(characteristic(model), characteristic(plant)).unwrap();
    let mut filter = Simulator::new(StateSpace::controllable(&ratio).unwrap(), Hold::First);
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for ((y, modelled), right) in y.iter().zip(&modelled).zip(&right) {
        let error = y - modelled;
        worst = worst.max((error - filter.update(*right, step).unwrap()).abs());
        largest = largest.max(error.abs());
    }
    worst / largest
}

#[test]
fn is_the_filtered_product_of_parameter_error_and_sensitivities() {
    let pi = Controller::pi(0.3, 0.004).unwrap();
    let pid = Controller::pid(0.3, 0.004, 4.0, 10.0).unwrap();
    let gain = Controller::new(Polynomial::from(0.2), Polynomial::one()).unwrap();
    type Coefficients = (&'static [f64], &'static [f64]);
    let pairs: [(Coefficients, Coefficients); 3] = [
        ((&[110.0], &[6.0]), (&[200.0], &[4.0])),
        (
            (&[210.0, 9000.0], &[5.0, 40.0]),
            (&[150.0, 12000.0], &[7.0, -20.0]),
        ),
        (
            (&[230.0, 13000.0, 180_000.0], &[5.0, 40.0, 100.0]),
            (&[260.0, 10000.0, 240_000.0], &[4.0, 60.0, 300.0]),
        ),
    ];
    for ((a, b), (a_model, b_model)) in pairs {
        let plant = PlantModel::new(a, b).unwrap();
        let model = PlantModel::new(a_model, b_model).unwrap();
        for controller in [&pi, &pid, &gain, &Controller::none()] {
            let [coarse, fine] =
                [16, 32].map(|parts| difference(&plant, &model, controller, parts));
            // The remaining error is that of linear interpolation between samples: a quarter at half the step.
            assert!(fine < 1e-3, "{fine:.1e}");
            assert!(
                (3.0..5.0).contains(&(coarse / fine)),
                "{coarse:.1e} {fine:.1e}"
            );
        }
    }
}
