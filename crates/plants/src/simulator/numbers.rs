//! The numbers that a simulator is compiled for.
//!
//! A generic function is compiled again in every crate that calls it, and the code of a simulator is large: its entry points belong to the
//! number instead, so that the code for each number is compiled in this crate alone.

use super::{Command, Simulator};
use crate::{Dual, Error, Scalar, Structure};

/// What [`Simulator`] does, for one kind of number.
pub trait Compiled: Scalar {
    /// [`Simulator::starting_at`].
    ///
    /// # Errors
    /// As there.
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

/// The numbers that a [`Simulator`] runs on: `f64`, and duals with 4, 8, 12 or 15 derivatives.
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

// With one derivative more than 15 a compiler copies a dual by a call instead of in registers: half as fast.
compile_for!(f64, Dual<4>, Dual<8>, Dual<12>, Dual<15>);
