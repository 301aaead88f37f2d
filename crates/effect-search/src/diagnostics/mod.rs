//! Where the error is, the shape of what no candidate explains, and what the data could show.

pub(crate) mod detectable;
pub mod failures;
pub(crate) mod unknown;
