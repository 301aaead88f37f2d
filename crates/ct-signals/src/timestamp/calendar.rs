//! Days of the Gregorian calendar, counted from 1970-01-01.

/// Days of a common year before the first of each month.
const DAYS_BEFORE: [i64; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];

/// Days in each month of a common year.
const LENGTH: [u32; 12] = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];

/// Days from 1970-01-01 to a date of the years 1 to 9999; `None` where there is no such date.
pub(super) fn days(year: u32, month: u32, day: u32) -> Option<i64> {
    if !(1..=9999).contains(&year) {
        return None;
    }
    let index = (month as usize).checked_sub(1)?;
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let length = LENGTH.get(index)? + u32::from(leap && month == 2);
    if !(1..=length).contains(&day) {
        return None;
    }
    let year = i64::from(year);
    let this_year = DAYS_BEFORE[index] + i64::from(leap && month > 2) + i64::from(day) - 1;
    Some(365 * (year - 1970) + leap_days_before(year) - leap_days_before(1970) + this_year)
}

/// The number of leap years from year 1 to the year before this one.
fn leap_days_before(year: i64) -> i64 {
    let whole = year - 1;
    whole / 4 - whole / 100 + whole / 400
}

#[cfg(test)]
mod tests {
    use super::days;
    use jiff::civil::Date;

    #[test]
    fn days_are_those_of_the_calendar() {
        assert_eq!(days(1970, 1, 1), Some(0));
        assert_eq!(days(2000, 2, 29), Some(11_016));
        let mut expected = days(1, 1, 1);
        let mut date = Date::new(1, 1, 1).unwrap();
        while date < Date::MAX {
            let (year, month, day) = (date.year(), date.month(), date.day());
            assert_eq!(days(year as u32, month as u32, day as u32), expected);
            expected = expected.map(|count| count + 1);
            date = date.tomorrow().unwrap();
        }
    }

    #[test]
    fn a_date_that_is_not_in_the_calendar_is_none() {
        for (year, month, day) in [
            (0, 1, 1),
            (2026, 0, 1),
            (2026, 13, 1),
            (2026, 1, 0),
            (2026, 1, 32),
            (2026, 2, 29),
            (1900, 2, 29),
            (10_000, 1, 1),
        ] {
            assert_eq!(days(year, month, day), None, "{year}-{month}-{day}");
        }
    }
}
