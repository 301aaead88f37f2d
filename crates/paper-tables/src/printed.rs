//! A printed figure of a paper.

/// A printed figure: value and decimals, which determine its rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// The figure, in the unit of its table.
    pub value: f64,
    /// Largest rounding error either way, in the same unit: half of the last digit.
    pub rounding: f64,
    /// Decimals, 0 to 6.
    pub decimals: usize,
}

impl Printed {
    /// A figure with 0 to 6 decimals; in a constant, more decimals are a compile error.
    pub(crate) const fn new(value: f64, decimals: usize) -> Self {
        const HALF_DIGIT: [f64; 7] = [0.5, 0.05, 0.005, 5e-4, 5e-5, 5e-6, 5e-7];
        Self {
            value,
            rounding: HALF_DIGIT[decimals],
            decimals,
        }
    }

    /// The difference of two figures; both may be rounded.
    pub(crate) fn minus(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            rounding: self.rounding + other.rounding,
            decimals: self.decimals.max(other.decimals),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_has_both_roundings() {
        let difference = Printed::new(371.18, 2).minus(Printed::new(369.8, 1));
        assert!((difference.value - 1.38).abs() < 1e-9);
        assert!((difference.rounding - 0.055).abs() < 1e-12);
    }
}
