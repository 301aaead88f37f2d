//! A series of values of which some may be missing (NaN).

/// A series with linear interpolation, by rows, of missing samples (NaN), and constant values before the first and after the last sample;
/// unchanged if all are missing.
#[must_use]
pub fn interpolated(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    let mut from = 0;
    while let Some(gap) = values[from..].iter().position(|value| value.is_nan()) {
        let begin = from + gap;
        let end = values[begin..].iter().position(|value| !value.is_nan());
        let end = end.map_or(values.len(), |length| begin + length);
        let before = begin.checked_sub(1).map(|k| values[k]);
        let after = values.get(end).copied();
        let Some(start) = before.or(after) else {
            break;
        };
        let stop = after.unwrap_or(start);
        let steps = (end - begin + 1) as f64;
        for (i, value) in values[begin..end].iter_mut().enumerate() {
            *value = start + (stop - start) * (i + 1) as f64 / steps;
        }
        from = end;
    }
    values
}

/// Smallest and largest of some values, NaN aside; infinite, and in the wrong order, if there are none.
#[must_use]
pub fn range_of<'a>(values: impl IntoIterator<Item = &'a f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(none, |(low, high), v| (low.min(*v), high.max(*v)))
}

/// The value of a signal that is constant to a part in a billion, without missing samples.
pub(crate) fn constant(values: &[f64]) -> Option<f64> {
    let first = *values.iter().find(|value| !value.is_nan())?;
    values
        .iter()
        .all(|v| v.is_nan() || (v - first).abs() <= 1e-9 * first.abs())
        .then_some(first)
}
