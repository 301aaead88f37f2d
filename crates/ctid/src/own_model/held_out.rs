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

fn rise(file: &OwnModelFile, before: &Step, after: &Step) -> Option<String> {
    let added = after.added.as_ref()?;
    let (old, new) = (
        before.rmse_test_per_output.as_ref()?,
        after.rmse_test_per_output.as_ref()?,
    );
    let both: Vec<(&String, f64, f64)> = old
        .iter()
        .filter_map(|(name, old)| Some((name, *old, *new.get(name)?)))
        .collect();
    let logs: f64 = both.iter().map(|(_, old, new)| (new / old).ln()).sum();
    let ratio = (logs / both.len() as f64).exp();
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
