//! Quantiles of Student's distribution, for any number of degrees of freedom.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// From this number of degrees of freedom on, the quantile is computed from the series in 1/freedom.
const MANY: f64 = 1e4;

/// Half the width, in standard errors, of the interval that contains the true value with probability `level` (0 to 1, both excluded), for a
/// variance with `freedom` degrees of freedom (fewer than 1 count as 1); NaN for another level.
///
/// Beyond 10 000 degrees these are the first two terms of Cornish and Fisher, the third being below 1e-12 there.
pub fn student_half_width(level: f64, freedom: f64) -> f64 {
    if !(level > 0.0 && level < 1.0) || freedom.is_nan() {
        return f64::NAN;
    }
    let at = 0.5 + 0.5 * level;
    let freedom = freedom.max(1.0);
    if freedom < MANY {
        // StudentsT loses accuracy for many degrees of freedom, and above 1e8 its tail.
        return StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(at));
    }
    let z = Normal::standard().inverse_cdf(at);
    let z2 = z * z;
    let first = z * (z2 + 1.0) / 4.0;
    let second = z * (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / 96.0;
    z + (first + second / freedom) / freedom
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with tables, and checks that the two formulas agree where they meet.
    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, level, quantile) in [
            (1.0, 0.95, 12.706_204_736),
            (10.0, 0.95, 2.228_138_852),
            (1e6, 0.95, 1.959_966_357),
            (1e9, 0.99, 2.575_829_307),
        ] {
            let found = student_half_width(level, freedom);
            assert!((found - quantile).abs() < 1e-8, "{freedom}: {found}");
        }
        for level in [0.5, 0.95, 0.999] {
            let below = student_half_width(level, MANY * (1.0 - 1e-9));
            let above = student_half_width(level, MANY);
            assert!((below - above).abs() < 1e-9, "{below} {above}");
        }
        assert!(student_half_width(1.0, 10.0).is_nan());
    }
}
