//! Recursive output error in continuous time, stabilised by an extended parameter vector. No `std`; no allocation per sample.
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod derivatives;
mod error;
mod estimator;
#[cfg(feature = "alloc")]
mod filters;
mod gain;
mod hurwitz;
mod integrator;
mod model;
#[cfg(feature = "alloc")]
mod spr;

pub use derivatives::{Derivatives, IoSample, Known, KnownSample, LateDifference};
pub use error::Error;
pub use estimator::{Bounded, StabilizedOe};
#[cfg(feature = "alloc")]
pub use filters::StateVariableFilters;
pub use gain::{BlockDiagonal, Full, Gain, UNGUARDED};
pub use integrator::Integrator;
#[cfg(feature = "alloc")]
pub use spr::{FilterBounds, check_filter_bounds};
