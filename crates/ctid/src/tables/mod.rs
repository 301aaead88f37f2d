//! `ctid tables`: the results of the crate `paper-tables` as text, and as files.

pub(crate) mod baysse_text;
pub(crate) mod progress;
pub(crate) mod results;
mod rig_csv;
pub(crate) mod udink_sentences;
pub(crate) mod udink_text;
