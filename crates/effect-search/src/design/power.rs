//! Expected result of an experiment, from the separation of two models.

use std::cmp::Ordering;

use statrs::distribution::{ContinuousCDF, Normal};

use serde::Serialize;

use crate::thresholds::Thresholds;

/// How well an experiment distinguishes two effects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Power {
    /// The smaller of the two below.
    pub power: f64,
    /// Expected excess of the deviance of the wrong model over the true one, if the first is true and if the second is true.
    pub if_true: [f64; 2],
    /// Probability that all records together then decide for the true one, by more than 6 in the criterion; the smaller of the two.
    pub decides: f64,
}

/// Expected result of an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prospect {
    /// The experiment will very probably decide.
    Decides,
    /// The experiment may decide.
    May,
    /// The experiment will probably not decide, within these limits.
    Hardly,
    /// The two give the same response in every experiment that was tried.
    Twins,
}

/// A higher power has no further use: the decision is certain even if the effect is half as large as estimated.
pub const SUFFICIENT_POWER: f64 = 200.0;
/// The criterion decides if the difference exceeds this.
const BIC_MARGIN: f64 = Thresholds::DEFAULT.bic_margin;
/// Excursions with a smaller difference are equal.
const SAME_EXCURSION: f64 = 0.1;
/// Probability from which a decision is nearly certain, ...
const NEARLY_CERTAIN: f64 = 0.9;
/// ... and from which it is likely.
const LIKELY: f64 = 0.5;
/// Noncentrality below which two models give the same response.
const SAME_RESPONSE: f64 = 1.0;
/// The 0.95 quantile of the normal distribution: a longer experiment is to decide with this probability.
const QUANTILE: f64 = 1.645;

/// The probability that the criterion of the false one ends above that of the true one by more than 6: their
/// difference, `ahead` before, is normal with mean `ahead + lambda` and variance `4 lambda`.
fn decides(lambda: f64, ahead: f64) -> f64 {
    let margin = lambda + ahead - BIC_MARGIN;
    if lambda <= 0.0 {
        return if margin > 0.0 { 1.0 } else { 0.0 };
    }
    Normal::standard().cdf(margin / (2.0 * lambda.sqrt()))
}

/// Power from the noncentralities, if the first and if the second is true, and from the present advantage of each.
#[must_use]
pub fn power(if_true: [f64; 2], ahead: [f64; 2]) -> Power {
    let [a, b] = if_true;
    Power {
        power: a.min(b),
        if_true,
        decides: decides(a, ahead[0]).min(decides(b, ahead[1])),
    }
}

/// Expected result for a power.
#[must_use]
pub fn prospect(power: &Power) -> Prospect {
    if power.power < SAME_RESPONSE {
        Prospect::Twins
    } else if power.decides >= NEARLY_CERTAIN {
        Prospect::Decides
    } else if power.decides >= LIKELY {
        Prospect::May
    } else {
        Prospect::Hardly
    }
}

/// Number of repetitions after which the experiment decides with a probability of 0.95, if the noncentrality is proportional to the length.
///
/// `lambda + ahead - 6 = 1.645 x 2 sqrt(lambda)`, solved for the root of `lambda`.
#[must_use]
pub fn times_as_long(power: &Power, ahead: [f64; 2]) -> Option<f64> {
    if prospect(power) == Prospect::Decides || prospect(power) == Prospect::Twins {
        return None;
    }
    let needed = |ahead: f64| {
        let root = QUANTILE + (QUANTILE * QUANTILE + (BIC_MARGIN - ahead)).max(0.0).sqrt();
        root * root
    };
    let times = |i: usize| needed(ahead[i]) / power.if_true[i];
    Some(times(0).max(times(1))).filter(|times| times.is_finite() && *times > 1.0)
}

/// Order of two experiments, the better one first: by power up to a sufficient value, then by excursion, then by power. The numbers are the
/// excursions outside the range of the records, as a share of that range.
#[must_use]
pub fn by_use((a, out_a): (&Power, f64), (b, out_b): (&Power, f64)) -> Ordering {
    let useful = |power: &Power| power.power.min(SUFFICIENT_POWER);
    let excursion = |out: f64| (out / SAME_EXCURSION).floor();
    useful(b)
        .total_cmp(&useful(a))
        .then(excursion(out_a).total_cmp(&excursion(out_b)))
        .then(b.power.total_cmp(&a.power))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_follow_the_noncentrality() {
        // Mean 6 + 2, deviation 4: more than 6 in 0.6915 of the cases.
        let found = power([4.0, 9.0], [4.0, 4.0]);
        assert_eq!(found.power, 4.0);
        assert!((found.decides - Normal::standard().cdf(0.5)).abs() < 1e-12);
        assert_eq!(power([0.0, 0.0], [0.0, 0.0]).decides, 0.0);
        assert_eq!(prospect(&power([0.1, 50.0], [0.0, 0.0])), Prospect::Twins);
        assert_eq!(
            prospect(&power([50.0, 60.0], [0.0, 0.0])),
            Prospect::Decides
        );
        assert_eq!(prospect(&power([3.0, 60.0], [0.0, 0.0])), Prospect::Hardly);
    }

    #[test]
    fn so_many_times_as_long_decides() {
        let ahead = [1.0, -1.0];
        let found = power([3.0, 5.0], ahead);
        let times = times_as_long(&found, ahead).unwrap();
        let longer = power(found.if_true.map(|lambda| times * lambda), ahead);
        assert!((longer.decides - 0.95).abs() < 1e-3, "{}", longer.decides);
    }
}
