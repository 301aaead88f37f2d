//! Estimation of delays: a grid that is refined around the best point, and neighbours that may fit better with another noise model. The
//! grid is searched on the beginning of long records, if the inputs change there as much as later: it only has to find the right minimum.
//!
//! The grid is searched on the beginning of long records, if the inputs move there as they do later: it only has to find the right minimum.

use rayon::prelude::*;

use crate::Error;
use crate::iterate::Refined;
use crate::loop_model::Scale;
use crate::model::Model;
use crate::prepared::Prepared;
use crate::problem::Problem;
use crate::start::{ROUGH, Start};

/// Points of the first grid of delays.
const POINTS: usize = 16;
/// A delay changes by at least this share of a step in one iteration, if its update is larger.
const REACH: f64 = 0.25;
/// Grids that are finer by this factor.
const FINER: f64 = 4.0;
const GRIDS: usize = 4;
/// Number of other grid points that are also starts, in addition to zero delay: for high orders the rough comparison may miss the best
/// point.
const OTHERS: usize = 2;
/// Distances of neighbouring delays from the estimate, in steps.
const NEIGHBOURS: [f64; 8] = [2.0, 1.5, 1.0, 0.5, -0.5, -1.0, -1.5, -2.0];

/// Rows of each record on which the grid is searched.
const ROWS: usize = 4000;
/// The first rows are enough if each input varies there by this share of its variation in the whole record.
const LIKE_ALL: f64 = 0.5;

/// The beginnings of the records, where they are long and their beginnings like the rest.
pub(crate) fn beginnings(records: &[Prepared]) -> Option<Vec<Prepared>> {
    if records.iter().all(|record| record.len() <= ROWS) {
        return None;
    }
    let beginnings: Vec<Prepared> = records
        .iter()
        .map(|record| record.first_rows(ROWS))
        .collect();
    let mut pairs = beginnings.iter().zip(records);
    let alike = pairs.all(|(part, all)| {
        let mut inputs = part.inputs.iter().zip(&all.inputs);
        let share = |record: &Prepared| record.readings_from(0) as f64 / record.len() as f64;
        share(part) >= LIKE_ALL * share(all)
            && inputs.all(|(part, all)| Scale::of(part).size >= LIKE_ALL * Scale::of(all).size)
    });
    alike.then_some(beginnings)
}

impl Problem<'_> {
    /// Start values of the delays, the best first, and the largest change of a delay in one iteration. `delays` contains the known ones.
    ///
    /// # Errors
    /// As [`Problem::at_delays`].
    pub(crate) fn search_delays(
        &self,
        delays: &[f64],
        bandwidths: &[f64],
    ) -> Result<(Vec<Vec<f64>>, f64), Error> {
        let estimated: Vec<(usize, f64)> = self.structure.estimated_delays().collect();
        let mut delays = delays.to_vec();
        // All samples are used here, with inputs assumed constant before the record: the samples that are left out for the largest delay
        // may contain the only step.
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
                let mut coarse: Vec<(f64, Result<Start, Error>)> = grid
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
        let mut candidates = vec![delays];
        candidates.extend(others);
        Ok((candidates, finest))
    }

    /// Searches for better delays near those of a model, by the whitened output error with a common noise model: each interval between
    /// samples has a separate minimum, and the noise's spectrum decides which is the lowest. Returns the best model, if one is better.
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
