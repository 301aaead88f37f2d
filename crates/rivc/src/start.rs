//! Where the refinement starts: regressions over a ladder of bandwidths and, for delays, over a grid that is made finer around the best.

use ct_lti::Polynomial;
use rayon::prelude::*;

use crate::Error;
use crate::model::Model;
use crate::problem::{Delayed, Problem};

/// Regressions with instruments under a filter that stays.
const INSTRUMENTS: usize = 2;
/// Refinements of each start.
const REFINEMENTS: usize = 6;
/// Points of the first grid of delays.
const POINTS: usize = 16;
/// Grids that are finer by this factor.
const FINER: f64 = 4.0;
const GRIDS: usize = 4;

/// A model and the mean square of its output error.
pub(crate) type Start = (f64, Model);

impl Problem<'_> {
    /// The bandwidths of the first filters \[1/time\], ascending: from 10 over the longest record's duration to half the sampling rate,
    /// three to a decade.
    pub(crate) fn bandwidths(&self) -> Vec<f64> {
        let duration = |time: &[f64]| time[time.len() - 1] - time[0];
        let lengths = self.records.iter().map(|r| duration(&r.time));
        let longest = lengths.fold(0.0, f64::max);
        let steps = self.records.iter().map(|r| duration(&r.time) / (r.len() - 1) as f64);
        let step = steps.fold(f64::INFINITY, f64::min);
        let (low, high) = (10.0 / longest, (0.5 / step).max(20.0 / longest));
        let rungs = (3.0 * (high / low).log10()).ceil().max(1.0);
        let at = |k: usize| low * (high / low).powf(k as f64 / rungs);
        (0..=rungs as usize).map(at).collect()
    }

    /// From one bandwidth; nothing where it leads to no stable plant.
    fn from_bandwidth(&self, delayed: &Delayed, bandwidth: f64) -> Option<Start> {
        let filter = Polynomial::new([bandwidth, 1.0]).ok()?.pow(self.structure.n);
        let solve = |model: Option<&Model>| -> Option<Model> {
            let solved = self.solve_with_filter(delayed, &filter, model).ok()?;
            solved.stabilised(self.structure).ok()
        };
        let mut model = solve(None)?;
        for _ in 0..INSTRUMENTS {
            let Some(next) = solve(Some(&model)) else {
                break;
            };
            model = next;
        }
        self.follow(delayed, model, REFINEMENTS).ok().flatten()
    }

    /// The best of the bandwidths, the best first, at these delays.
    pub(crate) fn at_delays(&self, delays: &[f64], largest: f64, bandwidths: &[f64]) -> Vec<Start> {
        let delayed = self.delayed(delays, largest);
        let starts = bandwidths.par_iter();
        let mut starts: Vec<Start> = starts
            .filter_map(|bandwidth| self.from_bandwidth(&delayed, *bandwidth))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts
    }

    /// Starts, the best first; `delays` holds the known ones, and the distance of the last grid's points comes back.
    pub(crate) fn starts(
        &self,
        delays: &[f64],
        bandwidths: &[f64],
    ) -> Result<(Vec<Start>, f64), Error> {
        let none = || Error::NoStart {
            tried: bandwidths.len(),
        };
        let estimated: Vec<(usize, f64)> = self.structure.estimated_delays().collect();
        let mut delays = delays.to_vec();
        let largest = self.structure.largest_delay();
        let mut finest = 0.0_f64;
        let rounds = if estimated.len() > 1 { 2 } else { 1 };
        for _ in 0..rounds {
            for (j, most) in &estimated {
                let spacing = most / POINTS as f64;
                let at = |value: f64| {
                    let mut delays = delays.clone();
                    delays[*j] = value;
                    delays
                };
                let grid = (0..=POINTS).into_par_iter();
                let coarse = grid.filter_map(|i| {
                    let value = i as f64 * spacing;
                    let starts = self.at_delays(&at(value), largest, bandwidths);
                    Some((value, starts.into_iter().next()?))
                });
                let (mut value, mut best) = coarse
                    .min_by(|a, b| a.1.0.total_cmp(&b.1.0))
                    .ok_or_else(none)?;
                let mut spacing = spacing;
                for _ in 0..GRIDS {
                    spacing /= FINER;
                    let offsets = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0];
                    let centre = value;
                    let finer = offsets.into_par_iter().filter_map(|offset| {
                        let value = centre + offset * spacing;
                        if !(0.0..=*most).contains(&value) {
                            return None;
                        }
                        let delayed = self.delayed(&at(value), largest);
                        let model = Model {
                            delays: delayed.delays.clone(),
                            ..best.1.clone()
                        };
                        let start = self.follow(&delayed, model, 3).ok()??;
                        Some((value, start))
                    });
                    if let Some((better, start)) = finer.min_by(|a, b| a.1.0.total_cmp(&b.1.0))
                        && start.0 < best.0
                    {
                        (value, best) = (better, start);
                    }
                }
                delays[*j] = value;
                finest = finest.max(2.0 * spacing);
            }
        }
        let known = delays.iter().copied().fold(0.0, f64::max);
        let starts = self.at_delays(&delays, known, bandwidths);
        if starts.is_empty() {
            return Err(none());
        }
        Ok((starts, finest))
    }
}
