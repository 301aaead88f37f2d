//! Closed-loop output error in continuous time (F-CLOE), after Baysse, Carrillo and Habbadi.
//!
//! Model: a plant `A(p) y = B(p) u` of any order in a loop with a known controller `u = R/S (r - y)`. The model's
//! output is that of the whole loop driven by the reference, `y^ = B^ R/P^ r` with `P^ = A^ S + B^ R`, so noise that
//! circulates in the loop does not bias the estimates. Without a controller it is the output error method.

mod batch;
mod closed_loop;
mod control_check;
mod controller;
mod convergence;
mod error;
mod experiment;
mod noise_model;
mod normal_equations;
mod plant_model;
mod problem;
mod record;
mod recursive;
mod simulation;
pub mod start;
mod table_of_starts;
mod uncertainty;

pub use batch::{Coordinates, Damping, Fit, Iterate, Method, Settings, Stop};
pub use closed_loop::ClosedLoop;
pub use control_check::{Mismatch, controller_mismatch};
pub use controller::Controller;
pub use convergence::{Condition, Verdict, locus};
pub use error::Error;
pub use experiment::{LoopData, Noise, Quantiser, continuous_loop, noise_at_snr, sampled_loop};
pub use noise_model::{NoiseModel, NoisePath};
pub use plant_model::{Orders, PlantModel};
pub use problem::{Levels, Problem};
pub use record::{LoopRecord, Offsets, OperatingPoint};
pub use recursive::{Filter, LoopHealth, LoopSample, RecursiveFcloe, RecursiveSettings};
pub use simulation::{BLOCK, Block, LoopSimulator};
pub use table_of_starts::{StartRun, TableOfStarts, factors_to_five};
pub use uncertainty::Uncertainty;
