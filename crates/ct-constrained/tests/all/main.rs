//! A single test program: separate programs would link the crate again.
#![allow(clippy::unwrap_used)]

mod bounds;
mod filtered;
mod gamma;
mod oracle;
mod projection;
mod rows;
mod threads;
