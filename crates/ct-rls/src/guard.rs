//! Checks around every step for every representation of `P`: the guards, the counts, and the reason why a run has stopped.

use crate::Error;
use crate::estimator::Health;
use crate::integrator::sealed::{Capped, Memory, Refusal};
use crate::outcome::Outcome;
use crate::settings::{Guards, MAX_PHI_SQUARED, StepFactors, Weights};

/// The start of the cap on the trace, times the trace of `P(0)`.
const TRACE_LIMIT: f64 = 1e6;

/// Parts of the step that are independent of the form of `P`: guards, counts, and the reason why the run stopped.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    pub guards: Guards,
    /// At least the trace of `P`, as far as the rule raises it: so the trace itself is seldom needed.
    bound: f64,
    /// The cap in force.
    limit: f64,
    silent_below_squared: f64,
    pub step: StepFactors,
    failure: Option<Error>,
    used: u64,
    unused: u64,
    capped: u64,
    silent: u64,
}

/// Counts of events.
#[cfg(feature = "serde")]
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) struct Counts {
    used: u64,
    unused: u64,
    capped: u64,
    silent: u64,
}

#[cfg(feature = "serde")]
impl Guard {
    /// The bound of the trace, and the counts. With a factored `P` there is no other state, because its run does not stop.
    pub fn saved(&self) -> (f64, Counts) {
        let counts = Counts {
            used: self.used,
            unused: self.unused,
            capped: self.capped,
            silent: self.silent,
        };
        (self.bound, counts)
    }

    /// The guards as they were saved.
    pub fn restored(guards: Guards, bound: f64, counts: Counts) -> Result<Self, Error> {
        // Rounding may put the trace above the cap, so the bound is used.
        let mut guard = Self::new(1.0)?;
        guard.set(guards, 0.0)?;
        let Counts {
            used,
            unused,
            capped,
            silent,
        } = counts;
        Ok(Self {
            bound,
            used,
            unused,
            capped,
            silent,
            ..guard
        })
    }
}

impl Guard {
    pub fn new(trace: f64) -> Result<Self, Error> {
        let guards = Guards {
            trace_limit: TRACE_LIMIT * trace,
            silent_below: 0.0,
        };
        guards.check(trace)?;
        Ok(Self {
            guards,
            bound: trace,
            limit: guards.cap(),
            silent_below_squared: 0.0,
            step: StepFactors::none(),
            failure: None,
            used: 0,
            unused: 0,
            capped: 0,
            silent: 0,
        })
    }

    pub fn set(&mut self, guards: Guards, trace: f64) -> Result<(), Error> {
        guards.check(trace)?;
        self.guards = guards;
        self.limit = guards.cap();
        let squared = guards.silent_below * guards.silent_below.abs();
        self.silent_below_squared = squared.min(MAX_PHI_SQUARED);
        Ok(())
    }

    pub fn restart(&mut self, trace: f64) -> Result<(), Error> {
        self.guards.check(trace)?;
        self.bound = trace;
        self.failure = None;
        Ok(())
    }

    pub fn running(&self) -> Result<(), Error> {
        self.failure.map_or(Ok(()), Err)
    }

    pub fn skip(&mut self, outcome: Outcome) -> Outcome {
        self.unused += 1;
        outcome
    }

    /// The step to make, or the reason why there is none.
    #[inline(always)]
    pub fn begin<M: Memory>(
        &mut self,
        phi: &[f64],
        dt: f64,
        weights: &Weights,
    ) -> Result<(StepFactors, Outcome), Outcome> {
        let eta = weights.eta();
        if self.failure.is_some() {
            return Err(self.skip(Outcome::Stopped));
        }
        if !self.step.matches(eta, dt) {
            match StepFactors::new(eta, dt) {
                Some(step) => self.step = step,
                None => return Err(self.skip(Outcome::BadStep)),
            }
        }
        let squared: f64 = phi.iter().map(|x| x * x).sum();
        if squared <= self.silent_below_squared {
            Ok((self.step.remembering(), Outcome::Silent))
        } else if squared <= MAX_PHI_SQUARED {
            if M::weak(squared, weights, self.limit) {
                Ok((self.step.remembering(), Outcome::Capped))
            } else {
                Ok((self.step, Outcome::Updated))
            }
        } else {
            Err(self.skip(Outcome::NotFinite))
        }
    }

    #[cold]
    pub fn refused(&mut self, refusal: Refusal) -> Outcome {
        match refusal {
            Refusal::NotFinite => self.skip(Outcome::NotFinite),
            Refusal::Stop(error) => {
                self.failure = Some(error);
                self.skip(Outcome::Stopped)
            }
        }
    }

    /// Counts a step that was made, and caps the trace. A `P` below the cap before the step and scaled down to it after
    /// has grown by less than `e^{eta h}`, as if less had been forgotten.
    #[inline(always)]
    pub fn grown<M: Memory, S: Capped>(
        &mut self,
        step: &StepFactors,
        outcome: Outcome,
        state: &mut S,
    ) -> Outcome {
        self.used += 1;
        self.silent += u64::from(outcome == Outcome::Silent);
        self.capped += u64::from(outcome == Outcome::Capped);
        self.bound = M::raised(self.bound, step, state.intensity());
        if self.bound > self.limit && self.capped(state) {
            Outcome::Capped
        } else {
            outcome
        }
    }

    #[cold]
    fn capped<S: Capped>(&mut self, state: &mut S) -> bool {
        let (trace, limit) = (state.trace(), self.limit);
        if trace > limit {
            state.scale(limit / trace);
            self.bound = limit;
            self.capped += 1;
            true
        } else {
            self.bound = trace;
            false
        }
    }

    pub fn health(&self, largest: f64, smallest_pivot: f64, trace: f64) -> Health {
        Health {
            excitation: 1.0 / largest,
            smallest_pivot,
            trace,
            used: self.used,
            unused: self.unused,
            capped: self.capped,
            silent: self.silent,
        }
    }
}
