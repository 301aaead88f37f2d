#![doc = include_str!("../README.md")]
//!
//! # Layers
//! [`ct_model`] has the models, the effects and their simulation with exact derivatives, [`greybox::ModelSetup`] the
//! fit, [`estimation`] least squares under a noise model.

mod accept;
mod assemble;
mod believed;
mod control_loop;
pub mod design;
mod detectable;
mod diagnose;
mod error;
mod factor_score;
pub mod failures;
mod floating;
mod found_model;
mod gaps;
mod groups;
mod held_out;
mod joined;
mod level_shift;
mod node;
pub mod not_finite;
mod output_step;
mod pairs;
mod partial;
mod problem;
mod problem_builder;
mod quantisation;
pub mod residual_tests;
mod result;
mod score;
mod search;
mod thresholds;
mod ties;
mod unknown;

pub use believed::{Believed, all_candidates, believed};
pub use control_loop::{ControlLoop, Enclosed, NotSimulated, enclose, widened};
pub use diagnose::{Progress, diagnose};
pub use error::Error;
pub use failures::{Bin, Failure, FailureKind, Failures};
pub use found_model::with_effects;
pub use gaps::{FIRST_HOLD, LONGEST_HOLD, MendedGaps, PriorKnowledge, Whole, mend};
pub use held_out::{HeldOut, LATER_ROWS, MOST_OF_RECORD, held_out};
pub use output_step::{HeldOutError, OutputStep, ResidualTests, output_steps};
pub use problem::{Kept, Options, Problem};
pub use problem_builder::ProblemBuilder;
pub use quantisation::Quantisation;
pub use residual_tests::{Line, NotNoise, strongest_line};
pub use result::{Absorbed, Diagnosis, Estimate, NoiseFloor, Single, Step, Verdict};
pub use thresholds::Thresholds;
pub use unknown::{PortScore, Unknown};
