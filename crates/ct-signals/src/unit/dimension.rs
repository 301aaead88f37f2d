//! Dimensions: powers of the base quantities.

/// Powers of length, mass, time, electric current, temperature and amount of substance. Angles and ratios have no dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension {
    /// Power of the metre.
    pub length: i8,
    /// Power of the kilogram.
    pub mass: i8,
    /// Power of the second.
    pub time: i8,
    /// Power of the ampere.
    pub current: i8,
    /// Power of the kelvin.
    pub temperature: i8,
    /// Power of the mole.
    pub amount: i8,
}

impl Dimension {
    /// Dimension of pure numbers.
    pub const NONE: Self = Self::of([0; 6]);
    /// Dimension of time.
    pub const TIME: Self = Self::of([0, 0, 1, 0, 0, 0]);

    /// From the powers of metre, kilogram, second, ampere, kelvin and mole.
    pub(super) const fn of(powers: [i8; 6]) -> Self {
        let [length, mass, time, current, temperature, amount] = powers;
        Self {
            length,
            mass,
            time,
            current,
            temperature,
            amount,
        }
    }

    fn powers(self) -> [i8; 6] {
        [
            self.length,
            self.mass,
            self.time,
            self.current,
            self.temperature,
            self.amount,
        ]
    }

    /// The dimension of the product of this and a power of another; `None` where a power is too large.
    #[must_use]
    pub fn times(self, other: Self, power: i8) -> Option<Self> {
        let mut powers = self.powers();
        for (own, factor) in powers.iter_mut().zip(other.powers()) {
            *own = own.checked_add(factor.checked_mul(power)?)?;
        }
        Some(Self::of(powers))
    }

    /// The dimension whose square this is; `None` where a power is odd.
    #[must_use]
    pub fn root(self) -> Option<Self> {
        let powers = self.powers();
        let even = powers.iter().all(|power| power % 2 == 0);
        even.then(|| Self::of(powers.map(|power| power / 2)))
    }

    /// The quantity in a word for people; `None` where it has no common name. Torque is called energy: their units are the same.
    #[must_use]
    pub fn kind(self) -> Option<&'static str> {
        Some(match self.powers() {
            [0, 0, 0, 0, 0, 0] => "ratio",
            [1, 0, 0, 0, 0, 0] => "length",
            [2, 0, 0, 0, 0, 0] => "area",
            [3, 0, 0, 0, 0, 0] => "volume",
            [0, 0, 1, 0, 0, 0] => "time",
            [0, 0, -1, 0, 0, 0] => "frequency",
            [1, 0, -1, 0, 0, 0] => "velocity",
            [1, 0, -2, 0, 0, 0] => "acceleration",
            [3, 0, -1, 0, 0, 0] => "flow",
            [0, 1, 0, 0, 0, 0] => "mass",
            [0, 1, -1, 0, 0, 0] => "mass flow",
            [-3, 1, 0, 0, 0, 0] => "density",
            [1, 1, -2, 0, 0, 0] => "force",
            [-1, 1, -2, 0, 0, 0] => "pressure",
            [2, 1, -2, 0, 0, 0] => "energy",
            [2, 1, -3, 0, 0, 0] => "power",
            [0, 1, -3, 0, 0, 0] => "irradiance",
            [0, 0, 0, 1, 0, 0] => "current",
            [0, 0, 1, 1, 0, 0] => "charge",
            [2, 1, -3, -1, 0, 0] => "voltage",
            [2, 1, -3, -2, 0, 0] => "resistance",
            [0, 0, 0, 0, 1, 0] => "temperature",
            [0, 0, -1, 0, 1, 0] => "heating rate",
            [2, 1, -2, 0, -1, 0] => "heat capacity",
            [2, 0, -2, 0, -1, 0] => "specific heat capacity",
            [2, 1, -3, 0, -1, 0] => "thermal conductance",
            [-2, -1, 3, 0, 1, 0] => "thermal resistance",
            [0, 0, 0, 0, 0, 1] => "amount",
            [-3, 0, 0, 0, 0, 1] => "concentration",
            _ => return None,
        })
    }
}
