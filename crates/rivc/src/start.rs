//! Start values of the refinement: regressions over a grid of bandwidths, and plants of lower order.

use ct_lti::Polynomial;
use rayon::prelude::*;

use crate::model::Model;
use crate::problem::{Delayed, Problem};
use crate::{Error, Structure};

/// Regressions with instruments and a constant filter, followed by iterations.
const THOROUGH: Effort = Effort {
    instruments: 1,
    iterations: 6,
};
/// Effort on a grid of delays, where only the best point matters.
pub(crate) const ROUGH: Effort = Effort {
    instruments: 1,
    iterations: 3,
};
/// An added pole has this value divided by the step.
const FAST: f64 = 2.0;

/// Number of passes for a start.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    instruments: usize,
    iterations: usize,
}

/// A model and the mean square of its output error.
pub(crate) type Start = (f64, Model);

impl Problem<'_> {
    /// The bandwidths of the first filters \[1/time\], ascending: from 10 over the longest record's duration to half the sampling rate,
    /// three per decade.
    pub(crate) fn bandwidths(&self) -> Vec<f64> {
        let duration = |time: &[f64]| time[time.len() - 1] - time[0];
        let lengths = self.records.iter().map(|r| duration(&r.time));
        let longest = lengths.fold(0.0, f64::max);
        let step = self.shortest_step();
        let (low, high) = (10.0 / longest, (0.5 / step).max(20.0 / longest));
        let rungs = (3.0 * (high / low).log10()).ceil().max(1.0);
        let at = |k: usize| low * (high / low).powf(k as f64 / rungs);
        (0..=rungs as usize).map(at).collect()
    }

    /// The mean step of the record with the shortest one.
    pub(crate) fn shortest_step(&self) -> f64 {
        let steps = self.records.iter().map(|r| {
            let last = r.len() - 1;
            (r.time[last] - r.time[0]) / last as f64
        });
        steps.fold(f64::INFINITY, f64::min)
    }

    /// Start from one bandwidth; none if it does not lead to a stable plant.
    fn of_bandwidth(
        &self,
        delayed: &Delayed,
        bandwidth: f64,
        effort: Effort,
    ) -> Result<Option<Start>, Error> {
        let filter = Polynomial::new([bandwidth, 1.0])?.pow(self.structure.n);
        let solve = |model: Option<&Model>| -> Result<Model, Error> {
            let solved = self.solve_with_filter(delayed, &filter, model)?;
            solved.stabilised(self.structure)
        };
        let mut model = solve(None)?;
        for _ in 0..effort.instruments {
            let Ok(next) = solve(Some(&model)) else {
                break;
            };
            model = next;
        }
        self.follow(delayed, model, None, effort.iterations)
    }

    /// Starts from all bandwidths, the best first, at these delays.
    ///
    /// # Errors
    /// [`Error::NoStart`]; what every bandwidth says alike.
    pub(crate) fn at_delays(
        &self,
        delays: &[f64],
        largest: f64,
        (bandwidths, effort): (&[f64], Effort),
    ) -> Result<Vec<Start>, Error> {
        let delayed = self.delayed(delays, largest);
        let tried = bandwidths.par_iter();
        let found: Vec<Result<Option<Start>, Error>> = tried
            .map(|bandwidth| self.of_bandwidth(&delayed, *bandwidth, effort))
            .collect();
        let mut starts = Vec::new();
        let mut undetermined = None;
        let mut others = 0;
        for found in found {
            match found {
                Ok(Some(start)) => starts.push(start),
                Err(error @ Error::NotDetermined { .. }) => undetermined = Some(error),
                _ => others += 1,
            }
        }
        if starts.is_empty() {
            return Err(match undetermined {
                Some(error) if others == 0 => error,
                _ => Error::NoStart {
                    tried: bandwidths.len(),
                },
            });
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(starts)
    }

    /// A start from the best plant of the next lower order, by one more pole that is fast: it fits as well, where starts of an order that
    /// the record does not carry may lead nowhere.
    fn of_lower_order(&self, delays: &[f64], bandwidths: &[f64]) -> Option<Start> {
        let n = self.structure.n.checked_sub(1).filter(|n| *n > 0)?;
        let lower = Structure {
            n,
            m: self.structure.m.iter().map(|m| (*m).min(n)).collect(),
            ..self.structure.clone()
        };
        let problem = Problem {
            structure: &lower,
            records: self.records,
        };
        let largest = delays.iter().copied().fold(0.0, f64::max);
        let own = problem.at_delays(delays, largest, (bandwidths, THOROUGH));
        let own = own.into_iter().flatten().next();
        let lowest = problem.of_lower_order(delays, bandwidths);
        let (_, best) = own
            .into_iter()
            .chain(lowest)
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let model = best.with_pole(FAST / self.shortest_step(), &lower, self.structure);
        let delayed = self.delayed(delays, largest);
        let found = self.follow(&delayed, model, None, THOROUGH.iterations);
        found.ok().flatten()
    }

    /// Starts from plants of lower order at each of these delays, the best first.
    pub(crate) fn starts_of_lower_orders(
        &self,
        candidates: &[Vec<f64>],
        bandwidths: &[f64],
    ) -> Vec<Start> {
        let starts = candidates.iter();
        let mut starts: Vec<Start> = starts
            .filter_map(|delays| self.of_lower_order(delays, bandwidths))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts
    }

    /// Starts at each of these delays, the best first.
    ///
    /// # Errors
    /// Of the first of them, as [`Problem::at_delays`].
    pub(crate) fn starts(
        &self,
        candidates: &[Vec<f64>],
        bandwidths: &[f64],
    ) -> Result<Vec<Start>, Error> {
        let mut starts = Vec::new();
        for (i, delays) in candidates.iter().enumerate() {
            let known = delays.iter().copied().fold(0.0, f64::max);
            match self.at_delays(delays, known, (bandwidths, THOROUGH)) {
                Ok(found) => starts.extend(found),
                Err(error) if i == 0 => return Err(error),
                Err(_) => {}
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(starts)
    }
}
