//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod priors;
mod results;
mod undetermined;
