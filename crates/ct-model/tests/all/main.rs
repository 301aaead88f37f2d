//! One program for all tests.
#![allow(clippy::unwrap_used, clippy::panic)]

mod effects;
mod language;
mod mutated;
mod refused;
mod round_trip;
mod simulated;
mod units;
