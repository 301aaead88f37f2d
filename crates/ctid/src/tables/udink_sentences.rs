//! Titles, sentences and numbers that the text and the page of `ctid tables udink` share.

use paper_tables::udink::{Cell, Changed, Contrast, LargerP, Study, Verdict};

use crate::numbers;

/// Title of the differences between tables.
pub(crate) const CONTRASTS: &str = "Differences between tables, run by run";

/// Meaning of the differences.
pub(crate) const CONTRASTS_MEANING: &str = "By Euler's rule. Two tables with the same noise differ by their settings alone: their cells \
     can lie inside one by one while their differences do not.";

/// Title of the runs with other settings.
pub(crate) const OTHER_SETTINGS: &str = "Changes that the comparison would not detect";

/// Title of the constant gains.
pub(crate) const CONSTANT_GAINS: &str =
    "Constant gains: that of table 4, and the diagonal one that the paper found slow";

/// Verdict on the paper's tables, cell by cell.
pub(crate) fn verdict(study: &Study) -> &'static str {
    match study.verdict() {
        Verdict::Consistent => "cell by cell statistically consistent",
        Verdict::ConsistentByEulerOnly => {
            "cell by cell statistically consistent with Euler's rule only"
        }
        Verdict::NotConsistent => "not consistent",
    }
}

/// Addition to the verdict on the cells: the differences of the two tables with the same noise.
pub(crate) fn beside_the_verdict(study: &Study) -> String {
    let sentence = |contrast: &Contrast| {
        let [first, second] = contrast.between;
        format!(
            "Tables {first} and {second} have the same noise, so their differences vary less than the cells: {} of {} are inside. The \
             assumed experiment is not the paper's in every respect.",
            contrast.inside,
            contrast.cells.len()
        )
    };
    study.contrasts.first().map(sentence).unwrap_or_default()
}

/// Number of differences inside their range, and the relation of the noises.
pub(crate) fn contrast(contrast: &Contrast) -> String {
    let [first, second] = contrast.between;
    format!(
        "{} of {} differences inside; tables {first} and {second}: {}.",
        contrast.inside,
        contrast.cells.len(),
        contrast.noise
    )
}

/// Number of other settings that the comparison cannot detect.
pub(crate) fn other_settings(changed: &[Changed]) -> String {
    let unnoticed = changed.iter().filter(|changed| !changed.noticed).count();
    format!(
        "The tables by Euler's rule with one setting changed: {unnoticed} of {} changes leave the tables \"consistent\", cell by cell. The comparison cannot exclude \
         these changes.",
        changed.len()
    )
}

/// The 5 to 95 % range, both ends with decimals according to its width: 20 to 200 units of the last digit.
pub(crate) fn range(cell: &Cell, between: &str) -> String {
    let width = cell.q95 - cell.q05;
    if !width.is_finite() {
        return "-".to_owned();
    }
    let places = (1 - numbers::exponent(0.5 * width)).max(0);
    let [low, high] = [cell.q05, cell.q95].map(|end| numbers::decimals(end, places));
    format!("{low}{between}{high}")
}

/// The factor of `P(0)` for display.
pub(crate) fn factor(row: &LargerP) -> String {
    if row.factor < 1e6 {
        format!("{}", row.factor)
    } else {
        format!("{:e}", row.factor)
    }
}
