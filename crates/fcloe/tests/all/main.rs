//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod any_numbers;
mod bad_input;
mod convergence;
mod coverage;
mod error_of_the_loop;
mod experiment;
mod freedom;
mod least_squares;
mod offsets;
mod recovery;
mod recursive;
mod sensitivities;
mod starts;
mod support;
mod threads;
