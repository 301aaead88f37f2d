//! Simulations that are as accurate as the noise asks for.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{Channel, Record, excitation, noise};
use estimation::{Noise, squares};
use greybox::ModelSetup;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A motor whose friction has a sharp bend.
const TEXT: &str = "model Motor
  parameter Real gain(unit=\"rad/s2/V\", min=0) = 100;
  parameter Real b(unit=\"1/s\", min=0) = 2;
  parameter Real c(unit=\"rad/s2\", min=0) = 120;
  input Real u(unit=\"V\");
  output Real w(unit=\"rad/s\", start=0);
equation
  der(w) = gain*u - b*w - c*tanh(w/2);
end Motor;";

#[test]
fn what_is_sufficient_for_the_noise_hardly_changes_the_cost() {
    let model = Model::new(ModelSpec::parse(TEXT).unwrap());
    let parameters = [100.0, 2.0, 120.0];
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let u = excitation::steps(600, 10..=30, -6.0, 6.0, &mut rng).unwrap();
    let simulated = &model.simulate(&parameters, 0.05, &[&u]).unwrap()[0];
    let largest = simulated.iter().fold(0.0, |a: f64, w| a.max(w.abs()));
    for (share, expected) in [(1e-2, 1e-6_f64), (1e-4, 1e-8), (1e-8, ct_model::TOLERANCE)] {
        let sd = share * largest;
        let noise = noise::white(600, sd, &mut rng);
        let w = simulated.iter().zip(&noise).map(|(w, e)| w + e).collect();
        let inputs = vec![Channel::new("u", "V", u.clone())];
        let outputs = vec![Channel::new("w", "rad/s", w)];
        let records = [Record::sampled("motor", 0.05, inputs, outputs)];
        let setup = ModelSetup::new(&model, &records, &BTreeMap::new(), 1.0).unwrap();
        let sufficient = setup.sufficient_tolerance(&[sd]);
        // The largest reading has noise too; a tolerance above 1e-7 is not used.
        let wanted = expected.min(1e-7);
        assert!((sufficient / wanted).ln().abs() < 0.1, "{sufficient}");
        let mut x = parameters.to_vec();
        x.push(0.0);
        let white = Noise::white(1);
        let cost = |tolerance: f64| {
            let setup = setup.clone().with_tolerance(tolerance);
            squares(&setup, &x, &white).unwrap().cost()
        };
        let (fine, found) = (cost(ct_model::TOLERANCE), cost(sufficient));
        assert!(
            (found / fine - 1.0).abs() < 1e-4,
            "{share}: {found}, {fine}"
        );
        // With a much larger tolerance the cost would change.
        if share == 1e-4 {
            let coarse = cost(1e-3);
            assert!((coarse / fine - 1.0).abs() > 1e-3, "{coarse}, {fine}");
        }
    }
}
