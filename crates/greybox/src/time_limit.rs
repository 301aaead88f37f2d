//! Time limit of a search that consists of many fits.
//!
//! A fit whose setup has a limit that has passed takes no further steps and ends where it is
//! ([`Stop::Evaluations`](crate::Stop::Evaluations)); of several starts only the first is followed. So results depend on the speed of the
//! machine where a limit is reached, and nowhere else.

use std::sync::{
    Mutex,
    atomic::{AtomicU64, Ordering},
};
use std::time::{Duration, Instant};

/// Time limit that a search moves from phase to phase, and the steps that were left out because of it.
#[derive(Debug)]
pub struct TimeLimit {
    begun: Instant,
    whole: Option<Duration>,
    /// Microseconds after `begun`; `u64::MAX` means no limit.
    until: AtomicU64,
    left_out: Mutex<Vec<String>>,
}

impl TimeLimit {
    /// A limit for a search that begins now; `None`: without limit.
    #[must_use]
    pub fn new(whole: Option<Duration>) -> Self {
        let limit = Self {
            begun: Instant::now(),
            whole,
            until: AtomicU64::new(u64::MAX),
            left_out: Mutex::default(),
        };
        limit.allow(1.0);
        limit
    }

    /// The same limit, which began at the same time, for a search that begins again: nothing is left out.
    #[must_use]
    pub fn begun_again(&self) -> Self {
        let limit = Self::new(self.whole);
        Self {
            begun: self.begun,
            ..limit
        }
    }

    /// Allows work until this share of the whole time has passed since the beginning.
    pub fn allow(&self, share: f64) {
        let until = self.whole.map_or(u64::MAX, |whole| {
            u64::try_from(whole.mul_f64(share).as_micros()).unwrap_or(u64::MAX)
        });
        self.until.store(until, Ordering::Relaxed);
    }

    /// Whether the allowed time has passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        let until = self.until.load(Ordering::Relaxed);
        until != u64::MAX && self.begun.elapsed().as_micros() >= u128::from(until)
    }

    /// Time since the beginning.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Notes a step of the search that was left out or cut short; each step is noted once.
    pub fn leave_out(&self, part: &str) {
        let mut left_out = match self.left_out.lock() {
            Ok(left_out) => left_out,
            Err(poisoned) => poisoned.into_inner(),
        };
        if !left_out.iter().any(|known| known == part) {
            left_out.push(part.to_string());
        }
    }

    /// Steps that were left out, in order.
    #[must_use]
    pub fn left_out(&self) -> Vec<String> {
        match self.left_out.lock() {
            Ok(left_out) => left_out.clone(),
            Err(poisoned) => poisoned.into_inner().clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_passes_and_can_be_moved() {
        let limit = TimeLimit::new(Some(Duration::from_secs(3600)));
        assert!(!limit.passed());
        limit.allow(0.0);
        assert!(limit.passed());
        limit.allow(0.5);
        assert!(!limit.passed());
        let none = TimeLimit::new(None);
        none.allow(0.0);
        assert!(!none.passed());
    }

    #[test]
    fn what_is_left_out_is_kept_once_and_in_order() {
        let limit = TimeLimit::new(None);
        for part in ["pairs", "places", "pairs"] {
            limit.leave_out(part);
        }
        assert_eq!(limit.left_out(), ["pairs", "places"]);
    }
}
