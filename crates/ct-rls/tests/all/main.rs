//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod any_input;
mod blocks;
mod directional;
mod dynamic;
mod exact_step;
mod guards;
mod integrators;
mod lyapunov;
mod random_walk;
mod saved;
mod stress;
mod support;
mod tracking;
