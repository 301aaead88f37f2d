//! Meaning of a unit's text: dimension, size and zero, and the conversion of values.

use super::dimension::Dimension;
use super::table::{self, Base};

// Not a crate: crates that read units at run time follow UCUM or GNU units, where C is the coulomb and degC, rpm, pct or lmin are unknown.

/// A known unit of measurement.
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
    /// Whether the angle is measured in turns, as for rpm and Hz; 1/min and 1/s are then equal.
    turns: bool,
    /// The size in SI units and turns, as a fraction.
    size: (f64, f64),
    /// The zero of the scale in SI units, as a fraction.
    zero: (f64, f64),
}

/// Conversion of values: `factor * value + offset`.
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

    /// Whether the conversion does not change values.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }
}

impl Unit {
    /// A unit from its text; `None` where it is not understood.
    ///
    /// Understood are symbols with SI prefixes (`mV`, `kPa`, `µs`) and many names in full (`litres`), powers (`m3`, `m^3`, `m³`, `s-1`),
    /// products with `*`, `.`, `·` or a blank, and quotients; `1` and `-` are pure numbers. Several factors below a stroke need brackets,
    /// `J/(kg K)`: `J/kg K` is not accepted, because it is ambiguous. `C` and `F` are temperatures, gallons those of the US.
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
        // A unit with an offset zero (degC) has its offset only if it is not part of a compound unit.
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

    /// The size in SI units; an angle in turns is measured in turns.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size.0 / self.size.1
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
    /// `degC`, `K` and `degF` alone are scales of temperature and have an offset; a difference of temperatures in a column of its own
    /// cannot be distinguished from them. In a compound such as `W/degC` they are differences. An angle is no ratio, and `rad/s` is not
    /// `1/s`; turns may be left out, so that `rpm` is `1/min`.
    #[must_use]
    pub fn conversion_to(&self, other: &Self) -> Option<Conversion> {
        let angles = self.angle == other.angle
            || self.angle == 0 && other.turns
            || other.angle == 0 && self.turns;
        if self.dimension != other.dimension || !angles {
            return None;
        }
        // Exact fractions are used to the end, so that 1000 is exactly 1000 and 32 exactly 32.
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

/// The part of a unit's text that is not read yet.
struct Parser<'a> {
    rest: &'a str,
    /// Whether the parser is inside brackets; nested brackets are not allowed.
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
mod tests;
