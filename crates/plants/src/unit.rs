//! Units of fitted parameters, built from the units of the record.

/// A product of powers of a tank's units. The exponent of the level's unit is stored in halves, because Torricelli's coefficient has a
/// half-integer power.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Unit {
    /// Twice the exponent of the level's unit.
    pub level_halves: i8,
    /// Exponent of the area's unit.
    pub area: i8,
    /// Exponent of the input's unit.
    pub input: i8,
    /// Exponent of the second.
    pub time: i8,
}

impl Unit {
    /// A pure number.
    pub const ONE: Self = Self {
        level_halves: 0,
        area: 0,
        input: 0,
        time: 0,
    };
    /// A level, or the reading of a level.
    pub const LEVEL: Self = Self {
        level_halves: 2,
        ..Self::ONE
    };
    /// A command to the actuator.
    pub const INPUT: Self = Self {
        input: 1,
        ..Self::ONE
    };
    /// Seconds.
    pub const TIME: Self = Self {
        time: 1,
        ..Self::ONE
    };
    /// Area times level per second.
    pub const FLOW: Self = Self {
        level_halves: 2,
        area: 1,
        time: -1,
        ..Self::ONE
    };

    /// The text of the unit, for example `cm^2.5/s`. `area_known`: the area has the square of the level's unit; otherwise it is
    /// dimensionless.
    #[must_use]
    pub fn label(self, level: &str, input: &str, area_known: bool) -> String {
        let halves = self.level_halves + if area_known { 4 * self.area } else { 0 };
        let level = if level.is_empty() { "level" } else { level };
        let input = if input.is_empty() { "input" } else { input };
        let mut powers: Vec<(&str, f64)> = Vec::new();
        for (name, power) in [
            (level, f64::from(halves) / 2.0),
            (input, f64::from(self.input)),
            ("s", f64::from(self.time)),
        ] {
            match powers.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += power,
                None => powers.push((name, power)),
            }
        }
        let join = |sign: f64| {
            powers
                .iter()
                .filter(|(_, power)| power * sign > 0.0)
                .map(|(name, power)| match power.abs() {
                    1.0 => (*name).to_string(),
                    p => format!("{name}^{p}"),
                })
                .collect::<Vec<_>>()
        };
        let (above, below) = (join(1.0), join(-1.0));
        match (above.is_empty(), below.len()) {
            (_, 0) => above.join(" "),
            (true, 1) => format!("1/{}", below[0]),
            (true, _) => format!("1/({})", below.join(" ")),
            (false, 1) => format!("{}/{}", above.join(" "), below[0]),
            (false, _) => format!("{}/({})", above.join(" "), below.join(" ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torricelli_and_gain_read_as_an_engineer_writes_them() {
        let alpha = Unit {
            level_halves: 1,
            area: 1,
            time: -1,
            ..Unit::ONE
        };
        assert_eq!(alpha.label("cm", "V", true), "cm^2.5/s");
        assert_eq!(alpha.label("V", "V", false), "V^0.5/s");
        let gain = Unit {
            input: -1,
            ..Unit::FLOW
        };
        assert_eq!(gain.label("cm", "V", true), "cm^3/(V s)");
        assert_eq!(gain.label("V", "V", false), "1/s");
        assert_eq!(Unit::ONE.label("cm", "V", true), "");
    }
}
