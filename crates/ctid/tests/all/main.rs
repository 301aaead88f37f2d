//! One program for all tests: each of its own would link the crate again.
#![allow(clippy::unwrap_used)]

mod bad_input;
mod check;
mod common;
mod design;
mod domain;
mod effort;
mod identify;
mod identify_loop;
mod identify_missing;
mod identify_refined;
mod injected;
mod model_file;
mod monitor;
mod outputs;
mod own_candidates;
mod own_design;
mod own_effects;
mod own_gaps;
mod own_held_out;
mod own_hints;
mod own_limits;
mod own_loop;
mod own_records;
mod own_term;
mod own_unknown;
mod own_without_inputs;
mod prior;
mod program;
mod readme;
mod results;
mod side_by_side;
mod simulate;
mod system_limits;
mod tables;
mod threads;
