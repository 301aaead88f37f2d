//! Plants of models in text, and monitors of them.

use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{excitation, noise};
use monitor::{Monitor, OwnModel, Row, RowResult, Settings, Units};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

pub(crate) const BLOCK: &str = r#"
model HeatedBlock
  parameter Real C(unit="J/K", min=0) = 40;
  parameter Real k(unit="W/K", min=0) = 0.2;
  parameter Real g(unit="W", min=0) = 0.5;
  parameter Real e(unit="W/K4", min=0) = 1e-9;
  input Real u(unit="%");
  input Real Ta(unit="degC");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20);
  Real loss(unit="W") = k*(T - Ta) + e*((T + 273.15)^4 - (Ta + 273.15)^4);
equation
  C*der(T) = g*u - loss;
end HeatedBlock;
"#;

pub(super) const HEATERS: &str = r#"
model TwoHeaters
  constant Real C(unit="J/K") = 20;
  parameter Real k1(unit="W/K", min=0) = 0.3;
  parameter Real k2(unit="W/K", min=0) = 0.3;
  parameter Real h(unit="W/K", min=0) = 0.5;
  parameter Real g1(unit="W", min=0) = 0.5;
  parameter Real g2(unit="W", min=0) = 0.5;
  input Real u1(unit="%");
  input Real u2(unit="%");
  output Real y1(unit="degC") = T1;
  output Real y2(unit="degC") = T2;
  Real T1(unit="degC", start=20);
  Real T2(unit="degC", start=20);
  Real q(unit="W") = h*(T1 - T2);
equation
  C*der(T1) = g1*u1 - k1*(T1 - 20) - q;
  C*der(T2) = g2*u2 - k2*(T2 - 20) + q;
end TwoHeaters;
"#;

pub(crate) fn model(text: &str) -> Model {
    Model::new(ModelSpec::parse(text).unwrap())
}

/// A plant: its model, the parameters that it has from a row on, and the noise of each output.
pub(crate) struct Plant {
    pub(crate) model: Model,
    pub(crate) parameters: Vec<(usize, Vec<f64>)>,
    pub(super) inputs: Vec<Vec<f64>>,
    pub(super) noise: Vec<Vec<f64>>,
    pub(crate) interval: f64,
}

impl Plant {
    /// C = 52, k = 0.15, g = 0.6, e = 2e-9 (W/K4): a time constant of some 120 s.
    pub(crate) fn block(rows: usize, seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let room = excitation::steps(rows, 200..=900, 15.0, 25.0, rng).unwrap();
        Self {
            model: model(BLOCK),
            parameters: vec![(0, vec![52.0, 0.15, 0.6, 2e-9])],
            inputs: vec![
                excitation::steps(rows, 20..=90, 10.0, 60.0, rng).unwrap(),
                room,
            ],
            noise: vec![noise::ar1(rows, 0.2, 0.4, rng)],
            interval: 5.0,
        }
    }

    pub(super) fn heaters(rows: usize, seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut steps = || excitation::steps(rows, 20..=90, 0.0, 60.0, rng).unwrap();
        let inputs = vec![steps(), steps()];
        Self {
            model: model(HEATERS),
            parameters: vec![(0, HEATERS_TRUE.to_vec())],
            inputs,
            noise: vec![
                noise::white(rows, 0.1, rng),
                noise::ar1(rows, 0.8, 0.5, rng),
            ],
            interval: 2.0,
        }
    }

    pub(crate) fn run(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        let mut states = self.model.starts(&self.parameters[0].1);
        let changes = self.parameters.iter().map(|(row, _)| *row).skip(1);
        let ends: Vec<usize> = changes.chain([self.inputs[0].len()]).collect();
        for ((from, parameters), end) in self.parameters.iter().zip(ends) {
            let mut simulation = Simulation::new(&self.model, parameters, &states, 0.0);
            let mut outputs = vec![0.0; self.noise.len()];
            for k in *from..end {
                let inputs: Vec<f64> = self.inputs.iter().map(|input| input[k]).collect();
                simulation.read(&inputs, &mut outputs);
                let noisy = outputs.iter().zip(&self.noise);
                let readings: Vec<f64> = noisy.map(|(y, noise)| y + noise[k]).collect();
                let time = self.interval * k as f64;
                rows.push(Row::with_inputs(time, &inputs, &readings));
                let until = self.interval * (k + 1 - from) as f64;
                simulation.advance(&inputs, &inputs, until).unwrap();
            }
            states = simulation.state().to_vec();
        }
        rows
    }
}

pub(super) const HEATERS_TRUE: [f64; 6] = [20.0, 0.25, 0.4, 0.3, 0.6, 0.55];

/// Known constants of the block: without its capacity the other parameters have no scale.
pub(crate) fn own(model: &Model) -> OwnModel {
    let mut own = OwnModel::new(model.clone());
    if model.spec().name == "HeatedBlock" {
        own.known.insert("C".to_string(), 52.0);
    }
    own
}

pub(super) fn monitor(model: &Model) -> Monitor {
    Monitor::new(own(model), Settings::default(), Units::default()).unwrap()
}

pub(crate) fn all(monitor: &mut Monitor, rows: &[Row]) -> Vec<RowResult> {
    rows.iter()
        .map(|row| monitor.update(row).unwrap())
        .collect()
}

pub(crate) fn alarms(steps: &[RowResult]) -> Vec<&monitor::Alarm> {
    steps.iter().filter_map(|s| s.alarm.as_ref()).collect()
}

/// Number of estimates whose 95 % band contains the true value.
pub(super) fn held(monitor: &Monitor, truth: &[f64]) -> usize {
    let estimates = monitor.estimates();
    let fitted: Vec<_> = estimates
        .iter()
        .filter(|e| e.half_width.is_some())
        .collect();
    assert_eq!(fitted.len(), truth.len());
    let inside = fitted.iter().zip(truth).filter(|(estimate, truth)| {
        (estimate.value - **truth).abs() < estimate.half_width.unwrap()
    });
    inside.count()
}
