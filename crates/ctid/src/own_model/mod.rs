//! Models of their user's own: `model = "block.mo"` in the model file instead of a plant.

mod candidates;
mod compare;
mod controller;
mod design;
mod diagnose;
pub(crate) mod effects;
mod export;
mod file;
mod identify;
pub(crate) mod ports;
mod problem;
pub(crate) mod report;
mod simulate;
mod text;
mod unknown;
pub(crate) mod words;

pub(crate) use self::compare::{Comparison, compare};
pub(crate) use self::design::{
    OwnProposal, design, experiments, limits as design_limits, said as design_said,
    sentences as design_sentences,
};
pub(crate) use self::diagnose::{
    diagnose, heading as diagnosis_heading, remaining as diagnosis_remaining,
    said as diagnosis_said, sizes,
};
pub(crate) use self::export::{Exported, commented, export, number};
pub(crate) use self::file::{AnyModelFile, OwnModelFile, Records, conversion, read_model};
pub(crate) use self::identify::{Beside, OneByOne};
pub(crate) use self::problem::{RecordNumbers, options};
pub(crate) use self::simulate::simulate;
pub(crate) use self::text::said;
pub(crate) use self::unknown::file as unknown_file;
