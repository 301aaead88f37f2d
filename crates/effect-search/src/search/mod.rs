//! The search: scores of candidates, their fits, sets of several effects, and other minima of these.

pub(crate) mod factor_score;
pub(crate) mod floating;
pub(crate) mod grow;
pub(crate) mod minima;
pub(crate) mod pairs;
pub(crate) mod score;
pub(crate) mod ties;
