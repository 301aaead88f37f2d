//! Simulations against an adaptive solver that no one here wrote, and derivatives against central differences.

use ct_model::{Dual, Method, Model, ModelSpec, Scalar, Simulation, SimulationNumber};
use ode_solvers::{DVector, Dopri5, System, dop_shared::OutputType};

/// A model with its inputs: rows, held or linear between them.
pub struct Case {
    pub model: Model,
    pub time: Vec<f64>,
    pub inputs: Vec<Vec<f64>>,
    pub lines: bool,
    pub tolerance: f64,
}

pub fn model(text: &str) -> Model {
    Model::new(ModelSpec::parse(text).unwrap_or_else(|error| panic!("{error}")))
}

impl Case {
    pub fn new(text: &str, rows: usize, step: f64, input: impl Fn(usize) -> Vec<f64>) -> Self {
        Self {
            model: model(text),
            time: (0..rows).map(|k| step * k as f64).collect(),
            inputs: (0..rows).map(input).collect(),
            lines: false,
            tolerance: ct_model::TOLERANCE,
        }
    }

    /// The outputs of all rows, and the method at the end, or the implicit one if it was used at any row.
    pub fn run<T: SimulationNumber>(
        &self,
        parameters: &[T],
        initial: &[T],
    ) -> (Vec<Vec<T>>, Method) {
        let mut simulation =
            Simulation::new(&self.model, parameters, initial, 0.0).with_tolerance(self.tolerance);
        let mut rows = Vec::new();
        let mut method = simulation.method();
        for k in 0..self.time.len() {
            let mut y = vec![T::constant(0.0); self.model.spec().outputs.len()];
            simulation.read(&self.inputs[k], &mut y);
            rows.push(y);
            if k + 1 < self.time.len() {
                let to = &self.inputs[if self.lines { k + 1 } else { k }];
                simulation
                    .advance(&self.inputs[k], to, self.time[k + 1])
                    .unwrap_or_else(|error| panic!("{error}"));
                if method != Method::Implicit {
                    method = simulation.method();
                }
            }
        }
        (rows, method)
    }

    pub fn plain(&self) -> (Vec<Vec<f64>>, Method) {
        let parameters = self.model.parameters();
        let initial = self.model.starts(&parameters);
        self.run(&parameters, &initial)
    }

    pub fn range(rows: &[Vec<f64>], output: usize) -> f64 {
        let of = |pick: fn(f64, f64) -> f64, from| rows.iter().map(|y| y[output]).fold(from, pick);
        of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY)
    }

    /// Derivatives of all outputs by all parameters and initial states against central differences.
    pub fn check_derivatives(&self, tolerance: f64) {
        self.check_derivatives_by(1e-5, tolerance);
    }

    /// Checks derivatives with differences of another share of each entry: the outputs of a stiff model are accurate to 1e-10, and a
    /// shorter step would show their error; a longer step would move an event across a row.
    pub fn check_derivatives_by(&self, share: f64, tolerance: f64) {
        const LANES: usize = 15;
        let parameters = self.model.parameters();
        let initial = self.model.starts(&parameters);
        let all: Vec<f64> = parameters.iter().chain(&initial).copied().collect();
        assert!(all.len() <= LANES);
        let duals: Vec<_> = (0..all.len())
            .map(|i| Dual::<LANES>::variable(all[i], i))
            .collect();
        let (exact, _) = self.run(&duals[..parameters.len()], &duals[parameters.len()..]);
        for i in 0..all.len() {
            let size = if all[i] == 0.0 { 1e-2 } else { all[i].abs() };
            let step = share * size;
            let moved = |by: f64| {
                let mut all = all.clone();
                all[i] += by;
                self.run(&all[..parameters.len()], &all[parameters.len()..])
                    .0
            };
            // Fourth order, so that the difference itself is good to 1e-6 of the slopes.
            let (p, m, p2, m2) = (
                moved(step),
                moved(-step),
                moved(2.0 * step),
                moved(-2.0 * step),
            );
            for output in 0..exact[0].len() {
                let difference = |k: usize| {
                    (8.0 * (p[k][output] - m[k][output]) - (p2[k][output] - m2[k][output]))
                        / (12.0 * step)
                };
                // If doubling an entry changes the output by less than a tenth, the difference shows only the error of the outputs.
                let visited = exact.iter().map(|y| y[output].re.abs()).fold(0.0, f64::max);
                let largest = (0..exact.len())
                    .map(|k| difference(k).abs())
                    .fold(0.1 * visited / size, f64::max);
                for (k, row) in exact.iter().enumerate() {
                    let (found, expected) = (row[output].eps[i], difference(k));
                    assert!(
                        (found - expected).abs() <= tolerance * largest,
                        "entry {i}, output {output}, row {k}: {found} instead of {expected} (largest {largest})"
                    );
                }
            }
        }
    }
}

/// The model by its expressions, for a solver from outside.
struct Outside<'a> {
    model: &'a Model,
    inputs: &'a [f64],
    rise: Vec<f64>,
    begin: f64,
}

impl Outside<'_> {
    fn values(&self, t: f64, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        use ct_model::Variable;
        let spec = self.model.spec();
        let parameters = self.model.parameters();
        let mut flows = vec![0.0; spec.flows.len()];
        let of = |flows: &[f64], variable: Variable| match variable {
            Variable::Parameter(i) => parameters[i],
            Variable::Input(i) => self.inputs[i] + self.rise[i] * (t - self.begin),
            Variable::State(i) => x[i],
            Variable::Flow(i) => flows[i],
        };
        for &flow in &spec.order {
            flows[flow] = spec.flows[flow].value.value(t, &|v| of(&flows, v));
        }
        let slopes = spec.states.iter().map(|state| {
            let by = state
                .coefficient
                .as_ref()
                .map_or(1.0, |c| c.value(t, &|v| of(&flows, v)));
            state.right.value(t, &|v| of(&flows, v)) / by
        });
        let outputs = spec
            .outputs
            .iter()
            .map(|output| of(&flows, output.variable));
        (slopes.collect(), outputs.collect())
    }
}

impl System<f64, DVector<f64>> for Outside<'_> {
    fn system(&self, t: f64, x: &DVector<f64>, dx: &mut DVector<f64>) {
        dx.copy_from_slice(&self.values(t, x.as_slice()).0);
    }
}

/// Every row by the adaptive solver of another crate, restarted where inputs jump.
fn outside(case: &Case) -> Vec<Vec<f64>> {
    let parameters = case.model.parameters();
    let mut x = DVector::from_vec(case.model.starts(&parameters));
    let mut rows = Vec::new();
    for k in 0..case.time.len() {
        let begin = case.time[k];
        let system = |rise| Outside {
            model: &case.model,
            inputs: &case.inputs[k],
            rise,
            begin,
        };
        let held = vec![0.0; case.inputs[k].len()];
        rows.push(system(held.clone()).values(begin, x.as_slice()).1);
        let Some(&end) = case.time.get(k + 1) else {
            break;
        };
        let rise = if case.lines {
            let pairs = case.inputs[k].iter().zip(&case.inputs[k + 1]);
            pairs.map(|(a, b)| (b - a) / (end - begin)).collect()
        } else {
            held
        };
        // The solver's stiffness test reacts to corners: it is switched off.
        let (h, most) = ((end - begin) / 20.0, 200_000);
        let mut solver = Dopri5::from_param(
            system(rise),
            begin,
            end,
            h,
            x.clone(),
            1e-12,
            1e-12,
            0.9,
            0.04,
            0.2,
            10.0,
            h,
            0.0,
            most,
            most,
            OutputType::Sparse,
        );
        solver.integrate().unwrap_or_else(|error| panic!("{error}"));
        if let Some(last) = solver.y_out().last() {
            x = last.clone();
        }
    }
    rows
}

pub fn check_outside(case: &Case, tolerance: f64) {
    let (own, _) = case.plain();
    let outside = outside(case);
    for output in 0..own[0].len() {
        let range = Case::range(&outside, output);
        for (k, (own, outside)) in own.iter().zip(&outside).enumerate() {
            let off = (own[output] - outside[output]).abs() / range;
            assert!(
                off <= tolerance,
                "output {output}, row {k}: off by {off:e} of the range"
            );
        }
    }
}
