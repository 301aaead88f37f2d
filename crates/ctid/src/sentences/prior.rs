//! The prior of a parameter.

use missing_effect::Parameter;
use missing_effect::numbers::value_and_error;

/// The records disagree with a prior if their distance exceeds this number of standard errors of both together.
const DISAGREES: f64 = 3.0;

/// The prior of a parameter, and its distance from the estimate if the two disagree; `None` without a prior.
#[must_use]
pub fn of_prior(parameter: &Parameter) -> Option<String> {
    let prior = parameter.prior?;
    let (value, error) = value_and_error(prior.value, Some(prior.std_error));
    let mut words = format!("prior {value} ± {}", error.unwrap_or_default());
    let distance = parameter.prior_distance();
    if let Some(away) = distance.filter(|away| *away > DISAGREES) {
        words += &format!("; the records disagree with it by {away:.1} standard errors");
    }
    Some(words)
}
