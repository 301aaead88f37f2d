//! Where the refinement starts: regressions over a grid of bandwidths and, for delays, over a grid that is made finer around the best.

use ct_lti::Polynomial;
use rayon::prelude::*;

use crate::model::Model;
use crate::problem::{Delayed, Problem, Refined};
use crate::{Error, Structure};

/// Regressions with instruments under a filter that stays, and iterations from there.
const THOROUGH: Effort = Effort {
    instruments: 1,
    iterations: 6,
    lower_orders: true,
};
/// The same on a grid of delays, where only the best point matters.
const ROUGH: Effort = Effort {
    instruments: 1,
    iterations: 3,
    lower_orders: false,
};
/// Points of the first grid of delays.
const POINTS: usize = 16;
/// A delay moves by this share of a step at least in one renewal, if it has to.
const REACH: f64 = 0.25;
/// Grids that are finer by this factor.
const FINER: f64 = 4.0;
const GRIDS: usize = 4;
/// A pole that is added lies at this over the step.
const FAST: f64 = 2.0;
/// Other points of the first grid that are starts too, beside no delay: where the order is high the rough comparison may miss the best.
const OTHERS: usize = 2;
/// Where a better delay is looked for, in steps from the one that was found.
const NEIGHBOURS: [f64; 8] = [2.0, 1.5, 1.0, 0.5, -0.5, -1.0, -1.5, -2.0];

/// How many passes a start is worth.
#[derive(Clone, Copy)]
struct Effort {
    instruments: usize,
    iterations: usize,
    lower_orders: bool,
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
    fn at_delays(
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
        if effort.lower_orders {
            starts.extend(self.of_lower_order(delays, largest, bandwidths));
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

    /// A start from the best plant of the next lower order, by one more pole that is fast: it fits as well, where starts of an order that the
    /// record does not carry may lead nowhere.
    fn of_lower_order(&self, delays: &[f64], largest: f64, bandwidths: &[f64]) -> Option<Start> {
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
        let starts = problem.at_delays(delays, largest, (bandwidths, THOROUGH));
        let (_, best) = starts.ok()?.into_iter().next()?;
        let model = best.with_pole(FAST / self.shortest_step(), &lower, self.structure);
        let delayed = self.delayed(delays, largest);
        self.follow(&delayed, model, None, THOROUGH.iterations)
            .ok()
            .flatten()
    }

    /// Starts, the best first; `delays` holds the known ones, and by how much a delay may move in one renewal comes back.
    pub(crate) fn starts(
        &self,
        delays: &[f64],
        bandwidths: &[f64],
    ) -> Result<(Vec<Start>, f64), Error> {
        let estimated: Vec<(usize, f64)> = self.structure.estimated_delays().collect();
        let mut delays = delays.to_vec();
        // All samples count here, as if the inputs had stood before the record: samples that are left out for the largest delay may hold
        // the only step.
        let largest = 0.0;
        let mut finest = 0.0_f64;
        let mut others: Vec<Vec<f64>> = Vec::new();
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
                let coarse: Vec<(f64, Result<Start, Error>)> = grid
                    .map(|i| {
                        let value = i as f64 * spacing;
                        let starts = self.at_delays(&at(value), largest, (&thinned, ROUGH));
                        (value, starts.map(|mut starts| starts.swap_remove(0)))
                    })
                    .collect();
                let square = |start: &Result<Start, Error>| match start {
                    Ok((square, _)) => *square,
                    Err(_) => f64::INFINITY,
                };
                let mut coarse = coarse;
                coarse.sort_by(|a, b| square(&a.1).total_cmp(&square(&b.1)));
                let next = coarse[1..].iter().take(OTHERS).map(|(value, _)| *value);
                others = next.chain([0.0]).map(at).collect();
                let (mut value, best) = coarse.swap_remove(0);
                let mut best = best?;
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
        let at = |delays: &[f64]| {
            let known = delays.iter().copied().fold(0.0, f64::max);
            self.at_delays(delays, known, (bandwidths, THOROUGH))
        };
        let mut starts = at(&delays)?;
        for other in &others {
            starts.extend(at(other).unwrap_or_default());
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
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
            self.follow(&delayed, model.clone(), found.noise.as_deref(), 3)
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
