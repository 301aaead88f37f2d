//! Closed-loop output error in continuous time (F-CLOE), after Baysse, Carrillo and Habbadi.
//!
//! Model: a plant `A(p) y = B(p) u` of any order in a loop with a known controller `u = R/S (r - y)`. The model's
//! output is that of the whole loop driven by the reference, `y^ = B^ R/P^ r` with `P^ = A^ S + B^ R`, so noise that
//! circulates in the loop does not bias the estimates. Without a controller it is the output error method.

mod closed_loop;
mod controller;
mod error;
mod plant_model;
mod record;
mod simulation;

pub use closed_loop::ClosedLoop;
pub use controller::Controller;
pub use error::Error;
pub use plant_model::{Orders, PlantModel};
pub use record::{LoopRecord, Offsets, OperatingPoint};
pub use simulation::{BLOCK, Block, LoopSimulator};
