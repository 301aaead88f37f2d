//! One program for all tests.
#![allow(clippy::unwrap_used, clippy::panic)]

mod language;
mod linear_form;
mod mutated;
mod refused;
mod round_trip;
mod simulated;
mod units;
