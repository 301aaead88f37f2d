//! What a unit's text means: its dimension, its size and its zero, and how values are converted.

use super::dimension::Dimension;
use super::table::{self, Base};

// Not a crate: those that read units at run time follow UCUM or GNU units, where C is the coulomb and degC, rpm, pct or lmin are unknown.

/// A unit of measurement that is understood.
///
/// ```
/// use ct_signals::Unit;
///
/// let of = |text| Unit::parse(text);
/// let (Some(file), Some(model)) = (of("m³/h"), of("l/min")) else {
///     unreachable!();
/// };
/// assert_eq!(file.kind(), Some("flow"));
/// let conversion = file.conversion_to(&model).map(|c| c.apply(3.0));
/// assert_eq!(conversion, Some(50.0));
/// assert!(of("bananas").is_none());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    dimension: Dimension,
    /// Power of the angle.
    angle: i8,
    /// Whether the angle counts turns, as rpm and Hz do; 1/min and 1/s are then the same.
    turns: bool,
    /// The size in SI units and turns, as a fraction.
    size: (f64, f64),
    /// The zero of the scale in SI units, as a fraction.
    zero: (f64, f64),
}

/// How values are converted: `factor * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// New units in one old unit.
    pub factor: f64,
    /// The old scale's zero, in the new unit: other than 0 between scales of temperature only.
    pub offset: f64,
}

impl Conversion {
    /// A value in the new unit.
    #[must_use]
    pub fn apply(&self, value: f64) -> f64 {
        self.factor * value + self.offset
    }

    /// Whether values stay as they are.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }
}

impl Unit {
    /// A unit from its text; `None` where it is not understood.
    ///
    /// Understood are symbols with SI prefixes (`mV`, `kPa`, `µs`) and many names in full (`litres`), powers (`m3`, `m^3`, `m³`,
    /// `s-1`), products with `*`, `.`, `·` or a blank, and quotients; `1` and `-` are pure numbers. Several factors below a stroke need brackets,
    /// `J/(kg K)`: `J/kg K` is not understood, as it has two meanings. `C` and `F` are temperatures, gallons those of the US.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if text == "-" {
            return Some(Self::ONE);
        }
        let text = text
            .replace("**", "^")
            .replace("deg C", "degC")
            .replace("deg F", "degF")
            .replace("° C", "°C")
            .replace("° F", "°F");
        // A scale with a zero of its own is one only where it stands alone.
        if let Some(base) = table::find(&text) {
            return Some(Self::of(base));
        }
        let mut parser = Parser {
            rest: &text,
            bracketed: false,
        };
        let unit = parser.quotient()?;
        let sized = |value: f64| value.is_finite() && value > 0.0;
        (parser.rest.is_empty() && sized(unit.size.0) && sized(unit.size.1)).then_some(unit)
    }

    /// The powers of the base quantities; angles and ratios have none.
    #[must_use]
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The quantity in a word for people, such as `volume`, `flow` or `temperature`; `None` where it has no common name.
    #[must_use]
    pub fn kind(&self) -> Option<&'static str> {
        let kind = self.dimension.kind();
        match (self.angle, kind) {
            (0, _) => kind,
            (1, Some("ratio")) => Some("angle"),
            (1, Some("frequency")) if !self.turns => Some("angular velocity"),
            _ if self.turns => kind,
            _ => None,
        }
    }

    /// How values in this unit become values in another; `None` where the two measure different things.
    ///
    /// `degC`, `K` and `degF` alone are scales of temperature and have an offset; a difference of temperatures in a column of its own cannot be
    /// told from them. In a compound such as `W/degC` they are differences. An angle is no ratio, and `rad/s` is not `1/s`; turns may be left
    /// out, so that `rpm` is `1/min`.
    #[must_use]
    pub fn conversion_to(&self, other: &Self) -> Option<Conversion> {
        let angles = self.angle == other.angle
            || self.angle == 0 && other.turns
            || other.angle == 0 && self.turns;
        if self.dimension != other.dimension || !angles {
            return None;
        }
        // Fractions are kept to the end, so that 1000 is 1000 and 32 is 32.
        let factor = (self.size.0 * other.size.1) / (self.size.1 * other.size.0);
        let zeros = self.zero.0 * other.zero.1 - other.zero.0 * self.zero.1;
        let offset = zeros * other.size.1 / (self.zero.1 * other.zero.1 * other.size.0);
        (factor.is_finite() && factor > 0.0).then_some(Conversion { factor, offset })
    }

    const ONE: Self = Self {
        dimension: Dimension::of([0; 6]),
        angle: 0,
        turns: true,
        size: (1.0, 1.0),
        zero: (0.0, 1.0),
    };

    fn of(base: Base) -> Self {
        Self {
            dimension: base.dimension,
            angle: base.angle,
            turns: base.turns,
            size: base.size,
            zero: base.zero,
        }
    }

    /// The product of this and a power of another; differences of temperature have no zero.
    fn times(self, other: Self, power: i8) -> Option<Self> {
        let (above, below) = if power < 0 {
            (other.size.1, other.size.0)
        } else {
            other.size
        };
        let raised = i32::from(power).abs();
        Some(Self {
            dimension: self.dimension.times(other.dimension, power)?,
            angle: self.angle.checked_add(other.angle.checked_mul(power)?)?,
            turns: (self.turns || self.angle == 0) && (other.turns || other.angle == 0),
            size: (
                self.size.0 * above.powi(raised),
                self.size.1 * below.powi(raised),
            ),
            zero: Self::ONE.zero,
        })
    }
}

/// What is left of a unit's text.
struct Parser<'a> {
    rest: &'a str,
    /// Whether this is within brackets, where there are no further ones.
    bracketed: bool,
}

impl Parser<'_> {
    /// `a b/c/d`: nothing follows a denominator but another one.
    fn quotient(&mut self) -> Option<Unit> {
        let mut unit = self.product()?;
        while self.eat('/') {
            unit = unit.times(self.factor()?, -1)?;
        }
        Some(unit)
    }

    fn product(&mut self) -> Option<Unit> {
        let mut unit = self.factor()?;
        loop {
            let before = self.rest;
            let signed = ['*', '.', '·', '⋅'].into_iter().any(|sign| self.eat(sign));
            if signed || before.starts_with(' ') && self.begins_factor() {
                unit = unit.times(self.factor()?, 1)?;
            } else {
                return Some(unit);
            }
        }
    }

    /// A symbol with its power, a one, or a product in brackets.
    fn factor(&mut self) -> Option<Unit> {
        self.rest = self.rest.trim_start();
        if let Some(rest) = self.rest.strip_prefix('1') {
            self.rest = rest;
            return Some(Unit::ONE);
        }
        let unit = if !self.bracketed && self.eat('(') {
            self.bracketed = true;
            let unit = self.quotient()?;
            self.bracketed = false;
            if !self.eat(')') {
                return None;
            }
            unit
        } else {
            let end = self
                .rest
                .find(|c: char| !(c.is_alphabetic() || "%‰°".contains(c)))
                .unwrap_or(self.rest.len());
            let (name, rest) = self.rest.split_at(end);
            self.rest = rest;
            Unit::of(table::find(name)?)
        };
        Unit::ONE.times(unit, self.power()?)
    }

    /// The power after a symbol, 1 where there is none; `None` where it is no whole number from 1 to 9 with a sign.
    fn power(&mut self) -> Option<i8> {
        let marked = self.rest.starts_with('^');
        let mut digits = self.rest.strip_prefix('^').unwrap_or(self.rest).chars();
        let mut next = digits.clone().next();
        let negative = matches!(next, Some('-' | '⁻'));
        if negative || next == Some('+') {
            digits.next();
            next = digits.clone().next();
        }
        let power = next.and_then(|digit| match digit {
            '1'..='9' => digit.to_digit(10),
            '¹' => Some(1),
            '²' => Some(2),
            '³' => Some(3),
            '⁴'..='⁹' => Some(digit as u32 - '⁰' as u32),
            _ => None,
        });
        match power {
            Some(power) => {
                digits.next();
                self.rest = digits.as_str();
                let power = i8::try_from(power).ok()?;
                Some(if negative { -power } else { power })
            }
            None if marked || negative => None,
            None => Some(1),
        }
    }

    /// Whether a sign follows, after blanks or not; it is passed over.
    fn eat(&mut self, sign: char) -> bool {
        let found = self.rest.trim_start().strip_prefix(sign);
        self.rest = found.unwrap_or(self.rest);
        found.is_some()
    }

    /// Whether a symbol or a bracket follows.
    fn begins_factor(&self) -> bool {
        self.rest
            .trim_start()
            .starts_with(|c: char| c.is_alphabetic() || "%‰°(".contains(c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap_or_else(|| panic!("{text} is not understood"))
    }

    fn convert(value: f64, from: &str, to: &str) -> Option<f64> {
        Some(unit(from).conversion_to(&unit(to))?.apply(value))
    }

    /// Units as headers have them, with the word for the quantity, and the size in SI units.
    const HEADERS: &[(&str, &str, f64)] = &[
        ("l/min", "flow", 1e-3 / 60.0),
        ("L/h", "flow", 1e-3 / 3600.0),
        ("m3/h", "flow", 1.0 / 3600.0),
        ("m^3/h", "flow", 1.0 / 3600.0),
        ("m**3/h", "flow", 1.0 / 3600.0),
        ("m³ / h", "flow", 1.0 / 3600.0),
        ("cm³/s", "flow", 1e-6),
        ("lmin", "flow", 1e-3 / 60.0),
        ("ml", "volume", 1e-6),
        ("mL", "volume", 1e-6),
        ("l", "volume", 1e-3),
        ("L", "volume", 1e-3),
        ("litre", "volume", 1e-3),
        ("litres", "volume", 1e-3),
        ("Liter", "volume", 1e-3),
        ("dm^3", "volume", 1e-3),
        ("gal", "volume", 0.003_785_411_784),
        ("bar", "pressure", 1e5),
        ("mbar", "pressure", 100.0),
        ("Pa", "pressure", 1.0),
        ("kPa", "pressure", 1e3),
        ("N/mm2", "pressure", 1e6),
        ("psi", "pressure", 6_894.757_293_168_361),
        ("%", "ratio", 0.01),
        ("pct", "ratio", 0.01),
        ("percent", "ratio", 0.01),
        ("1", "ratio", 1.0),
        ("-", "ratio", 1.0),
        ("V", "voltage", 1.0),
        ("volts", "voltage", 1.0),
        ("mV", "voltage", 1e-3),
        ("A", "current", 1.0),
        ("mA", "current", 1e-3),
        ("kΩ", "resistance", 1e3),
        ("W", "power", 1.0),
        ("kW", "power", 1e3),
        ("kWh", "energy", 3.6e6),
        ("W/m²", "irradiance", 1.0),
        ("m", "length", 1.0),
        ("cm", "length", 0.01),
        ("mm", "length", 1e-3),
        ("µm", "length", 1e-6),
        ("in", "length", 0.0254),
        ("cm2", "area", 1e-4),
        ("m/s^2", "acceleration", 1.0),
        ("m/s/s", "acceleration", 1.0),
        ("m s-2", "acceleration", 1.0),
        ("m·s⁻²", "acceleration", 1.0),
        ("km/h", "velocity", 1.0 / 3.6),
        ("kg/h", "mass flow", 1.0 / 3600.0),
        ("kg/m3", "density", 1.0),
        ("J/K", "heat capacity", 1.0),
        ("kJ/degC", "heat capacity", 1e3),
        ("W/K", "thermal conductance", 1.0),
        ("K/W", "thermal resistance", 1.0),
        ("J/(kg K)", "specific heat capacity", 1.0),
        ("kJ/(kg*°C)", "specific heat capacity", 1e3),
        ("N", "force", 1.0),
        ("Nm", "energy", 1.0),
        ("N m", "energy", 1.0),
        ("kg.m.m/s2", "energy", 1.0),
        ("s", "time", 1.0),
        ("min", "time", 60.0),
        ("h", "time", 3600.0),
        ("d", "time", 86_400.0),
        ("ms", "time", 1e-3),
        ("us", "time", 1e-6),
        ("μs", "time", 1e-6),
        ("K/min", "heating rate", 1.0 / 60.0),
        ("mol/l", "concentration", 1e3),
        ("rpm", "frequency", 1.0 / 60.0),
        ("1/min", "frequency", 1.0 / 60.0),
        ("min^-1", "frequency", 1.0 / 60.0),
        ("Hz", "frequency", 1.0),
        ("kHz", "frequency", 1e3),
        ("1/s", "frequency", 1.0),
    ];

    #[test]
    fn what_engineers_write_in_headers_is_understood() {
        for &(text, kind, size) in HEADERS {
            let unit = unit(text);
            assert_eq!(unit.kind(), Some(kind), "{text}");
            assert_relative_eq!(unit.size.0 / unit.size.1, size, max_relative = 1e-15);
        }
        for (text, kind) in [
            ("degC", Some("temperature")),
            ("°C", Some("temperature")),
            ("C", Some("temperature")),
            ("deg C", Some("temperature")),
            ("K", Some("temperature")),
            ("degF", Some("temperature")),
            ("rad", Some("angle")),
            ("deg", Some("angle")),
            ("rad/s", Some("angular velocity")),
            ("Nm/rad", None),
            ("V/m", None),
        ] {
            assert_eq!(unit(text).kind(), kind, "{text}");
        }
    }

    #[test]
    fn what_is_not_plain_is_not_understood() {
        for text in [
            "", " ", "x", "bananas", "J/kg K", "W/m2K", "m/", "/s", "m//s", "m^", "m^0", "m^2.5",
            "m22", "m2x", "(m", "m)", "((m))", "10 m", "0", "--", "m*", "mC", "kmin", "bar(g)",
            "m^-", "mmm", "V²²", "é", "m × s",
        ] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
        assert_eq!(Unit::parse(&"m9 ".repeat(1000)), None);
        assert_eq!(Unit::parse(&"(".repeat(100_000)), None);
    }

    #[test]
    fn values_are_converted() {
        for (value, from, to, expected) in [
            (3.0, "m3/h", "l/min", 50.0),
            (1.0, "m", "mm", 1000.0),
            (250.0, "mm", "m", 0.25),
            (50.0, "%", "1", 0.5),
            (1.0, "gal", "litres", 3.785_411_784),
            (20.0, "degC", "K", 293.15),
            (300.0, "K", "C", 26.85),
            (100.0, "degC", "degF", 212.0),
            (-40.0, "°F", "°C", -40.0),
            (1.8, "W/degC", "W/degF", 1.0),
            (2.0, "W/degC", "W/K", 2.0),
            (90.0, "deg", "rad", std::f64::consts::FRAC_PI_2),
            (60.0, "rpm", "rad/s", std::f64::consts::TAU),
            (60.0, "rpm", "deg/s", 360.0),
            (1500.0, "rpm", "1/min", 1500.0),
            (1500.0, "1/min", "rpm", 1500.0),
            (50.0, "Hz", "rpm", 3000.0),
            (50.0, "Hz", "1/s", 50.0),
            (1.0, "kWh", "MJ", 3.6),
            (1.0, "Nm", "J", 1.0),
        ] {
            let found = convert(value, from, to).unwrap();
            assert_relative_eq!(found, expected, max_relative = 1e-14);
        }
        for (from, to, factor, offset) in [
            ("m", "mm", 1000.0, 0.0),
            ("h", "s", 3600.0, 0.0),
            ("degC", "degF", 1.8, 32.0),
            ("degC", "K", 1.0, 273.15),
            ("rpm", "1/min", 1.0, 0.0),
        ] {
            let exact = Conversion { factor, offset };
            assert_eq!(unit(from).conversion_to(&unit(to)), Some(exact));
        }
        assert!(
            unit("l/min")
                .conversion_to(&unit("L min^-1"))
                .unwrap()
                .is_identity()
        );
        assert!(
            !unit("degC")
                .conversion_to(&unit("K"))
                .unwrap()
                .is_identity()
        );
    }

    #[test]
    fn different_quantities_are_not_converted() {
        for (from, to) in [
            ("m", "m2"),
            ("V", "A"),
            ("kg/h", "l/h"),
            ("rad", "1"),
            ("deg", "%"),
            ("rad/s", "1/s"),
            ("1/min", "deg/s"),
            ("Nm/rad", "Nm"),
            ("degC", "W"),
        ] {
            assert_eq!(convert(1.0, from, to), None, "{from} to {to}");
            assert_eq!(convert(1.0, to, from), None, "{to} to {from}");
        }
    }

    proptest! {
        #[test]
        fn a_conversion_has_its_inverse(
            from in 0..HEADERS.len() + 4,
            to in 0..HEADERS.len() + 4,
            value in -1e6..1e6_f64,
        ) {
            let text = |index: usize| {
                HEADERS.get(index).map_or_else(
                    || ["degC", "K", "degF", "rad/s"][index - HEADERS.len()],
                    |header| header.0,
                )
            };
            let (from, to) = (unit(text(from)), unit(text(to)));
            let (there, back) = (from.conversion_to(&to), to.conversion_to(&from));
            prop_assert_eq!(there.is_some(), back.is_some());
            if let (Some(there), Some(back)) = (there, back) {
                let again = back.apply(there.apply(value));
                prop_assert!((again - value).abs() <= 1e-12 * (value.abs() + 500.0), "{again} {value}");
            }
        }

        #[test]
        fn no_text_panics(text in "\\PC{0,20}", near in "[mslKVW%°CdegNPa123/*.^ ()²³⁻·-]{0,20}") {
            for text in [text, near] {
                if let Some(unit) = Unit::parse(&text) {
                    prop_assert!(unit.conversion_to(&unit).unwrap().is_identity(), "{text}");
                }
            }
        }
    }
}
