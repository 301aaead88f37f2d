//! A simulation with its model: borrowed, or shared.

use std::sync::Arc;

use super::{Method, Model, NoSolution, SimulationNumber, SimulationState};

/// Below this, rounding alone would exceed the tolerance of a step.
const LEAST_TOLERANCE: f64 = 1e-14;

/// A simulation in progress, which borrows its model.
///
/// No memory is allocated from sample to sample, except for the past of delayed expressions.
pub struct Simulation<'a, T> {
    model: &'a Model,
    state: SimulationState<T>,
}

impl<'a, T: SimulationNumber> Simulation<'a, T> {
    /// Starts at time `start`, with parameters in the order of [`crate::ModelSpec::parameters`] and an initial value for each state.
    ///
    /// # Panics
    /// If the number of parameters or states is not that of the model.
    #[must_use]
    pub fn new(model: &'a Model, parameters: &[T], initial: &[T], start: f64) -> Self {
        Self {
            model,
            state: T::begin(model, parameters, initial, start),
        }
    }

    /// Sets the tolerance of a step, as a share of the largest absolute value that a state has had: [`TOLERANCE`](super::TOLERANCE) if it is
    /// not set, and at least 1e-14. Exact steps of linear models do not depend on it.
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.state.tolerance = tolerance.max(LEAST_TOLERANCE);
        self
    }

    /// The present outputs, with the inputs of this sample.
    pub fn read(&mut self, inputs: &[f64], outputs: &mut [T]) {
        T::read(&mut self.state, self.model, inputs, outputs);
    }

    /// Advances to time `until`, with inputs that are linear in time between the two values (equal values: held).
    ///
    /// # Errors
    /// If the simulation fails.
    pub fn advance(&mut self, from: &[f64], to: &[f64], until: f64) -> Result<(), NoSolution> {
        T::advance(&mut self.state, self.model, (from, to), until)
    }

    /// Sets inputs that a controller drives: `driven` has an entry for each input, and those with a number are held at it from now on, with
    /// its derivatives. [`Self::read`] and [`Self::advance`] then take the values of these numbers for such an input.
    pub fn drive(&mut self, driven: &[Option<T>]) {
        self.state.drive(driven);
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
    /// If the number of parameters or states is not that of the model.
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
