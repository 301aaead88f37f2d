//! The numbers that a simulation is compiled for.
//!
//! A generic function is compiled again in every crate that calls it, and the code of a simulation is large: its entry points belong to the
//! number instead, so that the code for each number is compiled in this crate alone.

use super::{Model, NoSolution, Simulation};
use crate::scalar::{Dual, Scalar};

/// What [`Simulation`] does, for one kind of number.
pub trait Compiled: Scalar {
    /// [`Simulation::new`].
    fn begin<'a>(
        model: &'a Model,
        parameters: &[Self],
        initial: &[Self],
        start: f64,
    ) -> Simulation<'a, Self>;

    /// [`Simulation::read`].
    fn read(simulation: &mut Simulation<'_, Self>, inputs: &[f64], outputs: &mut [Self]);

    /// [`Simulation::advance`].
    ///
    /// # Errors
    /// As there.
    fn advance(
        simulation: &mut Simulation<'_, Self>,
        from: &[f64],
        to: &[f64],
        until: f64,
    ) -> Result<(), NoSolution>;
}

/// The numbers that a [`Simulation`] runs on: `f64`, and duals with 2, 4, 8, 12 or 16 derivatives.
pub trait SimulationNumber: Compiled {}

impl<T: Compiled> SimulationNumber for T {}

macro_rules! compile_for {
    ($($number:ty),*) => {$(
        impl Compiled for $number {
            fn begin<'a>(
                model: &'a Model,
                parameters: &[Self],
                initial: &[Self],
                start: f64,
            ) -> Simulation<'a, Self> {
                Simulation::begin(model, parameters, initial, start)
            }

            fn read(
                simulation: &mut Simulation<'_, Self>,
                inputs: &[f64],
                outputs: &mut [Self],
            ) {
                simulation.read_outputs(inputs, outputs);
            }

            fn advance(
                simulation: &mut Simulation<'_, Self>,
                from: &[f64],
                to: &[f64],
                until: f64,
            ) -> Result<(), NoSolution> {
                simulation.advance_to(from, to, until)
            }
        }
    )*};
}

compile_for!(f64, Dual<2>, Dual<4>, Dual<8>, Dual<12>, Dual<16>);
