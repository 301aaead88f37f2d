//! Where the refinement starts: regressions over a ladder of bandwidths and, for delays, over a grid that is made finer around the best.

use ct_lti::Polynomial;
use rayon::prelude::*;

use crate::Error;
use crate::model::Model;
use crate::problem::{Delayed, Problem, Refined};

/// Regressions with instruments under a filter that stays, and refinements of each start.
const THOROUGH: Effort = Effort {
    instruments: 1,
    refinements: 6,
};
/// The same on a grid of delays, where only the best point matters.
const ROUGH: Effort = Effort {
    instruments: 1,
    refinements: 3,
};
/// Points of the first grid of delays.
const POINTS: usize = 16;
/// A delay moves by this share of a step at least in one renewal, if it has to.
const REACH: f64 = 0.25;
/// Grids that are finer by this factor.
const FINER: f64 = 4.0;
const GRIDS: usize = 4;
/// Where a better delay is looked for, in steps from the one that was found.
const NEIGHBOURS: [f64; 8] = [2.0, 1.5, 1.0, 0.5, -0.5, -1.0, -1.5, -2.0];

/// How many passes a start is worth.
#[derive(Clone, Copy)]
struct Effort {
    instruments: usize,
    refinements: usize,
}

/// A model and the mean square of its output error.
pub(crate) type Start = (f64, Model);

impl Problem<'_> {
    /// The bandwidths of the first filters \[1/time\], ascending: from 10 over the longest record's duration to half the sampling rate,
    /// three to a decade.
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

    /// From one bandwidth; nothing where it leads to no stable plant.
    fn of_bandwidth(&self, delayed: &Delayed, bandwidth: f64, effort: Effort) -> Option<Start> {
        let filter = Polynomial::new([bandwidth, 1.0])
            .ok()?
            .pow(self.structure.n);
        let solve = |model: Option<&Model>| -> Option<Model> {
            let solved = self.solve_with_filter(delayed, &filter, model).ok()?;
            solved.stabilised(self.structure).ok()
        };
        let mut model = solve(None)?;
        for _ in 0..effort.instruments {
            let Some(next) = solve(Some(&model)) else {
                break;
            };
            model = next;
        }
        self.follow(delayed, model, None, effort.refinements)
            .ok()
            .flatten()
    }

    /// The best of the bandwidths, the best first, at these delays.
    fn at_delays(
        &self,
        delays: &[f64],
        largest: f64,
        (bandwidths, effort): (&[f64], Effort),
    ) -> Vec<Start> {
        let delayed = self.delayed(delays, largest);
        let starts = bandwidths.par_iter();
        let mut starts: Vec<Start> = starts
            .filter_map(|bandwidth| self.of_bandwidth(&delayed, *bandwidth, effort))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts
    }

    /// Starts, the best first; `delays` holds the known ones, and by how much a delay may move in one renewal comes back.
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
        let thinned: Vec<f64> = bandwidths.iter().copied().step_by(2).collect();
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
                    let starts = self.at_delays(&at(value), largest, (&thinned, ROUGH));
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
                        let start = self.follow(&delayed, model, None, 3).ok()??;
                        Some((value, start))
                    });
                    if let Some((better, start)) = finer.min_by(|a, b| a.1.0.total_cmp(&b.1.0))
                        && start.0 < best.0
                    {
                        (value, best) = (better, start);
                    }
                }
                delays[*j] = value;
                finest = finest.max(2.0 * spacing).max(REACH * self.shortest_step());
            }
        }
        let known = delays.iter().copied().fold(0.0, f64::max);
        let starts = self.at_delays(&delays, known, (bandwidths, THOROUGH));
        if starts.is_empty() {
            return Err(none());
        }
        Ok((starts, finest))
    }

    /// Delays about those of a model, whose whitened output error is compared under one model of the noise: each stretch between samples
    /// has a minimum of its own, and which is the lowest depends on the noise's spectrum. The best model, where one is better.
    pub(crate) fn better_delay(&self, found: &Refined) -> Option<Model> {
        let step = self.shortest_step();
        let largest =
            found.model.delays.iter().copied().fold(0.0, f64::max) + NEIGHBOURS[0].abs() * step;
        let square = |model: &Model| {
            let delayed = self.delayed(&model.delays, largest);
            self.follow(&delayed, model.clone(), found.noise.as_ref(), 3)
                .ok()?
        };
        let (own, _) = square(&found.model)?;
        let estimated: Vec<(usize, f64)> = self.structure.estimated_delays().collect();
        let mut candidates = Vec::new();
        for (j, most) in estimated {
            for offset in NEIGHBOURS {
                let mut model = found.model.clone();
                model.delays[j] += offset * step;
                if (0.0..=most).contains(&model.delays[j]) {
                    candidates.push(model);
                }
            }
        }
        let tried = candidates.par_iter().filter_map(square);
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 < own).then_some(best.1)
    }
}
