//! Numbers that may not be finite, for `serde`: JSON has `null` for them, or omits them.

use serde::{Deserialize, Deserializer};

/// Whether the number is missing.
#[must_use]
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
pub fn none(value: &f64) -> bool {
    value.is_nan()
}

/// Reads a number that may not be finite, which JSON writes as `null`.
///
/// # Errors
/// Where there is neither a number nor `null`.
pub fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// Reads several numbers, some of them missing.
///
/// # Errors
/// Where an entry is neither a number nor `null`.
pub fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let all = Vec::<Option<f64>>::deserialize(from)?;
    Ok(all.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

/// No number.
#[must_use]
pub fn no_number() -> f64 {
    f64::NAN
}
