//! The crate from outside: one program for all tests, as each of its own would link the crate again.
#![allow(clippy::unwrap_used, clippy::panic)]

mod baysse;
mod threads;
mod udink_bands;
mod udink_reference;
