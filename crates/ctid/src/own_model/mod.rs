//! Users' own models: a text in a flat subset of Modelica, fitted to records and searched for missing effects.
//!
//! | question | answer |
//! |---|---|
//! | Where do I start? | [`OwnModelFile::new`] with a [`ct_model::ModelSpec`], or [`AnyModelFile::read`] with a model file |
//! | How are records put in? | [`OwnModelFile::gathered`], from what [`ct_signals::parse_csv`] has read |
//! | How far is it off? | [`FittedModel::fit`], then [`FittedModel::compare`] |
//! | On other inputs? | [`FittedModel::simulate`], [`FittedModel::score`] |
//! | What is it missing? | [`diagnose`], then [`OwnModelFile::with_effect`] |
//! | Which experiment distinguishes two effects? | [`fn@design`] |
//! | As text? | [`FittedModel::text`], [`text`](fn@text) |
//!
//! The commands of the program call these functions, so results agree to the last digit.

mod blame;
mod candidates;
mod compare;
mod control_loop;
mod controller;
mod design;
mod diagnose;
pub(crate) mod effects;
mod enclosed;
mod estimates;
mod export;
mod file;
mod fitted;
mod held_out;
mod hints;
mod identify;
pub(crate) mod ports;
mod problem;
pub(crate) mod raw_effects;
pub(crate) mod report;
mod simulate;
mod singles;
pub(crate) mod term;
mod text;
mod time_unit;
pub(crate) mod units;
mod unknown;
pub(crate) mod words;

pub use self::compare::{Comparison, Curves, compare};
pub use self::controller::OwnController;
pub use self::design::design;
pub(crate) use self::design::{
    OwnProposal, experiments, limits as design_limits, said as design_said,
    sentences as design_sentences,
};
pub use self::diagnose::diagnose;
pub(crate) use self::diagnose::{
    heading as diagnosis_heading, remaining as diagnosis_remaining, said as diagnosis_said, sizes,
};
pub use self::effects::{OwnEffects, RecordNumbers};
pub use self::export::text;
pub(crate) use self::export::{Exported, commented, export};
pub use self::file::{AnyModelFile, OwnModelFile, OwnSettings, Records};
pub(crate) use self::file::{conversion, read_model};
pub use self::fitted::{FitLimit, FittedModel, OutputScore};
pub(crate) use self::identify::{Beside, OneByOne};
pub(crate) use self::problem::options;
pub use self::report::{Document, compared as compared_page, diagnosed as diagnosed_page};
pub(crate) use self::simulate::simulate;
pub(crate) use self::text::said;
pub(crate) use self::unknown::file as unknown_file;
pub use crate::simulate::{Band, Simulated, SimulatedOutput, StateSource, TimeColumn};
