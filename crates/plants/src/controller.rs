//! A PI controller with limits, to close the loop around a [`crate::Simulator`].

use crate::Error;

/// `u = u_op + gain (e + (1/integral_time) int e dt)`, limited; the integral stands still while the command is limited
/// and would be driven further out.
#[derive(Debug, Clone, PartialEq)]
pub struct Pi {
    gain: f64,
    integral_time: f64,
    limits: (f64, f64),
    operating_point: f64,
    integral: f64,
}

impl Pi {
    /// `gain` \[input/output\], `integral_time` \[s\], `limits` and `operating_point` \[input\].
    ///
    /// # Errors
    /// Where a setting is not finite, the gain is zero, the integral time not positive, or the limits are crossed.
    pub fn new(
        gain: f64,
        integral_time: f64,
        limits: (f64, f64),
        operating_point: f64,
    ) -> Result<Self, Error> {
        let error = |what: String| Err(Error::Controller { what });
        if !gain.is_finite() || gain == 0.0 {
            return error(format!("gain = {gain}: give a finite gain other than zero"));
        }
        if !(integral_time.is_finite() && integral_time > 0.0) {
            return error(format!(
                "integral_time = {integral_time} s: give a positive time"
            ));
        }
        if limits.0.is_nan() || limits.1.is_nan() || limits.0 >= limits.1 {
            return error(format!(
                "u_min = {} is not below u_max = {}: swap them",
                limits.0, limits.1
            ));
        }
        Ok(Self {
            gain,
            integral_time,
            limits,
            operating_point,
            integral: 0.0,
        })
    }

    /// Proportional gain \[input/output\].
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Integral time \[s\].
    #[must_use]
    pub fn integral_time(&self) -> f64 {
        self.integral_time
    }

    /// The command for a set point and a reading, to be held over the next `h` seconds.
    pub fn command(&mut self, reference: f64, reading: f64, h: f64) -> f64 {
        let error = reference - reading;
        let wanted =
            self.operating_point + self.gain * (error + self.integral / self.integral_time);
        let given = wanted.clamp(self.limits.0, self.limits.1);
        let outwards = (wanted - given) * self.gain * error > 0.0;
        if !outwards {
            self.integral += error * h;
        }
        given
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_stands_still_at_a_limit_and_comes_back_at_once() {
        let mut pi = Pi::new(1.0, 10.0, (0.0, 5.0), 2.0).unwrap();
        for _ in 0..1000 {
            assert_eq!(pi.command(20.0, 0.0, 1.0), 5.0);
        }
        // Had the integral wound up, the command would stay at the limit for a thousand samples.
        assert!(pi.command(0.0, 1.0, 1.0) < 5.0);
    }

    #[test]
    fn impossible_settings_are_refused() {
        assert!(Pi::new(0.0, 1.0, (0.0, 1.0), 0.0).is_err());
        assert!(Pi::new(1.0, 0.0, (0.0, 1.0), 0.0).is_err());
        assert!(Pi::new(1.0, 1.0, (1.0, 1.0), 0.0).is_err());
        assert!(Pi::new(1.0, f64::NAN, (0.0, 1.0), 0.0).is_err());
    }
}
