#![doc = include_str!("../README.md")]

mod check;
mod closed_loop;
mod compare;
mod confirm;
mod control_loop;
pub mod design;
mod diagnose;
mod diagnosis;
mod doubt;
mod error;
mod exchange;
mod exhausted;
mod feedback_test;
mod find;
mod fitted;
mod floating;
mod gaps;
mod groups;
mod hidden_step;
mod judge;
mod jump;
mod locate;
mod minima;
mod node;
mod noise_floor;
pub mod numbers;
mod pairs;
mod partial;
mod plausible;
mod problem;
mod problem_builder;
mod proposal;
mod random_walk;
mod remains;
mod rounding;
mod scores;
mod search;
mod sentences;
mod series;
#[cfg(test)]
mod simulated;
mod step;
mod sticking;
mod trail;
mod unknown;

pub use compare::compare;
pub use diagnose::diagnose;
pub use diagnosis::{
    Acceptance, Bin, ControlLoop, Diagnosis, Effort, Failures, HeldOutError, NoiseFloor,
    OutputStep, Parameter, PerOutput, PlaceScore, Rankings, ResidualTests, Score, Shown,
    ShownInput, Step, Verdict,
};
pub use error::Error;
pub use fitted::{Fitted, fitted};
pub use gaps::{LONGEST_HOLD, MendedGaps};
pub use groups::GROUP_MARGIN;
pub use locate::{Located, Series, locate};
pub use problem::{Options, Problem, Progress, TIME_LIMIT};
pub use problem_builder::ProblemBuilder;
pub use unknown::{PlaceLikelihood, Primitive, Share, Unknown, Window};
