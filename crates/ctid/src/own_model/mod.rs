//! Models of their user's own: `model = "block.mo"` in the model file instead of a plant.

mod candidates;
mod compare;
mod file;
pub(crate) mod ports;
mod text;

pub(crate) use self::compare::{Comparison, compare};
pub(crate) use self::file::{AnyModelFile, OwnModelFile, Records, conversion, read_model};
pub(crate) use self::text::said;
