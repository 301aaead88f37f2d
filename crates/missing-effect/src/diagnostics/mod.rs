//! Diagnostics of one fitted model: its errors, where it fails ([`effect_search::failures`]), and whether its residual is noise.
//!
//! In this order: `residual_tests.rs` (tests whether the residual is noise), `held_out.rs`
//! (its error on other records), `step.rs` (all of these for the report), `unknown/` (the shape of what no effect explains), `remarks.rs`
//! (remarks that a comparison shares), `assemble.rs`
//! (the result that holds them). The search and the acceptance tests ask for single ones of these.

pub(crate) mod assemble;
pub(crate) mod held_out;
pub(crate) mod remarks;
pub(crate) mod residual_tests;
pub(crate) mod step;
pub(crate) mod unknown;
