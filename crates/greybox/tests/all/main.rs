//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod closed_loop;
mod coverage;
mod disturbance;
mod effects;
mod ideal;
mod lag_states;
mod linearise;
mod minima;
mod minimise;
mod not_determined;
mod outputs;
mod parts;
mod prediction;
mod records;
mod sandwich;
mod support;
mod threads;
mod three_tank;
mod tolerance;
mod weights;
