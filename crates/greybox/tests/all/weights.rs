//! Weights of several outputs: the result does not depend on where the fits began.

use std::collections::BTreeMap;

use ct_model::{Model, ModelSpec};
use ct_signals::{Channel, Record, excitation, noise};
use greybox::{FitOptions, ModelSetup};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Two heaters that exchange heat; the second one also heats the first block by `c`, which the fitted model does not have.
fn text(c: &str) -> String {
    format!(
        "model Heaters
  parameter Real P1(min=0) = 5;
  parameter Real P2(min=0) = 5;
  parameter Real U1(min=0) = 0.05;
  parameter Real U2(min=0) = 0.05;
  parameter Real K(min=0) = 0.05;
  input Real u1;
  input Real u2;
  output Real T1(start=21);
  output Real T2(start=21);
equation
  der(T1) = (0.01*P1*u1 - U1*(T1 - 21) - K*(T1 - T2){c})/9;
  der(T2) = (0.01*P2*u2 - U2*(T2 - 21) + K*(T1 - T2))/9;
end Heaters;"
    )
}

#[test]
fn the_errors_of_two_outputs_do_not_depend_on_the_starts() {
    const STEP: f64 = 8.0;
    let model = |c| Model::new(ModelSpec::parse(&text(c)).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut input = || excitation::steps(400, 10..=40, 0.0, 100.0, &mut rng).unwrap();
    let inputs = [input(), input()];
    let truth = model(" + 0.006*u2");
    let simulated = truth.simulate(&truth.parameters(), STEP, &[&inputs[0], &inputs[1]]);
    let outputs = simulated.unwrap().into_iter().zip(["T1", "T2"]);
    let outputs = outputs.map(|(series, name)| {
        let noise = noise::ar1(series.len(), 0.17, 0.92, &mut rng);
        let y = series.iter().zip(noise).map(|(y, e)| y + e).collect();
        Channel::new(name, "degC", y)
    });
    let outputs = outputs.collect();
    let channels = inputs.into_iter().zip(["u1", "u2"]);
    let channels = channels.map(|(u, name)| Channel::new(name, "%", u));
    let records = [Record::sampled(
        "heaters",
        STEP,
        channels.collect(),
        outputs,
    )];
    let believed = model("");
    let setup = ModelSetup::new(&believed, &records, &BTreeMap::new(), 1.0).unwrap();
    let errors = |seed| {
        let options = FitOptions {
            seed,
            ..FitOptions::default()
        };
        setup.fit(&options).unwrap().rmse
    };
    let first = errors(1);
    for seed in 2..6 {
        for (found, first) in errors(seed).iter().zip(&first) {
            assert!((found / first - 1.0).abs() < 1e-3, "{found}, {first}");
        }
    }
}
