//! Models of several domains with inputs from a record, for tests of the effects.

use ct_model::effects::{Candidate, EffectParameter, Role, Visited, candidates, shapes_keeping};
use ct_model::{Method, Model, ModelSpec, Simulation, SimulationNumber};
use std::collections::BTreeMap;

pub(super) const BLOCK: &str = r#"
model Block "a heated block"
  parameter Real C(unit="J/K", min=0) = 50;
  parameter Real k(unit="W/K", min=0) = 0.5 "loss";
  parameter Real g(unit="W/W", min=0) = 0.9;
  input Real u(unit="W");
  input Real Ta(unit="degC");
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=31);
  Real loss(unit="W") = k*(T - Ta);
equation
  C*der(T) = g*u - loss;
end Block;
"#;

const SPRING: &str = r#"
model Spring
  parameter Real c(unit="N.s/m", min=0) = 0.7;
  parameter Real k(unit="N/m", min=0) = 2;
  final parameter Real m(unit="kg") = 1.1;
  input Real F(unit="N");
  output Real s(unit="m", start=0.1);
  Real v(unit="m/s", start=0);
equation
  der(s) = v;
  m*der(v) = F - c*v - k*s;
end Spring;
"#;

const TANKS: &str = r#"
model Tanks
  parameter Real p(unit="cm3/(s.V)", min=0) = 6;
  parameter Real a1(unit="cm2", min=0) = 0.2;
  parameter Real a2(unit="cm2", min=0) = 0.22;
  final parameter Real S(unit="cm2") = 26;
  constant Real gravity(unit="cm/s2") = 981;
  input Real u(unit="V");
  output Real y1(unit="cm");
  output Real y2(unit="cm");
  Real h1(unit="cm", start=18);
  Real h2(unit="cm", start=15);
  Real q1(unit="cm3/s");
equation
  q1 = a1*sqrt(2*gravity*max(h1, 0));
  S*der(h1) = p*u - q1;
  S*der(h2) = q1 - a2*sqrt(2*gravity*max(h2, 0));
  y1 = h1;
  y2 = h2;
end Tanks;
"#;

const BATTERY: &str = r#"
model Battery
  parameter Real R(unit="Ohm", min=0) = 0.05;
  parameter Real Q(unit="A.s", min=0) = 3000;
  parameter Real e(unit="V") = 0.8;
  input Real i(unit="A");
  output Real v(unit="V");
  Real soc(start=0.5, fixed=true);
equation
  Q*der(soc) = i;
  v = 3.2 + e*soc + R*i;
end Battery;
"#;

/// A model with its inputs, held from row to row.
pub(super) struct Driven {
    pub(super) spec: ModelSpec,
    time: Vec<f64>,
    inputs: Vec<Vec<f64>>,
}

impl Driven {
    pub(super) fn all() -> Vec<Self> {
        let steps = |k: usize, levels: &[f64], long: usize| levels[(k / long) % levels.len()];
        let of = |text: &str, step: f64, input: &dyn Fn(usize) -> Vec<f64>| Self {
            spec: ModelSpec::parse(text).unwrap(),
            time: (0..60).map(|k| step * k as f64).collect(),
            inputs: (0..60).map(input).collect(),
        };
        vec![
            of(BLOCK, 10.0, &|k| {
                vec![steps(k, &[5.0, 20.0, 12.0, 3.0], 9), 20.0 + 0.05 * k as f64]
            }),
            of(SPRING, 0.2, &|k| {
                vec![steps(k, &[0.4, -0.3, 0.8, -0.7], 11)]
            }),
            of(TANKS, 4.0, &|k| vec![steps(k, &[6.0, 8.5, 5.0, 9.0], 8)]),
            of(BATTERY, 5.0, &|k| {
                vec![steps(k, &[2.0, -3.0, 1.0, -1.0], 7)]
            }),
        ]
    }

    pub(super) fn run<T: SimulationNumber>(&self, model: &Model, parameters: &[T]) -> Vec<Vec<T>> {
        let initial = model.starts(parameters);
        let mut simulation = Simulation::new(model, parameters, &initial, 0.0);
        let mut rows = Vec::new();
        for (k, inputs) in self.inputs.iter().enumerate() {
            let mut y = vec![T::constant(0.0); model.spec().outputs.len()];
            simulation.read(inputs, &mut y);
            rows.push(y);
            if k + 1 < self.time.len() {
                let done = simulation.advance(inputs, inputs, self.time[k + 1]);
                done.unwrap_or_else(|error| panic!("{error}\n{}", model.spec()));
            }
        }
        rows
    }

    pub(super) fn method(&self, model: &Model) -> Method {
        let parameters = model.parameters();
        Simulation::new(model, &parameters, &model.starts(&parameters), 0.0).method()
    }

    fn visited(&self) -> Visited {
        let model = Model::new(self.spec.clone());
        let parameters = model.parameters();
        let initial = model.starts(&parameters);
        let at = (&parameters[..], &initial[..]);
        Visited::of_simulation(&self.spec, at, &self.time, &self.inputs, "s").unwrap()
    }

    pub(super) fn candidates(&self) -> Vec<Candidate> {
        candidates(&self.spec, &self.visited())
    }

    /// All candidates, and the smooth functions that searches do not use.
    pub(super) fn with_shapes(&self) -> Vec<Candidate> {
        let mut all = self.candidates();
        all.extend(shapes_keeping(
            &self.spec,
            &self.visited(),
            &BTreeMap::new(),
        ));
        all
    }
}

pub(super) fn largest_difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub(super) fn range(rows: &[Vec<f64>]) -> f64 {
    let largest = |sign: f64| {
        let all = rows.iter().flatten().map(|y| sign * y);
        all.fold(f64::NEG_INFINITY, f64::max)
    };
    largest(1.0) + largest(-1.0)
}

/// Start of a fit of the candidate: some of its starts, with a size that has an influence.
pub(super) fn active(candidate: &Candidate) -> Vec<f64> {
    // Quantiles may be levels at which an input is constant: a limit that passes over such a level has no derivative.
    let of = |p: &EffectParameter| {
        let start = match p.role {
            Role::Size => p.starts[0],
            // A larger dead zone empties both tanks.
            Role::Threshold if p.short == "threshold" => p.starts[1],
            // Stiction has tests of its own.
            Role::Choice if p.short == "jump" => p.starts[0],
            _ => p.starts[p.starts.len() / 2],
        };
        let aside = if p.role == Role::Threshold {
            0.013
        } else {
            0.0
        };
        start + aside * (p.bounds.1 - p.bounds.0)
    };
    candidate.parameters.iter().map(of).collect()
}
