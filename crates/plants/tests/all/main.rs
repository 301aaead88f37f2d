//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod absent;
mod as_text;
mod closed_loop;
mod composition;
mod derivatives;
mod disturbance;
mod fast_vessels;
mod joined;
mod lags;
mod outputs;
mod reference;
mod robustness;
mod support;
mod terms;
mod threads;
