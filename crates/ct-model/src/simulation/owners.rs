//! A simulation with its model: borrowed, or shared.

use std::sync::Arc;

use super::{Method, Model, NoSolution, SimulationNumber, SimulationState};

/// A simulation in progress, which borrows its model.
///
/// Nothing is allocated from row to row, but for the past of what is delayed.
pub struct Simulation<'a, T> {
    model: &'a Model,
    state: SimulationState<T>,
}

impl<'a, T: SimulationNumber> Simulation<'a, T> {
    /// Begins at `start` on the clock that `time` follows, with parameters in the order of [`crate::ModelSpec::parameters`] and a value for
    /// each state.
    ///
    /// # Panics
    /// Where the numbers of parameters or states are not the model's.
    #[must_use]
    pub fn new(model: &'a Model, parameters: &[T], initial: &[T], start: f64) -> Self {
        Self {
            model,
            state: T::begin(model, parameters, initial, start),
        }
    }

    /// The outputs now, with the inputs of this row.
    pub fn read(&mut self, inputs: &[f64], outputs: &mut [T]) {
        T::read(&mut self.state, self.model, inputs, outputs);
    }

    /// Goes on to `until`, the inputs in straight lines from one value to the other (the same where they are held).
    ///
    /// # Errors
    /// Where the simulation cannot go on.
    pub fn advance(&mut self, from: &[f64], to: &[f64], until: f64) -> Result<(), NoSolution> {
        T::advance(&mut self.state, self.model, (from, to), until)
    }
}

impl<T> Simulation<'_, T> {
    /// The present integration method.
    #[must_use]
    pub fn method(&self) -> Method {
        self.state.method
    }

    /// The present states.
    #[must_use]
    pub fn state(&self) -> &[T] {
        &self.state.state
    }
}

/// A [`Simulation`] that shares the ownership of its model instead of borrowing it, for what lives longer than a function.
pub struct SharedSimulation<T> {
    model: Arc<Model>,
    state: SimulationState<T>,
}

impl<T: SimulationNumber> SharedSimulation<T> {
    /// As [`Simulation::new`].
    ///
    /// # Panics
    /// Where the numbers of parameters or states are not the model's.
    #[must_use]
    pub fn new(model: Arc<Model>, parameters: &[T], initial: &[T], start: f64) -> Self {
        Self {
            state: T::begin(&model, parameters, initial, start),
            model,
        }
    }

    /// As [`Simulation::read`].
    pub fn read(&mut self, inputs: &[f64], outputs: &mut [T]) {
        T::read(&mut self.state, &self.model, inputs, outputs);
    }

    /// As [`Simulation::advance`].
    ///
    /// # Errors
    /// As there.
    pub fn advance(&mut self, from: &[f64], to: &[f64], until: f64) -> Result<(), NoSolution> {
        T::advance(&mut self.state, &self.model, (from, to), until)
    }

    /// The present states.
    #[must_use]
    pub fn state(&self) -> &[T] {
        &self.state.state
    }
}
