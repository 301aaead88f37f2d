//! Findings about an identification, and about several methods side by side.

use linear_identification::side_by_side::{SideBySide, Violation};
use linear_identification::{Identification, Method};

use super::warnings::of_warning;

/// All warnings of an identification.
#[must_use]
pub fn of_identification(found: &Identification) -> Vec<String> {
    found.warnings.iter().map(of_warning).collect()
}

/// All findings about each method with its order: why it failed, the assumptions that are violated, and warnings.
#[must_use]
pub fn of_side_by_side(found: &SideBySide) -> Vec<String> {
    let rows = found.methods.iter().flat_map(|row| {
        let name = format!("{} {}", row.method.id(), row.order);
        let outcome = row.found.iter();
        let violated = outcome.clone().flat_map(|outcome| &outcome.violated);
        let violated = violated.map(|it| format!("violated: {}", of_violation(it, row.method)));
        let warnings = outcome.flat_map(|outcome| &outcome.warnings);
        let refused = row.refused.iter();
        refused
            .map(|reason| format!("refused: {reason}"))
            .chain(violated)
            .chain(warnings.map(of_warning))
            .map(move |sentence| format!("{name}: {sentence}"))
    });
    rows.collect()
}

/// An assumption that the record violates, of a method.
#[must_use]
pub fn of_violation(violation: &Violation, method: Method) -> String {
    match violation {
        Violation::NoiseFedBack => "the controller feeds the noise back to the input".to_owned(),
        Violation::DependsOnInput { .. } => {
            "the simulation error depends on the input: the order is too low, there is a delay (srivc and rivc find one by --delay auto), or the plant is not linear"
                .to_owned()
        }
        Violation::WorseThanLeast { rmse, least } => {
            let why = match method {
                Method::CtRls | Method::Ls => "noise may bias it",
                Method::StabilizedOe | Method::RecursiveFcloe => {
                    "the plant may have changed, or the estimates have not converged"
                }
                Method::Iv | Method::Fcloe | Method::Srivc | Method::Rivc => {
                    "the plant may not be linear, or of this order"
                }
            };
            format!(
                "its error is {:.0} % above the least of this order: {why}",
                100.0 * (rmse / least - 1.0)
            )
        }
    }
}
