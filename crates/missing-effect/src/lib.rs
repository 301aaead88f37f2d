#![doc = include_str!("../README.md")]

// Each module uses only earlier ones: error, numbers, result; fit, base, diagnostics, search, accept; compare, diagnose, fitted,
// design.
mod accept;
mod base;
mod compare;
pub mod design;
mod diagnose;
mod diagnostics;
mod error;
mod fit;
mod fitted;
pub mod numbers;
mod result;
mod search;
#[cfg(test)]
mod simulated;

pub use base::{Options, Problem, ProblemBuilder, Progress, TIME_LIMIT};
pub use compare::compare;
pub use diagnose::diagnose;
pub use diagnostics::unknown::PLACE_MARGIN;
pub use effect_search::FIRST_HOLD;
pub use error::Error;
pub use fit::criterion::GROUP_MARGIN;
pub use fitted::{Fitted, fitted};
pub use result::{
    Acceptance, ControlLoop, Diagnosis, Effort, LONGEST_HOLD, MendedGaps, NoiseFloor, NoiseSource,
    NotNoise, NotSimulated, Parameter, PerOutput, PlaceLikelihood, PlaceScore, Primitive, Rankings,
    Rejection, Remark, Score, Share, Shown, ShownInput, Step, Unknown, Verdict, Window,
};
