//! The experiment of tables 1 to 4: a tank of first order, `tau dy/dt + y = K u`, with white output noise; printed values and assumptions.

use ct_signals::noise;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::Serialize;

/// End of a run, s.
pub const END: f64 = 1000.0;

/// The experiment. Values that the paper does not print were found by a search that fits its tables.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settings {
    /// K of the tank; the output is in units of the input. Printed.
    pub gain: f64,
    /// tau of the tank, s. Printed.
    pub time_constant: f64,
    /// Mean square of the noise over that of the output without it. Printed, but the paper does not say that it is a ratio of powers.
    pub noise_ratio: f64,
    /// Bound of |c^|, s. Printed.
    pub filter_limit: f64,
    /// Weights `c_p` and gamma of (4.11), which are equal. gamma is printed.
    pub weight: f64,
    /// Step and sampling interval, s; greater than 0. Not printed.
    pub dt: f64,
    /// Steps over which the error is differenced, 3 or 5. Not printed.
    pub span: usize,
    /// Half a period of the square wave of plus and minus 1 that is the input, s. Not printed.
    pub half_period: f64,
    /// Output at the beginning. Not printed.
    pub y0: f64,
    /// tau^(0), s. Not printed.
    pub time_constant_start: f64,
    /// K^(0). Not printed.
    pub gain_start: f64,
    /// c^(0), s. Not printed.
    pub filter_start: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gain: 1.0,
            time_constant: 10.0,
            noise_ratio: 0.1,
            filter_limit: 20.0,
            weight: 1.0,
            dt: 0.3125,
            span: 5,
            half_period: 31.5,
            y0: 0.5,
            time_constant_start: 0.95,
            gain_start: 0.0,
            filter_start: 0.0,
        }
    }
}

impl Settings {
    /// Assumptions about details that the paper omits, one sentence each.
    #[must_use]
    pub fn assumptions(&self) -> Vec<String> {
        let span = self.span as f64 * self.dt;
        vec![
            format!(
                "The input is a square wave of ±1 with half a period of {} s, +1 first.",
                self.half_period
            ),
            format!(
                "The step is {} s; the noise is white, one draw per step, with {} of the power of the output.",
                self.dt, self.noise_ratio
            ),
            format!(
                "Estimation starts from tau^ = {} s, K^ = {}, c^ = {}, the tank from y0 = {}.",
                self.time_constant_start, self.gain_start, self.filter_start, self.y0
            ),
            format!(
                "The derivative of the error is its difference over {span} s, read one step late, 0 until there is one."
            ),
            format!("c_p = gamma = {}.", self.weight),
            "The c-update has a minus: with the printed plus, every run ends at the bound of c^.".to_owned(),
            "The second term of the criterion is divided by tau squared: divided by tau, as printed, the criterion could not be as small as tabulated.".to_owned(),
            "Averages are over 20 values from 905 s to 1000 s; a relative variance is a standard deviation (n - 1) over a mean.".to_owned(),
            "These settings were found by a search against the same tables: agreement shows that they are possible, not that the paper used them.".to_owned(),
        ]
    }

    /// Steps of a run; a noise has one value more.
    #[must_use]
    pub fn steps(&self) -> usize {
        (END / self.dt).round() as usize
    }

    /// The step at a time in s.
    pub(super) fn step_at(&self, t: f64) -> usize {
        (t / self.dt).round() as usize
    }

    /// The input at a step.
    pub(super) fn input(&self, k: usize) -> f64 {
        if (k as f64 * self.dt / self.half_period).floor() % 2.0 == 0.0 {
            1.0
        } else {
            -1.0
        }
    }

    /// Root of the noise's mean square, in the unit of the output.
    pub(super) fn noise_level(&self, rule: Rule) -> f64 {
        (self.noise_ratio * self.power(rule)).sqrt()
    }

    /// Mean square of the output without noise over a run.
    #[must_use]
    pub fn power(&self, rule: Rule) -> f64 {
        let (share, steps) = (self.share(rule), self.steps());
        let (mut y, mut sum) = (self.y0, 0.0);
        for k in 0..=steps {
            sum += y * y;
            y += share * (self.gain * self.input(k) - y);
        }
        sum / (steps + 1) as f64
    }

    /// The factor of one step, `y += factor (K u - y)`, 0 to 1.
    pub(super) fn share(&self, rule: Rule) -> f64 {
        let part = self.dt / self.time_constant;
        match rule {
            Rule::Euler => part,
            Rule::Exact => -(-part).exp_m1(),
        }
    }

    /// Standard normal numbers for a run, from a separate stream of the generator.
    pub(super) fn noise(&self, seed: u64, run: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(run as u64);
        noise::white(self.steps() + 1, 1.0, &mut rng)
    }
}

/// Integration rule of the equations over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Euler's, which the tables fit better.
    Euler,
    /// The exact step over held signals.
    Exact,
}

impl Rule {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Euler, Self::Exact];

    /// Name in tables and sentences.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Exact => "exact",
        }
    }
}
