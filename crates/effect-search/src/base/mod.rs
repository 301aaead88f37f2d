//! What a diagnosis begins with: the problem, and the gaps and the control loop of its records.

pub(crate) mod control_loop;
pub(crate) mod gaps;
pub(crate) mod loop_state;
pub(crate) mod problem;
pub(crate) mod problem_builder;
