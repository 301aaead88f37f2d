//! The units that are known, and the SI prefixes.

use std::f64::consts::PI;

use super::dimension::Dimension;

/// A unit with a symbol.
pub(super) struct Symbol {
    /// Spellings. Words of four letters and more are also understood in capitals.
    names: &'static [&'static str],
    /// Whether a prefix such as `m` or `k` is allowed.
    prefixed: bool,
    /// Powers of metre, kilogram, second, ampere, kelvin and mole.
    powers: [i8; 6],
    /// Power of the angle, and whether the angle is given in turns.
    angle: (i8, bool),
    /// The size in SI units and turns, as a fraction: that of whole numbers has no rounding in it.
    size: (f64, f64),
    /// The zero of its scale in SI units, as a fraction; for temperatures.
    zero: (f64, f64),
}

/// A symbol that was found: a prefix's fraction times the unit's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Base {
    pub dimension: Dimension,
    pub angle: i8,
    pub turns: bool,
    pub size: (f64, f64),
    pub zero: (f64, f64),
}

const NONE: [i8; 6] = [0; 6];
const LENGTH: [i8; 6] = [1, 0, 0, 0, 0, 0];
const VOLUME: [i8; 6] = [3, 0, 0, 0, 0, 0];
const MASS: [i8; 6] = [0, 1, 0, 0, 0, 0];
const TIME: [i8; 6] = [0, 0, 1, 0, 0, 0];
const RATE: [i8; 6] = [0, 0, -1, 0, 0, 0];
const FLOW: [i8; 6] = [3, 0, -1, 0, 0, 0];
const FORCE: [i8; 6] = [1, 1, -2, 0, 0, 0];
const PRESSURE: [i8; 6] = [-1, 1, -2, 0, 0, 0];
const ENERGY: [i8; 6] = [2, 1, -2, 0, 0, 0];
const POWER: [i8; 6] = [2, 1, -3, 0, 0, 0];
const TEMPERATURE: [i8; 6] = [0, 0, 0, 0, 1, 0];

const fn symbol(
    names: &'static [&'static str],
    prefixed: bool,
    powers: [i8; 6],
    numerator: f64,
    denominator: f64,
) -> Symbol {
    Symbol {
        names,
        prefixed,
        powers,
        angle: (0, false),
        size: (numerator, denominator),
        zero: (0.0, 1.0),
    }
}

const fn angular(
    names: &'static [&'static str],
    powers: [i8; 6],
    turns: bool,
    numerator: f64,
    denominator: f64,
) -> Symbol {
    Symbol {
        angle: (1, turns),
        ..symbol(names, turns, powers, numerator, denominator)
    }
}

const fn scale(names: &'static [&'static str], size: (f64, f64), zero: (f64, f64)) -> Symbol {
    Symbol {
        zero,
        ..symbol(names, false, TEMPERATURE, size.0, size.1)
    }
}

/// US gallons; cubic inches of 0.0254 m are 231 to the gallon.
const GALLON: (f64, f64) = (3.785_411_784, 1000.0);

#[rustfmt::skip]
const SYMBOLS: &[Symbol] = &[
    symbol(&["%", "pct", "percent"], false, NONE, 1.0, 100.0),
    symbol(&["‰"], false, NONE, 1.0, 1e3),
    symbol(&["ppm"], false, NONE, 1.0, 1e6),

    symbol(&["m", "metre", "metres", "meter", "meters"], true, LENGTH, 1.0, 1.0),
    symbol(&["in", "inch", "inches"], false, LENGTH, 254.0, 1e4),
    symbol(&["ft", "foot", "feet"], false, LENGTH, 3048.0, 1e4),
    symbol(&["ha"], false, [2, 0, 0, 0, 0, 0], 1e4, 1.0),
    symbol(&["l", "L", "ℓ", "litre", "litres", "liter", "liters"], true, VOLUME, 1.0, 1e3),
    symbol(&["cc", "ccm"], false, VOLUME, 1.0, 1e6),
    symbol(&["gal", "gallon", "gallons"], false, VOLUME, GALLON.0, GALLON.1),

    symbol(&["s", "sec", "second", "seconds"], true, TIME, 1.0, 1.0),
    symbol(&["min", "minute", "minutes"], false, TIME, 60.0, 1.0),
    symbol(&["h", "hr", "hour", "hours"], false, TIME, 3600.0, 1.0),
    symbol(&["d", "day", "days"], false, TIME, 86_400.0, 1.0),

    symbol(&["lmin", "lpm"], false, FLOW, 1.0, 60e3),
    symbol(&["m3h"], false, FLOW, 1.0, 3600.0),
    symbol(&["gpm"], false, FLOW, GALLON.0, 60.0 * GALLON.1),

    symbol(&["g", "gram", "grams"], true, MASS, 1.0, 1e3),
    symbol(&["t", "tonne", "tonnes"], false, MASS, 1e3, 1.0),
    symbol(&["lb", "lbs"], false, MASS, 45_359_237.0, 1e8),
    symbol(&["N", "newton", "newtons"], true, FORCE, 1.0, 1.0),
    symbol(&["Nm"], true, ENERGY, 1.0, 1.0),
    symbol(&["J", "joule", "joules"], true, ENERGY, 1.0, 1.0),
    symbol(&["Wh"], true, ENERGY, 3600.0, 1.0),
    symbol(&["W", "watt", "watts"], true, POWER, 1.0, 1.0),
    symbol(&["VA"], true, POWER, 1.0, 1.0),

    symbol(&["Pa", "pascal"], true, PRESSURE, 1.0, 1.0),
    symbol(&["bar"], true, PRESSURE, 1e5, 1.0),
    symbol(&["atm"], false, PRESSURE, 101_325.0, 1.0),
    symbol(&["psi"], false, PRESSURE, 45_359_237.0 * 980_665.0, 64_516.0 * 1e5),

    symbol(&["A", "amp", "amps", "ampere", "amperes"], true, [0, 0, 0, 1, 0, 0], 1.0, 1.0),
    symbol(&["Ah"], true, [0, 0, 1, 1, 0, 0], 3600.0, 1.0),
    symbol(&["V", "volt", "volts"], true, [2, 1, -3, -1, 0, 0], 1.0, 1.0),
    symbol(&["\u{3a9}", "\u{2126}", "ohm", "Ohm", "ohms"], true, [2, 1, -3, -2, 0, 0], 1.0, 1.0),

    symbol(&["K", "kelvin"], true, TEMPERATURE, 1.0, 1.0),
    scale(&["C", "degC", "°C", "℃", "celsius"], (1.0, 1.0), (27_315.0, 100.0)),
    scale(&["F", "degF", "°F", "℉", "fahrenheit"], (5.0, 9.0), (45_967.0 * 5.0, 900.0)),

    symbol(&["mol", "mole", "moles"], true, [0, 0, 0, 0, 0, 1], 1.0, 1.0),

    angular(&["rad", "radian", "radians"], NONE, false, 1.0, 2.0 * PI),
    angular(&["mrad"], NONE, false, 1.0, 2e3 * PI),
    angular(&["deg", "°", "degree", "degrees"], NONE, false, 1.0, 360.0),
    angular(&["rev", "turn", "turns"], NONE, true, 1.0, 1.0),
    angular(&["rpm"], RATE, true, 1.0, 60.0),
    angular(&["Hz", "hertz"], RATE, true, 1.0, 1.0),
];

/// The prefixes as they are written, and their sizes.
const PREFIXES: &[(&str, (f64, f64))] = &[
    ("n", (1.0, 1e9)),
    ("u", (1.0, 1e6)),
    ("\u{b5}", (1.0, 1e6)),
    ("\u{3bc}", (1.0, 1e6)),
    ("m", (1.0, 1e3)),
    ("c", (1.0, 100.0)),
    ("d", (1.0, 10.0)),
    ("h", (100.0, 1.0)),
    ("k", (1e3, 1.0)),
    ("M", (1e6, 1.0)),
    ("G", (1e9, 1.0)),
];

/// The unit of a symbol, with or without a prefix.
pub(super) fn find(name: &str) -> Option<Base> {
    // Units without a prefix first: min is a minute, not a milli-inch.
    if let Some(symbol) = SYMBOLS.iter().find(|symbol| symbol.is(name)) {
        return Some(symbol.base((1.0, 1.0)));
    }
    PREFIXES.iter().find_map(|&(prefix, size)| {
        let name = name.strip_prefix(prefix)?;
        let symbol = SYMBOLS
            .iter()
            .find(|symbol| symbol.prefixed && symbol.is(name))?;
        Some(symbol.base(size))
    })
}

impl Symbol {
    fn is(&self, name: &str) -> bool {
        let word = name.len() >= 4 && name.bytes().all(|byte| byte.is_ascii_alphabetic());
        self.names
            .iter()
            .any(|own| *own == name || word && own.len() >= 4 && own.eq_ignore_ascii_case(name))
    }

    fn base(&self, prefix: (f64, f64)) -> Base {
        Base {
            dimension: Dimension::of(self.powers),
            angle: self.angle.0,
            turns: self.angle.1,
            size: (prefix.0 * self.size.0, prefix.1 * self.size.1),
            zero: self.zero,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{SYMBOLS, find};

    #[test]
    fn no_name_is_there_twice() {
        let mut names: Vec<&str> = SYMBOLS
            .iter()
            .flat_map(|s| s.names.iter().copied())
            .collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(names.iter().all(|name| find(name).is_some()));
    }
}
