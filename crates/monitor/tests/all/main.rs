//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used, clippy::panic)]

mod dead_time;
mod domain;
mod monitor;
mod outputs;
mod own;
mod own_candidates;
mod play;
mod support;
mod threads;
