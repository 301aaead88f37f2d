#![doc = include_str!("../README.md")]
//!
//! # Layers
//! [`ct_model`] has the models, the effects and their simulation with exact derivatives, [`greybox::ModelSetup`] the
//! fit, [`estimation`] least squares under a noise model.

mod accept;
mod base;
pub mod design;
mod diagnose;
mod diagnostics;
mod error;
mod fit;
pub mod not_finite;
pub mod residual_tests;
mod result;
mod search;
mod thresholds;

pub use accept::quantisation::Quantisation;
pub use base::control_loop::{Enclosed, enclose, first_fit, in_needed_loop, widened};
pub use base::gaps::{FIRST_HOLD, LONGEST_HOLD, MendedGaps, PriorKnowledge, Whole, mend};
pub use base::loop_state::{ControlLoop, NotSimulated};
pub use base::problem::{Kept, Options, Problem};
pub use base::problem_builder::ProblemBuilder;
pub use diagnose::{Progress, diagnose};
pub use diagnostics::failures;
pub use diagnostics::failures::{Bin, Failure, FailureKind, Failures};
pub use diagnostics::unknown::{PortScore, Unknown};
pub use error::Error;
pub use fit::believed::{Believed, all_candidates, believed};
pub use fit::estimate::Estimate;
pub use fit::relations::Absorbed;
pub use residual_tests::{Line, NotNoise, ResidualTests, strongest_line};
pub use result::diagnosis::{Diagnosis, NoiseFloor, Single, Step, Verdict};
pub use result::found_model::with_effects;
pub use result::held_out::{HeldOut, LATER_ROWS, MOST_OF_RECORD, held_out};
pub use result::output_step::{HeldOutError, OutputStep, output_steps};
pub use thresholds::Thresholds;
