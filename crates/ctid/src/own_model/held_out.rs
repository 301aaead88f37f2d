//! Effects with which the error on held-out records rises.

use effect_search::Step;

use super::file::OwnModelFile;
use super::words::shown_unit;
use crate::numbers::significant;
use crate::sentences::with_unit;

/// Ratio of the held-out errors above which an effect is reported; of several outputs the geometric mean of their ratios. Chosen.
const RISES: f64 = 1.05;

/// A sentence for each effect that raises the held-out error: it improves the fitted records alone.
pub(super) fn rises(file: &OwnModelFile, steps: &[Step]) -> Vec<String> {
    let pairs = steps.windows(2);
    pairs
        .filter_map(|pair| rise(file, &pair[0], &pair[1]))
        .collect()
}

/// Whether the error on held-out records is larger with all effects than without them.
pub(super) fn error_rises(steps: &[Step]) -> bool {
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
        return false;
    };
    errors(first, last).is_some_and(|both| ratio(&both) > RISES)
}

/// The held-out error of each output before and after a change of the model.
fn errors<'a>(before: &'a Step, after: &Step) -> Option<Vec<(&'a String, f64, f64)>> {
    let (old, new) = (
        before.rmse_test_per_output.as_ref()?,
        after.rmse_test_per_output.as_ref()?,
    );
    let both = old.iter();
    Some(
        both.filter_map(|(name, old)| Some((name, *old, *new.get(name)?)))
            .collect(),
    )
}

/// Geometric mean of the ratios of the errors.
fn ratio(both: &[(&String, f64, f64)]) -> f64 {
    let logs: f64 = both.iter().map(|(_, old, new)| (new / old).ln()).sum();
    (logs / both.len() as f64).exp()
}

fn rise(file: &OwnModelFile, before: &Step, after: &Step) -> Option<String> {
    let added = after.added.as_ref()?;
    let both = errors(before, after)?;
    let ratio = ratio(&both);
    if ratio.is_nan() || ratio <= RISES {
        return None;
    }
    let errors = both.iter().map(|(name, old, new)| {
        let to = with_unit(&significant(*new, 3), shown_unit(file.unit_of(name)));
        format!("{name} from {} to {to}", significant(*old, 3))
    });
    let errors: Vec<String> = errors.collect();
    Some(format!(
        "With {added} the error on the held-out records rises ({}): keep it only if another record confirms it.",
        errors.join(", ")
    ))
}
