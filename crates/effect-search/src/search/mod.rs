//! The search: scores of candidates, their fits, and sets of several effects.

pub(crate) mod factor_score;
pub(crate) mod floating;
pub(crate) mod grow;
pub(crate) mod minima;
pub(crate) mod pairs;
pub(crate) mod score;
pub(crate) mod ties;
