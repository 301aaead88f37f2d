//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod any_input;
mod bounding;
mod convergence;
mod gain;
mod lyapunov;
mod lyapunov_strict;
mod orders;
mod positive_real;
mod printed_sign;
mod rows;
mod saved;
mod summed;
mod support;
mod threads;
mod uneven_steps;
