//! A compiled model.

use super::{NoSolution, Simulation};
use crate::linearity::ExactSteps;
use crate::scalar::Scalar;
use crate::spec::ModelSpec;
use crate::tape::Tape;

/// A compiled model, which can be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    spec: ModelSpec,
    pub(super) tape: Tape,
    pub(super) exact: ExactSteps,
}

impl Model {
    /// Compiles a model.
    #[must_use]
    pub fn new(spec: ModelSpec) -> Self {
        let tape = Tape::compile(&spec);
        // A function with memory follows its argument from row to row, not in the parts of an interval.
        let is_whole = tape.delays.is_empty() || tape.plays.is_empty();
        let of_outputs = tape.delays_of_outputs().iter().all(|is| *is);
        let exact = if of_outputs && is_whole && !spec.states.is_empty() {
            spec.exact_steps()
        } else {
            ExactSteps::No
        };
        Self { spec, tape, exact }
    }

    /// The specification from which the model was compiled.
    #[must_use]
    pub fn spec(&self) -> &ModelSpec {
        &self.spec
    }

    /// Whether the model delays something.
    #[must_use]
    pub fn has_delays(&self) -> bool {
        !self.tape.delays.is_empty()
    }

    /// The compiled operations.
    pub(crate) fn tape(&self) -> &Tape {
        &self.tape
    }

    /// The parameter values of the model text, in the order of [`ModelSpec::parameters`].
    #[must_use]
    pub fn parameters(&self) -> Vec<f64> {
        let parameters = self.spec.parameters.iter();
        parameters.map(|parameter| parameter.value).collect()
    }

    /// The initial values of the states by the model text, for these parameters.
    #[must_use]
    pub fn starts<T: Scalar>(&self, parameters: &[T]) -> Vec<T> {
        let mut registers = self.tape.registers(parameters);
        self.tape.evaluate_with_guards(&mut registers);
        let starts = self.tape.starts.iter();
        starts.map(|&register| registers.values[register]).collect()
    }

    /// Simulates the model from its initial values, with evenly sampled, held inputs; returns a series for each output.
    ///
    /// `parameters`: in the order of [`ModelSpec::parameters`]. `interval` \[the model's unit of time\]. `inputs`: a series for each input,
    /// of equal length, which is the number of samples: none for a model without inputs.
    ///
    /// # Errors
    /// If the simulation fails.
    ///
    /// # Panics
    /// If the number of parameters or inputs is not that of the model.
    pub fn simulate(
        &self,
        parameters: &[f64],
        interval: f64,
        inputs: &[&[f64]],
    ) -> Result<Vec<Vec<f64>>, NoSolution> {
        assert_eq!(inputs.len(), self.spec.inputs.len(), "inputs");
        let samples = inputs.iter().map(|input| input.len()).min().unwrap_or(0);
        let mut simulation = Simulation::new(self, parameters, &self.starts(parameters), 0.0);
        let mut read = vec![0.0; self.spec.outputs.len()];
        let mut outputs = vec![Vec::with_capacity(samples); read.len()];
        let mut row = vec![0.0; inputs.len()];
        for k in 0..samples {
            for (value, input) in row.iter_mut().zip(inputs) {
                *value = input[k];
            }
            simulation.read(&row, &mut read);
            for (output, reading) in outputs.iter_mut().zip(&read) {
                output.push(*reading);
            }
            simulation.advance(&row, &row, interval * (k + 1) as f64)?;
        }
        Ok(outputs)
    }
}
