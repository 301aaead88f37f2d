//! The error of a simulation and its tolerance.

use ct_model::Simulation;

use crate::simulated::steps;
use crate::support::model;

#[test]
fn the_error_follows_the_tolerance() {
    // A motor whose friction has a sharp bend, with many steps in each interval.
    let model = model(
        "model Motor
  parameter Real gain = 100;
  parameter Real b = 2;
  parameter Real c = 120;
  input Real u;
  output Real w(start=0);
equation
  der(w) = gain*u - b*w - c*tanh(w/2);
end Motor;",
    );
    let parameters = model.parameters();
    let run = |tolerance: Option<f64>| -> Vec<f64> {
        let mut simulation = Simulation::new(&model, &parameters, &[0.0], 0.0);
        if let Some(tolerance) = tolerance {
            simulation = simulation.with_tolerance(tolerance);
        }
        let mut y = [0.0];
        let rows = (0..60).map(|k| {
            let u = [steps(k)];
            simulation.read(&u, &mut y);
            simulation
                .advance(&u, &u, 0.5 * (f64::from(k as u32) + 1.0))
                .unwrap();
            y[0]
        });
        rows.collect()
    };
    let fine = run(Some(1e-13));
    let largest = fine
        .iter()
        .fold(0.0, |largest: f64, w| largest.max(w.abs()));
    let error = |rows: &[f64]| {
        let pairs = rows.iter().zip(&fine);
        pairs.map(|(w, fine)| (w - fine).abs()).fold(0.0, f64::max) / largest
    };
    assert_eq!(run(None), run(Some(ct_model::TOLERANCE)));
    let errors = [1e-4, 1e-7, 1e-10].map(|tolerance| error(&run(Some(tolerance))));
    for (error, most) in errors.into_iter().zip([1e-2, 1e-5, 1e-8]) {
        assert!(error < most, "{errors:?}");
    }
    assert!(
        errors[0] > 1e2 * errors[1] && errors[1] > 1e2 * errors[2],
        "{errors:?}"
    );
}
