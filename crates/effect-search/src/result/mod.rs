//! The result: values for programs.

pub(crate) mod assemble;
pub(crate) mod diagnosis;
pub(crate) mod found_model;
pub(crate) mod held_out;
pub(crate) mod output_step;
