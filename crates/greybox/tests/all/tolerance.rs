//! Simulations that are as accurate as the noise requires.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec, TOLERANCE};
use ct_signals::{Channel, Record, excitation, noise};
use estimation::{Noise, Stopping, fit_from, squares};
use greybox::{FitOptions, ModelSetup};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A motor whose friction has a sharp bend; the second output is the small difference of two large states.
const TEXT: &str = "model Motor
  parameter Real gain(unit=\"rad/s2/V\", min=0) = 90;
  parameter Real b(unit=\"1/s\", min=0) = 2.5;
  parameter Real c(unit=\"rad/s2\", min=0) = 100;
  input Real u(unit=\"V\");
  output Real w(unit=\"rad/s\", start=0, fixed=true);
  output Real d(unit=\"rad\") = far - near;
  Real far(unit=\"rad\", start=10000, fixed=true);
  Real near(unit=\"rad\", start=10000, fixed=true);
equation
  der(w) = gain*u - b*w - c*tanh(w/2);
  der(far) = w;
  der(near) = far - near;
end Motor;";

const TRUE: [f64; 3] = [100.0, 2.0, 120.0];

fn record(simulated: &[Vec<f64>], u: &[f64], sd: [f64; 2], rng: &mut ChaCha8Rng) -> Record {
    let outputs = simulated.iter().zip(["w", "d"]).zip(sd);
    let outputs = outputs.map(|((series, name), sd)| {
        let noise = noise::white(series.len(), sd, rng);
        let y = series.iter().zip(noise).map(|(y, e)| y + e).collect();
        Channel::new(name, "", y)
    });
    let outputs = outputs.collect();
    let inputs = vec![Channel::new("u", "V", u.to_vec())];
    Record::sampled("motor", 0.05, inputs, outputs)
}

#[test]
fn what_is_sufficient_for_the_noise_hardly_changes_the_cost() {
    let model = Model::new(ModelSpec::parse(TEXT).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let u = excitation::steps(600, 10..=30, -6.0, 6.0, &mut rng).unwrap();
    let simulated = model.simulate(&TRUE, 0.05, &[&u]).unwrap();
    let mut x = TRUE.to_vec();
    x.extend([0.0, 1e4, 1e4]);
    let mut found = Vec::new();
    for sd in [[3.0, 3.0], [3.0, 1e-6], [3e-3, 3.0], [1e-9, 1e-9]] {
        let records = [record(&simulated, &u, sd, &mut rng)];
        let setup = ModelSetup::new(&model, &records, &BTreeMap::new(), 1.0).unwrap();
        let sufficient = setup.sufficient_tolerance(&x, &sd);
        let cost = |tolerance: f64| {
            let setup = setup.clone().with_tolerance(tolerance);
            squares(&setup, &x, &Noise::white(2)).unwrap().cost()
        };
        let (fine, own) = (cost(TOLERANCE), cost(sufficient));
        assert!((own / fine - 1.0).abs() < 1e-3, "{sd:?}: {own}, {fine}");
        found.push(sufficient);
    }
    // Less noise in either output requires smaller steps, whatever the size of the states.
    assert_eq!((found[0], found[3]), (1e-6, TOLERANCE));
    assert!(found[1] < 1e-6 && found[2] < 1e-6, "{found:?}");
}

#[test]
fn the_result_of_many_starts_has_the_accuracy_of_the_setup() {
    let model = Model::new(ModelSpec::parse(TEXT).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let u = excitation::steps(400, 10..=30, -6.0, 6.0, &mut rng).unwrap();
    let simulated = model.simulate(&TRUE, 0.05, &[&u]).unwrap();
    let records = [record(&simulated, &u, [0.5, 0.02], &mut rng)];
    let setup = ModelSetup::new(&model, &records, &BTreeMap::new(), 1.0).unwrap();
    let fit = setup.fit(&FitOptions::default()).unwrap();
    assert!(
        fit.starts >= 12 && fit.agree > 1,
        "{} of {}",
        fit.agree,
        fit.starts
    );
    for (value, truth) in fit.x.iter().zip(TRUE) {
        assert!((value / truth - 1.0).abs() < 0.02, "{:?}", fit.x);
    }
    // Fitted again with the same weights, it stays.
    let scales = setup.output_noise(&fit.x).unwrap();
    let weighted = setup.clone().with_scales(scales);
    let stopping = Stopping {
        evaluations: 50,
        cost: 1e-12,
    };
    let again = fit_from(
        &weighted,
        vec![fit.x.clone().into()],
        &Noise::white(2),
        stopping,
    );
    let errors = fit.std_errors();
    for (i, (a, b)) in fit.x.iter().zip(&again.unwrap().x).enumerate() {
        if let Some(error) = errors[i] {
            assert!(
                (a - b).abs() < 0.05 * error,
                "entry {i}: {a}, {b} +- {error}"
            );
        }
    }
}
