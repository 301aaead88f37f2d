//! Names and units in a header: `y [cm]`, `y (cm)` and `y_cm` are the name `y` and the unit `cm`.

/// Units that are understood after an underscore, where there is no bracket to say so.
const SUFFIXES: &[&str] = &[
    "V", "mV", "A", "mA", "m", "cm", "mm", "C", "degC", "°C", "K", "bar", "mbar", "Pa", "kPa", "%",
    "pct", "percent", "Hz", "rpm", "W", "kW",
];

/// Units that are understood after an underscore in a time's header only: `u_min` is no time.
const TIME_SUFFIXES: &[&str] = &["us", "ms", "s", "min", "h", "d"];

/// The units of time that are understood, as a message lists them.
pub(crate) const TIMES: &str = "us, ms, s, min, h and d";

/// A header's name and unit; the unit is empty where the header does not say.
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
