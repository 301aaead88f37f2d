//! ctid

pub mod report;
