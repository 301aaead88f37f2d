//! Quotes text from a file in a message: shortened, and without control characters or characters that change the text direction.

use std::borrow::Cow;

/// The most characters that are quoted.
const LONGEST: usize = 60;

/// A text from a file or a stream as messages quote it: escaped as by [`escaped`], and no more than 60 characters of that.
#[must_use]
pub fn quoted(text: &str) -> String {
    let (mut quotation, mut length) = (String::new(), 0);
    for c in text.chars() {
        let shown = escaped(c.encode_utf8(&mut [0; 4])).into_owned();
        length += shown.chars().count();
        if length > LONGEST {
            return quotation + "...";
        }
        quotation += &shown;
    }
    quotation
}

/// A number in messages: as written, or with a power of ten if it has too many digits.
#[must_use]
pub fn shown(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-6..1e15).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A number rounded to remove binary rounding errors.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// A text with control characters, invisible characters and characters that change the text direction escaped as `\u{202e}`.
#[must_use]
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.contains(misleading) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if misleading(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

fn misleading(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{180b}'..='\u{180f}'
                | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{3164}'
                | '\u{fe00}'..='\u{fe0f}' | '\u{feff}' | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' | '\u{e0000}'..='\u{e0fff}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_short() {
        for (value, said) in [
            (0.1, "0.1"),
            (-154.0, "-154"),
            (0.0, "0"),
            (1e-6, "0.000001"),
            (1e15, "1e15"),
            (-1e308, "-1e308"),
            (5e-324, "5e-324"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(shown(value), said);
        }
    }

    #[test]
    fn a_quotation_is_short_and_steers_nothing() {
        assert_eq!(quoted("y [°C]"), "y [°C]");
        assert_eq!(quoted("a\u{202e}b\u{1b}[1m\t"), "a\\u{202e}b\\u{1b}[1m\\t");
        assert_eq!(
            quoted("a\u{ad}\u{e0041}\u{206a}b"),
            "a\\u{ad}\\u{e0041}\\u{206a}b"
        );
        assert_eq!(quoted(&"é".repeat(60)), "é".repeat(60));
        assert_eq!(quoted(&"é".repeat(3000)), "é".repeat(60) + "...");
        assert_eq!(quoted(&"\u{ad}".repeat(3000)), "\\u{ad}".repeat(10) + "...");
    }
}
