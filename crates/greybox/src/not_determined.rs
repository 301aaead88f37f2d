//! The parameters that records do not determine.

use crate::{Fit, ModelSetup};

/// Two estimates with a correlation above this are determined only in combination.
const TOGETHER: f64 = 0.999;

/// An estimate whose standard error is below this share of it is determined.
const DETERMINED: f64 = 0.1;

/// Names of the fitted entries that the records do not determine: one alone that has no effect on the readings, those of a combination that
/// has none, and pairs of which only a combination is determined well, unless both standard errors are small beside the estimates.
#[must_use]
pub fn not_determined(setup: &ModelSetup, fit: &Fit) -> Vec<Vec<String>> {
    let (names, free) = (setup.names(), setup.free());
    let silent = (0..free.len())
        .filter(|&column| fit.triangle.column_norm(column) <= f64::MIN_POSITIVE)
        .map(|column| vec![names[free[column]].clone()]);
    let mut found: Vec<Vec<String>> = silent.collect();
    let of = |group: Vec<usize>| group.iter().map(|&i| names[i].clone()).collect();
    found.extend(fit.undetermined().into_iter().map(of));
    let errors = fit.std_errors();
    let is_open = |i: usize| errors[i].is_none_or(|error| error > DETERMINED * fit.x[i].abs());
    if let Some((entries, matrix)) = fit.correlations() {
        for (i, row) in matrix.iter().enumerate() {
            let together = (0..i).filter(|&j| {
                row[j].abs() > TOGETHER && (is_open(entries[i]) || is_open(entries[j]))
            });
            found.extend(
                together.map(|j| vec![names[entries[j]].clone(), names[entries[i]].clone()]),
            );
        }
    }
    found
}
