//! Model structure: orders, integrator, delays, offset, initial states.

use crate::Error;
use crate::bank::MOST;

/// A delay of an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Delay {
    /// Known \[time\], at least 0.
    Known(f64),
    /// Estimated, from 0 to this \[time\].
    Estimated {
        /// The largest.
        most: f64,
    },
}

/// `A(p) y = sum_j B_j(p) u_j(t - d_j) + offset`, with one A for all inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Degree of A, at least 1.
    pub n: usize,
    /// Degree of each input's B, at most n.
    pub m: Vec<usize>,
    /// `A(0) = 0`.
    pub integrator: bool,
    /// One delay for each input.
    pub delays: Vec<Delay>,
    /// Whether an offset is estimated for each record.
    pub offset: bool,
    /// Whether n initial states are estimated for each record; else it begins at rest, all signals at 0.
    pub initial_states: bool,
}

impl Structure {
    /// Structure without integrator and delays, with offset and initial states.
    pub fn new(n: usize, m: impl Into<Vec<usize>>) -> Self {
        let m = m.into();
        Self {
            n,
            delays: vec![Delay::Known(0.0); m.len()],
            m,
            integrator: false,
            offset: true,
            initial_states: true,
        }
    }

    /// Adds an integrator.
    #[must_use]
    pub fn with_integrator(mut self) -> Self {
        self.integrator = true;
        self
    }

    /// Sets the delay of an input, counted from 0; a number without an input has no effect.
    #[must_use]
    pub fn with_delay(mut self, input: usize, delay: Delay) -> Self {
        if let Some(slot) = self.delays.get_mut(input) {
            *slot = delay;
        }
        self
    }

    /// For records of deviations that begin at rest.
    #[must_use]
    pub fn from_rest(mut self) -> Self {
        self.offset = false;
        self.initial_states = false;
        self
    }

    /// Coefficients of A that are estimated: `a_i` with i from here to n - 1 in the monic form.
    pub(crate) fn lowest(&self) -> usize {
        usize::from(self.integrator)
    }

    /// Coefficients of A and all B, and estimated delays.
    pub fn parameters(&self) -> usize {
        self.n - self.lowest() + self.numerators() + self.estimated_delays().count()
    }

    /// Offset and initial states of one record.
    pub(crate) fn of_record(&self) -> usize {
        usize::from(self.offset) + if self.initial_states { self.n } else { 0 }
    }

    /// Coefficients of all B.
    pub(crate) fn numerators(&self) -> usize {
        self.m.iter().map(|m| m + 1).sum()
    }

    /// Inputs whose delay is estimated, with the largest.
    pub(crate) fn estimated_delays(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let delays = self.delays.iter().enumerate();
        delays.filter_map(|(j, delay)| match delay {
            Delay::Estimated { most } => Some((j, *most)),
            Delay::Known(_) => None,
        })
    }

    /// The largest delay of any input \[time\].
    pub(crate) fn largest_delay(&self) -> f64 {
        let largest = |delay: &Delay| match delay {
            Delay::Known(d) | Delay::Estimated { most: d } => *d,
        };
        self.delays.iter().map(largest).fold(0.0, f64::max)
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        if self.n == 0 {
            return Err(Error::OrderZero);
        }
        if self.n > MOST {
            return Err(Error::Setting {
                what: "the order n",
                value: self.n as f64,
                range: "at most 8",
            });
        }
        if self.m.is_empty() {
            return Err(Error::NoInput);
        }
        if self.delays.len() != self.m.len() {
            return Err(Error::Length {
                record: "structure".into(),
                what: "the list of delays".into(),
                expected: self.m.len(),
                found: self.delays.len(),
            });
        }
        for (j, (&m, delay)) in self.m.iter().zip(&self.delays).enumerate() {
            let (input, n) = (j + 1, self.n);
            if m > n {
                return Err(Error::Improper { input, n, m });
            }
            let (Delay::Known(value) | Delay::Estimated { most: value }) = *delay;
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::Setting {
                    what: "a delay",
                    value,
                    range: "finite and at least 0",
                });
            }
            if m == n && matches!(delay, Delay::Estimated { .. }) {
                let most = n - 1;
                return Err(Error::DelayOfDirectTerm { input, n, most });
            }
        }
        Ok(())
    }
}
