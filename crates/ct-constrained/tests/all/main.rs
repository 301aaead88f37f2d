//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod bounds;
mod filtered;
mod gamma;
mod oracle;
mod projection;
mod rows;
mod threads;
