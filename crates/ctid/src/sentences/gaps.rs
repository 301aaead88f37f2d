//! Missing rows, and missing samples of an input.

use ct_signals::{Gaps, duration};
use missing_effect::{LONGEST_HOLD, MendedGaps};

/// The longest hold, and its reason.
fn longest_hold_of(mended: &MendedGaps) -> String {
    let (limit, constant) = (mended.limit, mended.time_constant);
    let share = LONGEST_HOLD * constant;
    if share.is_finite() && (limit - share).abs() <= 1e-9 * share {
        format!(
            "{:.0} % of the fastest time constant ({})",
            100.0 * LONGEST_HOLD,
            duration(constant)
        )
    } else if constant.is_nan() {
        format!(
            "{}: no fastest time constant was found, which would permit a longer hold",
            duration(limit)
        )
    } else {
        duration(limit)
    }
}

/// How gaps in the records were handled; `None` without gaps.
#[must_use]
pub fn of_gaps(mended: &MendedGaps) -> Option<String> {
    let Gaps {
        rows,
        places,
        held,
        cut,
        unused,
        longest_hold,
    } = mended.gaps;
    let count = |count: usize, one: &str, several: &str| match count {
        1 => format!("1 {one}"),
        count => format!("{count} {several}"),
    };
    if places == 0 {
        return (unused > 0).then(|| {
            format!(
                "{} not used: an input is not known there.",
                count(unused, "row is", "rows are")
            )
        });
    }
    let mut text = match rows {
        0 => format!(
            "Samples of an input are missing in {}",
            count(places, "place", "places")
        ),
        rows => format!(
            "{} missing in {}",
            count(rows, "row is", "rows are"),
            count(places, "place", "places")
        ),
    };
    if held > 0 {
        text += &format!(
            "; the input is held through {held} of them, for at most {}",
            duration(longest_hold)
        );
    }
    if cut > 0 {
        text += &format!(
            "; the simulation restarts after {cut}, where the input would have to be held longer than {}",
            longest_hold_of(mended)
        );
    }
    if unused > 0 {
        text += &format!("; {} not used", count(unused, "row is", "rows are"));
    }
    Some(text + ".")
}
