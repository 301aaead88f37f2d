//! Shared parts of several tests.
#![allow(dead_code, clippy::unwrap_used)]

pub mod plant;
pub mod reference;
pub mod second_order;
