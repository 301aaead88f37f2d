//! Names and units in a header: `y [cm]`, `y (cm)` and `y_cm` are the name `y` and the unit `cm`. [`Unit`] describes what
//! a unit means and how values are converted.

mod dimension;
mod quantity;
mod table;

pub use dimension::Dimension;
pub use quantity::{Conversion, Unit};

/// Units that are understood after an underscore, without brackets. Units that are usually a part of the name are not included: `T_l`,
/// `u_in`, `q_h`, `T_rad`, `omega_N`.
const SUFFIXES: &[&str] = &[
    "V", "mV", "kV", "A", "mA", "m", "cm", "mm", "C", "degC", "°C", "degF", "°F", "K", "bar",
    "mbar", "Pa", "hPa", "kPa", "MPa", "psi", "%", "pct", "percent", "ppm", "Hz", "kHz", "rpm",
    "W", "kW", "MW", "kWh", "Nm", "kg", "deg", "ml", "mL", "litre", "litres", "liter", "liters",
    "lmin", "lpm", "gpm", "m3", "m3h",
];

/// Units that are understood after an underscore in a time's header only: `u_min` is no time.
const TIME_SUFFIXES: &[&str] = &["us", "ms", "s", "min", "h", "d"];

/// The units of time that are understood, as a message lists them.
pub(crate) const TIMES: &str = "us, ms, s, min, h and d";

/// Name and unit of a header; the unit is empty if there is none.
pub(crate) fn split(header: &str) -> (&str, &str) {
    let header = header.trim();
    if let Some(split) = split_bracket(header) {
        return split;
    }
    match header.rsplit_once('_') {
        Some((name, unit)) if !name.is_empty() && SUFFIXES.contains(&unit) => (name, unit),
        Some((name, unit)) if name.starts_with(['t', 'T']) && TIME_SUFFIXES.contains(&unit) => {
            (name, unit)
        }
        _ => (header, ""),
    }
}

/// The name and the unit of `name [unit]` or `name (unit)`.
pub(crate) fn split_bracket(header: &str) -> Option<(&str, &str)> {
    let header = header.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(inner) = header.strip_suffix(close)
            && let Some((name, unit)) = inner.rsplit_once(open)
            && !name.trim().is_empty()
        {
            return Some((name.trim(), unit.trim()));
        }
    }
    None
}

/// The conversion of values in one unit to another, by their texts; `None` if either is unknown or their dimensions differ.
pub(crate) fn conversion(from: &str, to: &str) -> Option<Conversion> {
    Unit::parse(from)?.conversion_to(&Unit::parse(to)?)
}

/// Whether two units are the same, written differently or not.
pub(crate) fn same(a: &str, b: &str) -> bool {
    canonical(a) == canonical(b)
}

fn canonical(unit: &str) -> &str {
    match unit {
        "µs" | "μs" => "us",
        "sec" | "second" | "seconds" => "s",
        "minute" | "minutes" => "min",
        "hr" | "hour" | "hours" => "h",
        "day" | "days" => "d",
        "volt" | "volts" | "Volt" | "Volts" => "V",
        "pct" | "percent" => "%",
        "degC" | "°C" | "deg C" => "C",
        other => other,
    }
}

/// Seconds in one unit of time; an absent unit is taken as seconds.
pub(crate) fn seconds(unit: &str) -> Option<f64> {
    match canonical(unit) {
        "us" => Some(1e-6),
        "ms" => Some(1e-3),
        "" | "s" => Some(1.0),
        "min" => Some(60.0),
        "h" => Some(3600.0),
        "d" => Some(86400.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_suffix_is_a_unit() {
        for unit in SUFFIXES.iter().chain(TIME_SUFFIXES) {
            assert!(Unit::parse(unit).is_some(), "{unit}");
        }
    }

    #[test]
    fn a_suffix_is_a_unit_only_where_it_is_plain() {
        for (header, name, unit) in [
            ("level_litres", "level", "litres"),
            ("q_lmin", "q", "lmin"),
            ("T_degF", "T", "degF"),
            ("q [l/min]", "q", "l/min"),
            ("T_l", "T_l", ""),
            ("u_in", "u_in", ""),
            ("T_rad", "T_rad", ""),
            ("q_min", "q_min", ""),
        ] {
            assert_eq!(split(header), (name, unit));
        }
    }

    #[test]
    fn seconds_are_those_of_the_unit() {
        for text in [
            "us", "ms", "s", "sec", "min", "minutes", "h", "hr", "hours", "d", "days",
        ] {
            let conversion = Unit::parse(text)
                .zip(Unit::parse("s"))
                .and_then(|(unit, second)| unit.conversion_to(&second));
            assert_eq!(conversion.map(|c| c.factor), seconds(text), "{text}");
        }
    }
}
