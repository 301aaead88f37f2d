//! The number types for which the simulation is compiled.
//!
//! A generic function is compiled again in every crate that calls it, and the code of a simulation is large. Its entry points are therefore
//! methods of the number type, so that the code for each type is compiled in this crate only.

use super::{Model, NoSolution, SimulationState};
use crate::scalar::{Dual, Scalar};

/// The methods of [`Simulation`] for one number type.
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
    /// As [`Simulation::advance`].
    fn advance(
        state: &mut SimulationState<Self>,
        model: &Model,
        inputs: (&[f64], &[f64]),
        until: f64,
    ) -> Result<(), NoSolution>;
}

/// The number types of a [`Simulation`](super::Simulation): `f64`, and duals with 2, 4, 8, 12 or 15 derivatives.
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

// With more than 15 derivatives the compiler copies a dual by a function call instead of in registers, which is half as fast.
compile_for!(f64, Dual<2>, Dual<4>, Dual<8>, Dual<12>, Dual<15>);
