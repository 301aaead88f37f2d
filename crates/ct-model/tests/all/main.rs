//! A single test program.
#![allow(clippy::unwrap_used, clippy::panic)]

mod delayed_outputs;
mod effects;
mod events;
mod language;
mod library;
mod linear_form;
mod long_steps;
mod memory;
mod mutated;
mod own_candidates;
mod random_derivatives;
mod refused;
mod round_trip;
mod shared;
mod simulated;
mod sliding;
mod stiff_roots;
mod support;
mod terms;
mod threads;
mod tolerance;
mod units;
mod visited;
