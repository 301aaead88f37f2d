//! Bounds on c^ in the comparison of the gains, and whether `C^/A0 - gamma/(2 c)` is strictly positive real inside them.

use ct_constrained::Bounds;
use serde::Serialize;
use stabilized_oe::check_filter_bounds;

use crate::Error;

/// `a_1` (s) and `a_2` (s^2) of the plants that the bounds on c are checked for.
const PLAUSIBLE: ([f64; 2], [f64; 2]) = ([0.9, 0.9], [1.1, 1.1]);

/// Bounds on c^.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Limits {
    /// None.
    None,
    /// `c_1` in 0.5 to 3 s, `c_2` in 0.4 to 3 s^2: at the corner (0.5, 3) `C^/A0` is not positive real.
    Wide,
    /// `c_1` in 0.9 to 3 s, `c_2` in 0.7 to 2 s^2: inside, `C^/A0 - 1/2` is strictly positive real.
    Sure,
}

impl Limits {
    /// All.
    pub const ALL: [Self; 3] = [Self::None, Self::Wide, Self::Sure];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Wide => "wide",
            Self::Sure => "sure",
        }
    }

    pub(super) fn bounds(self) -> Result<Option<Bounds<2>>, Error> {
        Ok(match self {
            Self::None => None,
            Self::Wide => Some(Bounds::new([0.5, 0.4], [3.0, 3.0])?),
            Self::Sure => Some(Bounds::new([0.9, 0.7], [3.0, 2.0])?),
        })
    }
}

/// Result of the check of bounds on c^.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// Which.
    pub bounds: Limits,
    /// Whether `C^/A0 - gamma/(2 c)` is strictly positive real inside them for all plants within 10 % of the true one.
    pub hold: bool,
    /// The result in a sentence, with the frequency of failure.
    pub says: String,
}

/// Checks the wide and the sure bounds.
pub(super) fn checked() -> Result<Vec<Checked>, Error> {
    let plausible = Bounds::new(PLAUSIBLE.0, PLAUSIBLE.1)?;
    let mut all = Vec::new();
    for limits in Limits::ALL {
        let Some(bounds) = limits.bounds()? else {
            continue;
        };
        // gamma/(2 c) of the adaptive gains; the constant one needs 0 only
        let found = check_filter_bounds(&bounds, &plausible, 0.5)?;
        all.push(Checked {
            bounds: limits,
            hold: found.hold(),
            says: found.to_string(),
        });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sure_bounds_are_and_the_wide_ones_are_not() {
        let checked = checked().unwrap();
        let [wide, sure] = &checked[..] else {
            unreachable!()
        };
        assert!(
            !wide.hold && wide.says.contains("do not guarantee"),
            "{wide:?}"
        );
        assert!(sure.hold, "{sure:?}");
        // nor are the wide ones for the constant gain, with this plant
        let plant = Bounds::new([1.0; 2], [1.0; 2]).unwrap();
        let wide = Limits::Wide.bounds().unwrap().unwrap();
        assert!(!check_filter_bounds(&wide, &plant, 0.0).unwrap().hold());
    }
}
