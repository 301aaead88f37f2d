//! Relations of candidates: to each other, and to the parameters of the model.

use serde::{Deserialize, Serialize};

/// The first candidate with a sensitivity that is collinear with that of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tie {
    /// Its position; that of the candidate itself if there is none.
    pub first: usize,
    /// Change of the candidate's size that has the influence of a unit change of the first one's.
    pub scale: f64,
}

/// A candidate of the model file that changes the outputs only as the model's own parameters do: its term is in the model already.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Absorbed {
    /// The candidate.
    pub effect: String,
    /// The parameter that alone has the same influence; `None` if only several together have it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
}
