//! The numbers that a simulation is compiled for.
//!
//! A generic function is compiled again in every crate that calls it, and the code of a simulation is large: its entry points belong to the
//! number instead, so that the code for each number is compiled in this crate alone.

use super::{Model, NoSolution, SimulationState};
use crate::scalar::{Dual, Scalar};

/// Entry points of a simulation, for one kind of number.
pub trait Compiled: Scalar {
    /// [`Simulation::new`](super::Simulation::new).
    fn begin(
        model: &Model,
        parameters: &[Self],
        initial: &[Self],
        start: f64,
    ) -> SimulationState<Self>;

    /// [`Simulation::read`](super::Simulation::read).
    fn read(state: &mut SimulationState<Self>, model: &Model, inputs: &[f64], outputs: &mut [Self]);

    /// [`Simulation::advance`](super::Simulation::advance), with the inputs at the beginning and at the end.
    ///
    /// # Errors
    /// As there.
    fn advance(
        state: &mut SimulationState<Self>,
        model: &Model,
        inputs: (&[f64], &[f64]),
        until: f64,
    ) -> Result<(), NoSolution>;
}

/// The numbers that a [`Simulation`](super::Simulation) runs on: `f64`, and duals with 2, 4, 8, 12 or 15 derivatives.
pub trait SimulationNumber: Compiled {}

impl<T: Compiled> SimulationNumber for T {}

macro_rules! compile_for {
    ($($number:ty),*) => {$(
        impl Compiled for $number {
            fn begin(
                model: &Model,
                parameters: &[Self],
                initial: &[Self],
                start: f64,
            ) -> SimulationState<Self> {
                SimulationState::begin(model, parameters, initial, start)
            }

            fn read(
                state: &mut SimulationState<Self>,
                model: &Model,
                inputs: &[f64],
                outputs: &mut [Self],
            ) {
                state.read(model, inputs, outputs);
            }

            fn advance(
                state: &mut SimulationState<Self>,
                model: &Model,
                inputs: (&[f64], &[f64]),
                until: f64,
            ) -> Result<(), NoSolution> {
                state.advance(model, inputs, until)
            }
        }
    )*};
}

// With one derivative more than 15 a compiler copies a dual by a call instead of in registers: half as fast.
compile_for!(f64, Dual<2>, Dual<4>, Dual<8>, Dual<12>, Dual<15>);
