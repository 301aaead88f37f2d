//! Remarks on a fitted model that a comparison and a diagnosis share.

use crate::{Problem, Remark};

/// Remark on the standard errors of a model with a user's own terms; `None` without such terms.
pub(crate) fn of_terms(problem: &Problem) -> Option<Remark> {
    let names: Vec<_> = problem.terms.iter().map(|term| term.name.clone()).collect();
    (!names.is_empty()).then_some(Remark::Terms { names })
}
