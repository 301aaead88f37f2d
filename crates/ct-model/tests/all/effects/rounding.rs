//! Readings that are rounded with noise.

use ct_model::effects::{Visited, apply, candidates};
use ct_model::{Dual, Model, ModelSpec, Scalar, Simulation};

/// With noise before the rounding the reading is the mean of the rounded readings, and depends smoothly on the step.
#[test]
fn readings_that_are_rounded_with_noise_have_the_mean_of_rounded_readings() {
    let spec = ModelSpec::parse(
        "model Ramp input Real u; output Real y = x; Real x(start=0.3); equation der(x) = u; end Ramp;",
    )
    .unwrap();
    let all = candidates(&spec, &Visited::nominal(&spec));
    let candidate = all.iter().find(|c| c.id == "quantisation(y)").unwrap();
    let model = Model::new(apply(&spec, &[candidate]).unwrap());
    let names: Vec<&str> = model
        .spec()
        .parameters
        .iter()
        .map(|p| p.about.name.as_str())
        .collect();
    let at = |name: &str| names.iter().position(|known| *known == name).unwrap();
    let (dither, step) = (at("quantisation_y_dither"), at("quantisation_y_step"));
    let run = |share: Dual<2>, width: Dual<2>| -> Vec<Dual<2>> {
        let mut parameters: Vec<_> = model.parameters().into_iter().map(Dual::constant).collect();
        parameters[dither] = share;
        parameters[step] = width;
        let mut simulation = Simulation::new(&model, &parameters, &[Dual::constant(0.3)], 0.0);
        let mut y = [Dual::constant(0.0)];
        let rows = (1..60).map(|k| {
            simulation.read(&[0.07], &mut y);
            simulation.advance(&[0.07], &[0.07], f64::from(k)).unwrap();
            y[0]
        });
        rows.collect()
    };
    for (share, tolerance) in [(0.1, 1e-3), (0.2, 3e-5), (0.4, 3e-5)] {
        let width = 0.8;
        let rows = run(Dual::variable(share, 1), Dual::variable(width, 0));
        let h = 1e-6;
        let moved =
            |by: [f64; 2]| run(Dual::constant(share + by[1]), Dual::constant(width + by[0]));
        let both = [[h, 0.0], [0.0, h]].map(|by| (moved(by), moved(by.map(|h| -h))));
        for (k, y) in rows.iter().enumerate() {
            let x = 0.3 + 0.07 * k as f64;
            // The integral over normal noise, by the midpoint rule.
            let parts = 200_000;
            let (mut sum, mut weights) = (0.0, 0.0);
            for i in 0..parts {
                let z = 7.0 * ((2 * i + 1) as f64 / f64::from(parts) - 1.0);
                let weight = (-0.5 * z * z).exp();
                sum += weight * ((x + share * width * z) / width).round() * width;
                weights += weight;
            }
            let mean = sum / weights;
            assert!(
                (y.re - mean).abs() < tolerance,
                "{share}, {x}: {} {mean}",
                y.re
            );
            for (slope, (more, less)) in y.eps.iter().zip(&both) {
                let difference = (more[k].re - less[k].re) / (2.0 * h);
                assert!((slope - difference).abs() < 1e-6, "{share}, {x}");
            }
        }
    }
}
