//! Finds the effect that a model written as text lacks.
//!
//! [`diagnose`] fits the believed model to records, scores all effects of the catalogue at all ports of the model and the candidates of the
//! user's own, alone and in pairs, fits the promising ones, confirms what the noise does not explain, and groups what the data cannot tell
//! apart. The result ([`Diagnosis`]) is plain values.
//!
//! The layers below: [`ct_model`] has the models, the effects and their simulation with exact derivatives, [`greybox::ModelSetup`] the
//! fit, [`estimation`] least squares under a noise model.

mod accept;
mod believed;
pub mod design;
mod diagnose;
mod error;
mod factor_score;
mod groups;
mod held_out;
mod joined;
mod left;
mod node;
mod pairs;
mod partial;
mod problem;
pub mod residual;
mod result;
mod score;
mod search;
mod spectral_line;
mod stationarity;
mod unknown;

pub use believed::{Believed, all_candidates, believed};
pub use diagnose::{MANY, Progress, diagnose};
pub use error::Error;
pub use held_out::{HeldOut, held_out};
pub use left::Left;
pub use problem::{Kept, Options, Problem};
pub use result::{Diagnosis, Estimate, NoiseFloor, Single, Step, Verdict};
pub use spectral_line::{Line, strongest_line};
pub use unknown::{PortScore, Unknown};
