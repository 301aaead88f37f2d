//! The matrices of a linear model, `dx/dt = A x + B u + e`, `y = C x + D u + f`, and its transfer functions.
//!
//! The matrices are read from the model's operations at zero and at the unit vectors, which is exact where the model is linear
//! ([`crate::Linearity`]). The transfer function from one input to one output follows by Leverrier's recursion: with
//! `M_1 = I`, `c_k = -tr(A M_k)/k`, `M_(k+1) = A M_k + c_k I`,
//! ```text
//! det(s I - A) = s^n + c_1 s^(n-1) + .. + c_n,     adj(s I - A) = M_1 s^(n-1) + .. + M_n
//! ```
//!
//! **Reference**: T. Kailath, Linear Systems, 1980, appendix A.

use crate::linearity::Linearity;
use crate::scalar::{Dual, Scalar};
use crate::simulation::Model;
use crate::tape::{Register, Registers};

/// A linear model at given parameters. Time is in the model's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearForm {
    /// States by states.
    pub a: Vec<Vec<f64>>,
    /// States by inputs.
    pub b: Vec<Vec<f64>>,
    /// Outputs by states.
    pub c: Vec<Vec<f64>>,
    /// Outputs by inputs.
    pub d: Vec<Vec<f64>>,
    /// Slope of each state where states and inputs are zero, `e`.
    pub state_offset: Vec<f64>,
    /// Value of each output when states and inputs are zero, `f`.
    pub output_offset: Vec<f64>,
}

/// A transfer function, by powers of s from zero on; the denominator's highest coefficient is one.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    /// Numerator.
    pub numerator: Vec<f64>,
    /// Denominator.
    pub denominator: Vec<f64>,
}

impl Model {
    /// The matrices of the model at parameters in the order of [`crate::ModelSpec::parameters`]; `None` where it is not linear, or delays
    /// something.
    ///
    /// # Panics
    /// Where the number of parameters is not the model's.
    #[must_use]
    pub fn linear(&self, parameters: &[f64]) -> Option<LinearForm> {
        let tape = self.tape();
        assert_eq!(parameters.len(), tape.parameters, "parameters");
        if self.spec().linearity() != Linearity::Linear || !tape.delays.is_empty() {
            return None;
        }
        let mut registers = tape.registers(parameters);
        let read = |registers: &Registers<f64>, at: &[Register]| -> Vec<f64> {
            at.iter()
                .map(|&register| registers.values[register])
                .collect()
        };
        tape.evaluate_with_guards(&mut registers);
        let state_offset = read(&registers, &tape.derivatives);
        let output_offset = read(&registers, &tape.outputs);
        let mut column = |register: Register| {
            registers.values[register] = 1.0;
            tape.evaluate(&mut registers);
            // Read before the register is set back: a derivative or an output may be the state itself.
            let less = |values: Vec<f64>, offset: &[f64]| -> Vec<f64> {
                values.iter().zip(offset).map(|(v, o)| v - o).collect()
            };
            let slopes = less(read(&registers, &tape.derivatives), &state_offset);
            let outputs = less(read(&registers, &tape.outputs), &output_offset);
            registers.values[register] = 0.0;
            (slopes, outputs)
        };
        let by_states: Vec<_> = (0..tape.states).map(|i| column(tape.state(i))).collect();
        let by_inputs: Vec<_> = (0..tape.inputs).map(|i| column(tape.input(i))).collect();
        let rows = |columns: &[(Vec<f64>, Vec<f64>)], outputs: bool, count: usize| {
            let row = |i: usize| {
                let of = |(slopes, read): &(Vec<f64>, Vec<f64>)| match outputs {
                    true => read[i],
                    false => slopes[i],
                };
                columns.iter().map(of).collect()
            };
            (0..count).map(row).collect::<Vec<Vec<f64>>>()
        };
        let (n, outputs) = (tape.states, tape.outputs.len());
        Some(LinearForm {
            a: rows(&by_states, false, n),
            b: rows(&by_inputs, false, n),
            c: rows(&by_states, true, outputs),
            d: rows(&by_inputs, true, outputs),
            state_offset,
            output_offset,
        })
    }
}

impl Model {
    /// The matrices of the model about a point, by exact derivatives; `state_offset` is the slope of each state there, `output_offset` each
    /// output there, so that `d(x - x0)/dt = A (x - x0) + B (u - u0) + state_offset`. Branches are those that hold there; plays stand where
    /// they are. `None` where the model delays something, or has no finite value or slope there.
    ///
    /// `parameters`, `states` and `inputs` in the order of the text, each in its unit; `time` in the model's unit.
    ///
    /// # Panics
    /// Where one of them has another length than the model.
    #[must_use]
    pub fn linear_about(
        &self,
        parameters: &[f64],
        states: &[f64],
        inputs: &[f64],
        time: f64,
    ) -> Option<LinearForm> {
        if !self.tape().delays.is_empty() {
            return None;
        }
        self.linear_undelayed(parameters, states, inputs, time)
    }

    /// As [`Model::linear_about`], of the model without its dead times.
    ///
    /// # Panics
    /// As there.
    #[must_use]
    pub fn linear_undelayed(
        &self,
        parameters: &[f64],
        states: &[f64],
        inputs: &[f64],
        time: f64,
    ) -> Option<LinearForm> {
        let tape = self.tape();
        assert_eq!(parameters.len(), tape.parameters, "parameters");
        assert_eq!(states.len(), tape.states, "states");
        assert_eq!(inputs.len(), tape.inputs, "inputs");
        // One direction at a time: the derivatives with respect to the state or the input at this position.
        let column = |moved: Option<Register>| -> (Vec<Dual<1>>, Vec<Dual<1>>) {
            let parameters: Vec<_> = parameters.iter().map(|p| Dual::constant(*p)).collect();
            let mut registers = tape.registers(&parameters);
            registers.values[0] = Dual::constant(time);
            let of_states = states.iter().enumerate().map(|(i, x)| (tape.state(i), *x));
            let of_inputs = inputs.iter().enumerate().map(|(i, u)| (tape.input(i), *u));
            for (register, value) in of_states.chain(of_inputs) {
                let lane = usize::from(moved != Some(register));
                registers.values[register] = Dual::variable(value, lane);
            }
            tape.evaluate_with_guards(&mut registers);
            for _ in 0..tape.delays.len() {
                for (i, &(what, _)) in tape.delays.iter().enumerate() {
                    registers.values[tape.delayed(i)] = registers.values[what];
                }
                tape.evaluate_with_guards(&mut registers);
            }
            let read = |at: &[Register]| at.iter().map(|&r| registers.values[r]).collect();
            (read(&tape.derivatives), read(&tape.outputs))
        };
        let (slopes, read) = column(None);
        let by_states: Vec<_> = (0..tape.states)
            .map(|i| column(Some(tape.state(i))))
            .collect();
        let by_inputs: Vec<_> = (0..tape.inputs)
            .map(|i| column(Some(tape.input(i))))
            .collect();
        let rows = |columns: &[(Vec<Dual<1>>, Vec<Dual<1>>)], outputs: bool, count: usize| {
            let entry = |i: usize, (slopes, read): &(Vec<Dual<1>>, Vec<Dual<1>>)| match outputs {
                true => read[i].eps[0],
                false => slopes[i].eps[0],
            };
            (0..count)
                .map(|i| columns.iter().map(|column| entry(i, column)).collect())
                .collect::<Vec<Vec<f64>>>()
        };
        let (n, outputs) = (tape.states, tape.outputs.len());
        let form = LinearForm {
            a: rows(&by_states, false, n),
            b: rows(&by_inputs, false, n),
            c: rows(&by_states, true, outputs),
            d: rows(&by_inputs, true, outputs),
            state_offset: slopes.iter().map(|slope| slope.re).collect(),
            output_offset: read.iter().map(|output| output.re).collect(),
        };
        form.is_finite().then_some(form)
    }
}

impl LinearForm {
    fn is_finite(&self) -> bool {
        let matrices = [&self.a, &self.b, &self.c, &self.d];
        let mut entries = matrices.into_iter().flatten().flatten();
        let mut offsets = self.state_offset.iter().chain(&self.output_offset);
        entries.all(|v| v.is_finite()) && offsets.all(|v| v.is_finite())
    }

    /// From one input to one output, both counted from zero; all other inputs are constant.
    ///
    /// # Panics
    /// Where there is no such input or output.
    #[must_use]
    pub fn transfer_function(&self, input: usize, output: usize) -> TransferFunction {
        let n = self.a.len();
        let mut denominator = vec![0.0; n + 1];
        let mut numerator = vec![0.0; n + 1];
        denominator[n] = 1.0;
        // M_k.
        let mut m: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
            .collect();
        for k in 1..=n {
            let of_row = |row: &Vec<f64>| -> f64 {
                row.iter().zip(&self.b).map(|(m, b)| m * b[input]).sum()
            };
            let moved = m.iter().map(of_row);
            numerator[n - k] = moved.zip(&self.c[output]).map(|(m, c)| m * c).sum();
            let mut next = vec![vec![0.0; n]; n];
            for (next, a) in next.iter_mut().zip(&self.a) {
                for (a, m) in a.iter().zip(&m) {
                    for (next, m) in next.iter_mut().zip(m) {
                        *next += a * m;
                    }
                }
            }
            let trace: f64 = (0..n).map(|i| next[i][i]).sum();
            denominator[n - k] = -trace / k as f64;
            for (i, row) in next.iter_mut().enumerate() {
                row[i] += denominator[n - k];
            }
            m = next;
        }
        let direct = self.d[output][input];
        for (b, a) in numerator.iter_mut().zip(&denominator) {
            *b += direct * a;
        }
        TransferFunction {
            numerator,
            denominator,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::{Model, ModelSpec};

    #[test]
    fn about_a_point_the_matrices_are_the_slopes_there() {
        let text = "model Tank\n  parameter Real k = 2;\n  input Real u;\n  output Real y = h^2 + u;\n  Real h(start = 1);\nequation\n  der(h) = u - k*sqrt(h);\nend Tank;";
        let model = Model::new(ModelSpec::parse(text).unwrap());
        assert!(model.linear(&[2.0]).is_none());
        let form = model.linear_about(&[2.0], &[4.0], &[3.0], 0.0).unwrap();
        assert_eq!(form.a, [[-0.5]]);
        assert_eq!(form.b, [[1.0]]);
        assert_eq!(form.c, [[8.0]]);
        assert_eq!(form.d, [[1.0]]);
        assert_eq!((form.state_offset[0], form.output_offset[0]), (-1.0, 19.0));
        assert!(
            model
                .linear_about(&[f64::INFINITY], &[4.0], &[3.0], 0.0)
                .is_none()
        );
    }

    #[test]
    fn of_a_linear_model_they_are_its_own() {
        let text = include_str!("../../../examples/models/heated-block.mo");
        let model = Model::new(ModelSpec::parse(text).unwrap());
        let parameters = model.parameters();
        let own = model.linear(&parameters).unwrap();
        let about = model.linear_about(&parameters, &[40.0], &[30.0, 20.0], 5.0);
        let about = about.unwrap();
        assert_eq!((&own.a, &own.b, &own.c), (&about.a, &about.b, &about.c));
    }
}
