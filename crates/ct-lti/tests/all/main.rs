//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used, clippy::panic)]

mod any_input;
mod positive_real;
mod roots;
mod sampling;
mod state_variable_filters;
mod threads;
mod transfer_functions;
