//! The number types for which the simulator is compiled.
//!
//! A generic function is compiled again in every crate that calls it, and the code of a simulator is large. Its entry points are therefore
//! methods of the number type, so that the code for each type is compiled in this crate only.

use super::{Command, Simulator};
use crate::{Dual, Error, Scalar, Structure};

/// The methods of [`Simulator`] for one number type.
pub trait Compiled: Scalar {
    /// [`Simulator::starting_at`].
    ///
    /// # Errors
    /// As [`Simulator::starting_at`].
    fn starting_at(
        start: f64,
        structure: &Structure,
        theta: &[Self],
        initial: &[Self],
        at_rest: [f64; 2],
    ) -> Result<Simulator<Self>, Error>;

    /// [`Simulator::read`].
    fn read(simulator: &mut Simulator<Self>, output: usize) -> Self;

    /// [`Simulator::advance_both`].
    fn step(simulator: &mut Simulator<Self>, from: Self, to: Option<f64>, second: Command, h: f64);
}

/// The number types of a [`Simulator`]: `f64`, and duals with 4, 8, 12 or 15 derivatives.
pub trait SimulatorNumber: Compiled {}

impl<T: Compiled> SimulatorNumber for T {}

macro_rules! compile_for {
    ($($number:ty),*) => {$(
        impl Compiled for $number {
            fn starting_at(
                start: f64,
                structure: &Structure,
                theta: &[Self],
                initial: &[Self],
                at_rest: [f64; 2],
            ) -> Result<Simulator<Self>, Error> {
                Simulator::construct(start, structure, theta, initial, at_rest)
            }

            fn read(simulator: &mut Simulator<Self>, output: usize) -> Self {
                simulator.reading(output)
            }

            fn step(
                simulator: &mut Simulator<Self>,
                from: Self,
                to: Option<f64>,
                second: Command,
                h: f64,
            ) {
                simulator.step(from, to, second, h);
            }
        }
    )*};
}

// With more than 15 derivatives the compiler copies a dual by a function call instead of in registers, which is half as fast.
compile_for!(f64, Dual<4>, Dual<8>, Dual<12>, Dual<15>);
