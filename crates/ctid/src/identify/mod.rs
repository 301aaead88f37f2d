//! `ctid identify`: the results of the crate `linear-identification` as text.

pub mod side_by_side_text;
pub mod text;
