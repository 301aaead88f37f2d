//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used, clippy::panic)]

mod ar;
mod csv_file;
mod names;
mod residual_tests;
mod signals;
mod simulated_inputs;
mod threads;
mod tolerant_reading;
