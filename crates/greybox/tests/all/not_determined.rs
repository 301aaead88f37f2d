//! Which parameters records do not determine.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{Channel, Record, excitation, noise};
use greybox::{FitOptions, ModelSetup, not_determined};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Only the product of gain and size acts, and the limit is never reached.
const TEXT: &str = "model Motor
  parameter Real b(unit=\"1/s\", min=0) = 1;
  parameter Real gain(unit=\"rad/s2/V\", min=0) = 1;
  parameter Real size(unit=\"1\", min=0) = 1;
  parameter Real limit(unit=\"rad/s\", min=500, max=1000) = 600;
  input Real u(unit=\"V\");
  output Real y(unit=\"rad/s\") = w;
  Real w(unit=\"rad/s\", start=0, fixed=true);
equation
  der(w) = gain*size*u - b*w - max(0, w - limit)/60;
end Motor;";

#[test]
fn a_product_is_determined_and_its_factors_are_not() {
    let model = Model::new(ModelSpec::parse(TEXT).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let u = excitation::steps(400, 10..=30, -6.0, 6.0, &mut rng).unwrap();
    let simulated = &model.simulate(&[0.5, 3.0, 1.0, 600.0], 0.1, &[&u]).unwrap()[0];
    let noise = noise::white(400, 0.2, &mut rng);
    let y = simulated.iter().zip(noise).map(|(y, e)| y + e).collect();
    let inputs = vec![Channel::new("u", "V", u)];
    let outputs = vec![Channel::new("y", "rad/s", y)];
    let records = [Record::sampled("motor", 0.1, inputs, outputs)];
    let known = |names: &[(&str, f64)]| -> BTreeMap<String, f64> {
        let names = names.iter();
        names
            .map(|(name, value)| (name.to_string(), *value))
            .collect()
    };
    let fitted = |known: &BTreeMap<String, f64>| {
        let setup = ModelSetup::new(&model, &records, known, 1.0).unwrap();
        let fit = setup.fit(&FitOptions::default()).unwrap();
        (not_determined(&setup, &fit), fit.std_errors())
    };
    let (found, errors) = fitted(&known(&[]));
    assert_eq!(found, [vec!["limit"], vec!["gain", "size"]]);
    assert_eq!(errors[1..4], [None, None, None]);
    let (found, known_errors) = fitted(&known(&[("size", 1.0), ("limit", 600.0)]));
    assert!(found.is_empty(), "{found:?}");
    // The error of the pole does not depend on which of the factors is known.
    let (free, fixed) = (errors[0].unwrap(), known_errors[0].unwrap());
    assert!((free / fixed - 1.0).abs() < 0.02, "{free} {fixed}");
}
