//! Words and numbers in HTML: escaping, typographic signs, units, p-values in words.

use crate::numbers::{self, exponent};

/// Escapes text for HTML, inside elements and inside quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(c),
        }
    }
    escaped
}

/// A sentence as HTML: text between back quotes is a command.
pub(super) fn prose(text: &str) -> String {
    let escaped = escape(text);
    let parts: Vec<&str> = escaped.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return escaped;
    }
    let part = |(k, part): (usize, &&str)| match k % 2 {
        0 => (*part).to_owned(),
        _ => format!("<code>{part}</code>"),
    };
    parts.iter().enumerate().map(part).collect()
}

/// An effect or a parameter as HTML; a long name may break after a word, not within one.
pub(super) fn code(name: &str) -> String {
    let name = escape(name)
        .replace('_', "_<wbr>")
        .replace('.', ".<wbr>")
        .replace('(', "<wbr>(");
    format!("<code>{name}</code>")
}

/// A unit as HTML: `cm^2.5/s` with a raised exponent.
pub(super) fn unit(unit: &str) -> String {
    let mut html = String::new();
    let mut rest = unit;
    while let Some((before, after)) = rest.split_once('^') {
        let end = after
            .find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
            .unwrap_or(after.len());
        html.push_str(&escape(before));
        html.push_str("<sup>");
        html.push_str(&escape(&after[..end]));
        html.push_str("</sup>");
        rest = &after[end..];
    }
    html.push_str(&escape(rest));
    html
}

/// A number with this many significant digits; a dash if there is none.
pub(super) fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent(value);
    if (-4..6).contains(&exponent) {
        decimals(value, digits - 1 - exponent)
    } else {
        format!(
            "{}×10{}",
            decimals(value / 10f64.powi(exponent), digits - 1),
            raised(exponent)
        )
    }
}

/// `value ± standard error`, both to the second digit of the standard error.
pub(super) fn with_error(value: f64, std_error: Option<f64>) -> String {
    let Some(error) = std_error.filter(|e| e.is_finite() && *e > 0.0) else {
        return significant(value, 4);
    };
    if !value.is_finite() {
        return "–".to_owned();
    }
    let largest = exponent(value.abs().max(error));
    let places = 1 - exponent(error);
    if (-3..6).contains(&largest) {
        format!("{} ± {}", decimals(value, places), decimals(error, places))
    } else {
        let scale = 10f64.powi(largest);
        format!(
            "({} ± {})×10{}",
            decimals(value / scale, places + largest),
            decimals(error / scale, places + largest),
            raised(largest)
        )
    }
}

/// Result of the Ljung-Box test.
pub(super) fn whiteness(p: f64) -> String {
    let finding = match p {
        p if !p.is_finite() => return "The whiteness of the residual was not tested.".to_owned(),
        p if p >= 0.05 => "The residual cannot be distinguished from white noise",
        p if p >= 0.01 => "It is doubtful whether the residual is white noise",
        _ => "The residual is not white noise: its samples are correlated",
    };
    format!("{finding} (Ljung-Box test, {}).", p_value(p))
}

/// Result of the cross-correlation test with the input.
pub(super) fn input_test(p: f64) -> String {
    let finding = match p {
        p if !p.is_finite() => return "Residual against input was not tested.".to_owned(),
        p if p >= 0.05 => "The residual does not depend significantly on the input",
        p if p >= 0.01 => "It is doubtful whether the residual depends on the input",
        _ => "The residual depends on the input: the model lacks part of its effect",
    };
    format!("{finding} (cross-correlation test, {}).", p_value(p))
}

/// `p = 0.032`, or `p < 0.001`.
fn p_value(p: f64) -> String {
    if p < 0.001 {
        "p < 0.001".to_owned()
    } else {
        format!("p = {}", significant(p, 2))
    }
}

/// Fixed decimals with a typographic minus sign.
fn decimals(value: f64, places: i32) -> String {
    numbers::decimals(value, places).replace('-', "−")
}

/// An exponent in raised digits.
fn raised(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            escape("<b a=\"1\" c='2'>&"),
            "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;"
        );
    }

    #[test]
    fn commands_in_a_sentence_look_like_it() {
        assert_eq!(
            prose("run `ctid add X`, or `<b>`"),
            "run <code>ctid add X</code>, or <code>&lt;b&gt;</code>"
        );
        assert_eq!(prose("a ` alone"), "a ` alone");
    }

    #[test]
    fn names_break_between_words() {
        assert_eq!(
            code("pump_lag.T(0)"),
            "<code>pump_<wbr>lag.<wbr>T<wbr>(0)</code>"
        );
        assert_eq!(code("<i>"), "<code>&lt;i&gt;</code>");
    }

    #[test]
    fn exponents_of_units_are_raised() {
        assert_eq!(unit("cm^2.5/s"), "cm<sup>2.5</sup>/s");
        assert_eq!(unit("m^-1"), "m<sup>-1</sup>");
        assert_eq!(unit("<i>"), "&lt;i&gt;");
        assert_eq!(unit("a^b"), "a<sup></sup>b");
    }

    #[test]
    fn numbers_have_sensible_digits() {
        assert_eq!(significant(0.666_66, 3), "0.667");
        assert_eq!(significant(123_456.0, 3), "123000");
        assert_eq!(significant(-0.5, 2), "−0.50");
        assert_eq!(significant(1.5e-7, 2), "1.5×10⁻⁷");
        assert_eq!(significant(f64::NAN, 3), "–");
        assert_eq!(significant(0.0, 3), "0");
    }

    #[test]
    fn a_value_stops_where_its_error_starts() {
        assert_eq!(with_error(8.123_456, Some(0.012_3)), "8.123 ± 0.012");
        assert_eq!(with_error(47_012.0, Some(1_187.0)), "47000 ± 1200");
        assert_eq!(with_error(1.234e-6, Some(2.1e-8)), "(1.234 ± 0.021)×10⁻⁶");
        assert_eq!(with_error(0.0, Some(0.1)), "0.00 ± 0.10");
        assert_eq!(with_error(3.0, None), "3.000");
        assert_eq!(with_error(3.0, Some(f64::NAN)), "3.000");
    }

    #[test]
    fn p_values_are_said_in_words() {
        assert!(whiteness(0.4).contains("cannot be distinguished from white noise"));
        assert!(whiteness(0.0).contains("p < 0.001"));
        assert!(input_test(0.02).contains("doubtful"));
        assert!(input_test(f64::NAN).contains("not tested"));
    }
}
