//! Settings of the recursive estimator: gain, forgetting and limits.

use serde::{Deserialize, Serialize};

use crate::controller::positive;
use crate::{Error, OperatingPoint};

/// The polynomial in the filter `S/P^` after the sensitivities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// P^ of the start, constant: the filter of condition (14).
    Fixed,
    /// P^ of the present estimates. From bad starts this filter converges far more often.
    Adaptive,
}

/// Settings of the recursive estimator. These values were tested for a reference of amplitude 1 and closed-loop poles about 0.01 rad/s,
/// sampled every second, at 20 to 30 dB:
///
/// | plant | gain | forgetting factor a second | fading | step limit |
/// |---|---|---|---|---|
/// | n = 1 | 10 | 0.98 | 300 s | 5 % |
/// | n = 2, m = 1, started from least squares or instruments | 1 | 0.995 | 1000 s | 2 % |
///
/// For a reference of amplitude a divide the gain by `a^2`; for a loop that is f times as fast multiply the rate and
/// divide the times by f. A larger gain with slow excitation lets P wind up; without any forgetting a bad start is not
/// forgotten either. To follow a drift: a gain of 1, the forgetting rate 1 over the memory, and no fading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RecursiveSettings {
    /// Polynomial of the filter.
    pub filter: Filter,
    /// F(0), the same for each scaled parameter: its relative variance over the noise's \[1/unit of y^2\], above 0.
    pub gain: f64,
    /// Forgetting rate eta at the beginning \[1/time\], at least 0.
    pub forgetting: f64,
    /// Time constant with which the forgetting fades out \[time\]; infinite for constant forgetting, which is needed to follow drifting
    /// parameters.
    pub fading: f64,
    /// Largest relative change of a parameter in one step, above 0.
    pub step_limit: f64,
    /// No parameter grows above its scale times this factor, and `a_n` does not fall below its scale divided by this factor; above 1.
    pub range: f64,
    /// The levels around which the model is valid; they are subtracted from the signals.
    pub operating_point: OperatingPoint,
}

impl RecursiveSettings {
    /// An adaptive filter, parameters within 50 times their scale, and signals that are deviations.
    pub fn new(gain: f64, forgetting: f64, fading: f64, step_limit: f64) -> Self {
        Self {
            filter: Filter::Adaptive,
            gain,
            forgetting,
            fading,
            step_limit,
            range: 50.0,
            operating_point: OperatingPoint::default(),
        }
    }

    /// The same settings with another filter.
    #[must_use]
    pub fn with_filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        positive("the gain F(0)", self.gain)?;
        positive("the step limit", self.step_limit)?;
        let outside = |what, value, range| Err(Error::Setting { what, value, range });
        if !(self.forgetting >= 0.0 && self.forgetting.is_finite()) {
            return outside(
                "the forgetting rate",
                self.forgetting,
                "finite and at least 0",
            );
        }
        if self.fading.is_nan() || self.fading <= 0.0 {
            return outside(
                "the time over which forgetting fades",
                self.fading,
                "above 0, or infinite",
            );
        }
        if !(self.range > 1.0 && self.range.is_finite()) {
            return outside("the parameters' range", self.range, "finite and above 1");
        }
        let OperatingPoint { r, u, y } = self.operating_point;
        match [r, u, y].into_iter().find(|v| !v.is_finite()) {
            Some(value) => outside("a level of the operating point", value, "finite"),
            None => Ok(()),
        }
    }
}
