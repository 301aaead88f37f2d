//! Numbers for display: with the significant digits, and columns of them.

pub use ct_signals::duration;

/// A number with this many significant digits, `-` if there is none.
#[must_use]
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return match value {
            f64::INFINITY => "infinite".to_string(),
            _ => "-".to_string(),
        };
    }
    let exponent = exponent(value);
    if (-4..6).contains(&exponent) {
        decimals(value, digits - 1 - exponent)
    } else {
        let places = usize::try_from(digits - 1).unwrap_or(0);
        format!("{value:.places$e}")
    }
}

/// A value and its standard error, both to the second digit of the error. `None` for the error
/// where the data do not give one.
#[must_use]
pub fn value_and_error(value: f64, std_error: Option<f64>) -> (String, Option<String>) {
    let Some(error) = std_error.filter(|error| error.is_finite() && *error > 0.0) else {
        return (significant(value, 4), None);
    };
    if !value.is_finite() {
        return (significant(value, 4), None);
    }
    let (largest, last) = (exponent(value.abs().max(error)), exponent(error) - 1);
    if largest < 6 && last > -7 {
        (decimals(value, -last), Some(decimals(error, -last)))
    } else {
        // Numbers that are readable only as powers of ten: they have too many digits, or are too large.
        (
            significant(value, (largest - last + 1).min(8)),
            Some(significant(error, 2)),
        )
    }
}

/// A value and its standard error in one text, `21.30 ± 0.12`; the value alone without an error.
#[must_use]
pub fn with_error(value: f64, std_error: Option<f64>) -> String {
    match value_and_error(value, std_error) {
        (value, Some(error)) => format!("{value} ± {error}"),
        (value, None) => value,
    }
}

/// A whole number, `-` if there is none.
#[must_use]
pub fn whole(value: f64) -> String {
    if value.is_finite() {
        decimals(value, 0)
    } else {
        significant(value, 1)
    }
}

/// Numbers of a column: all with the number of decimals that gives the smallest one two significant digits; `-` if there is none.
#[must_use]
pub fn column(values: &[Option<f64>]) -> Vec<String> {
    let finite = || values.iter().flatten().filter(|value| value.is_finite());
    let places = finite()
        .filter(|value| **value != 0.0)
        .map(|&value| 1 - exponent(value))
        .max()
        .unwrap_or(0)
        .max(0);
    let too_wide = finite().any(|&value| exponent(value) > 7) || places > 6;
    values
        .iter()
        .map(|value| match value {
            Some(value) if value.is_finite() && !too_wide => decimals(*value, places),
            Some(value) => significant(*value, 3),
            None => "-".to_string(),
        })
        .collect()
}

/// The power of ten of the first digit.
#[must_use]
pub fn exponent(value: f64) -> i32 {
    if value == 0.0 {
        return 0;
    }
    // The printed form is exact: log10 would make 0.001 a power of -2.99.
    format!("{:e}", value.abs())
        .split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0)
}

/// Fixed decimals; negative `places` round to tens, hundreds, ...
#[must_use]
pub fn decimals(value: f64, places: i32) -> String {
    let text = match usize::try_from(places) {
        Ok(places) => format!("{value:.places$}"),
        Err(_) => {
            let step = 10f64.powi(-places);
            format!("{:.0}", (value / step).round() * step)
        }
    };
    // No minus sign before a number that is rounded to zero.
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_string(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_sensible() {
        assert_eq!(significant(0.666_66, 3), "0.667");
        assert_eq!(significant(123_456.0, 3), "123000");
        assert_eq!(significant(-0.5, 2), "-0.50");
        assert_eq!(significant(1.5e-7, 2), "1.5e-7");
        assert_eq!(significant(2.0e9, 2), "2.0e9");
        assert_eq!(significant(0.0, 1), "0");
        assert_eq!(significant(-0.0, 1), "0");
        assert_eq!(significant(f64::NAN, 3), "-");
        assert_eq!(significant(f64::INFINITY, 3), "infinite");
    }

    #[test]
    fn a_value_stops_where_its_error_starts() {
        let text = |value, error| with_error(value, Some(error));
        assert_eq!(text(11.023_456, 0.012_3), "11.023 ± 0.012");
        assert_eq!(text(47_012.0, 1_187.0), "47000 ± 1200");
        assert_eq!(text(0.0, 0.1), "0.00 ± 0.10");
        assert_eq!(text(-0.001, 0.1), "0.00 ± 0.10");
        assert_eq!(text(1.234e-8, 2.1e-10), "1.234e-8 ± 2.1e-10");
        assert_eq!(text(1.234e8, 2.1e6), "1.234e8 ± 2.1e6");
        assert_eq!(value_and_error(3.0, None), ("3.000".to_string(), None));
        assert_eq!(text(3.0, f64::NAN), "3.000");
        assert_eq!(text(f64::NAN, 1.0), "-");
        assert_eq!(
            (whole(-6.7), whole(-0.2), whole(f64::NAN)),
            ("-7".into(), "0".into(), "-".into())
        );
    }

    #[test]
    fn a_column_has_one_number_of_decimals() {
        let column =
            |values: &[f64]| super::column(&values.iter().copied().map(Some).collect::<Vec<_>>());
        assert_eq!(column(&[0.6712, 0.0512]), ["0.671", "0.051"]);
        assert_eq!(column(&[12.0, 1893.4]), ["12", "1893"]);
        assert_eq!(column(&[1e-9, 1.0]), ["1.00e-9", "1.00"]);
        assert_eq!(super::column(&[None, Some(0.5)]), ["-", "0.50"]);
        assert_eq!(column(&[0.0, f64::NAN]), ["0", "-"]);
    }
}
