//! The search among the sequences: all are linearised, and those with the largest predicted power are refitted.

use std::sync::atomic::{AtomicUsize, Ordering};

use ct_signals::Record;
use effect_search::design::{SUFFICIENT_POWER, Sequence, by_use, power, sequences};
use greybox::Triangle;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{
    INSTEAD, REFITS,
    limits::{Bounds, NoExperiment},
    plan::{Candidate, Reach, SecondSensor, Wider},
    separation::{Metric, information, linear, misfit_before, noise_free, refitted},
    simulated::{Loop, SimulatedExperiment, simulate_experiment},
};
use crate::{Error, Problem, Progress, base::time_limit::allow, fit::node::Node};

/// Experiments of a round of refits, and the most in all.
const ROUND: usize = 6;
const MOST_REFITS: usize = 30;
/// Number of sequences that are tried whatever the time limit is.
const FEWEST: usize = 2;
/// A sequence that drives a controller to a limit is slowed down so that it crosses its range in this number of time constants.
const SLOWER: [f64; 2] = [1.0, 4.0];
/// A level below this share of the highest one counts as empty.
const DRAINED: f64 = 1e-6;

/// Data of the search.
pub(crate) struct Search<'s, 'a> {
    pub problem: &'s Problem,
    pub nodes: &'s [Node<'a>; 2],
    pub metric: &'s Metric,
    pub into: Loop<'s>,
    /// Slowest time constant of the plant \[s\].
    pub time_constant: f64,
    pub progress: &'s (dyn Fn(Progress) + Sync),
}

/// Result of the search.
pub(crate) struct Found {
    pub candidates: Vec<Candidate>,
    pub overfull: usize,
    pub limited: usize,
    pub best: Candidate,
    /// The sequence of the best experiment.
    pub values: Vec<f64>,
    pub again: Option<Candidate>,
    pub wider: Option<Wider>,
    pub times_as_long: Option<usize>,
    pub second_sensor: Option<SecondSensor>,
}

/// A sequence and its predicted power.
pub(crate) type Tried = (Candidate, Sequence);

/// Information of each model from the records, and the distance of each from the other's simulation of them.
pub(crate) struct Before {
    pub known: [Triangle; 2],
    noise_free: [Vec<Record>; 2],
    /// `misfit[i]`: misfit of the other model to the response of model `i`.
    pub misfit: [f64; 2],
    /// Smallest and largest level of each vessel, for either model.
    levels: Vec<(f64, f64)>,
}

impl Search<'_, '_> {
    /// Criterion of the second model minus that of the first.
    pub fn ahead(&self) -> f64 {
        self.nodes[0].gain_over(&self.nodes[1])
    }

    /// Advantage of each model over the other.
    pub fn ahead_of_each(&self) -> [f64; 2] {
        [self.ahead(), -self.ahead()]
    }

    /// Whether a part has to be left out because of the time limit or a cancellation.
    pub fn leaves_out(&self, part: &str) -> bool {
        self.nodes[0].setup.leaves_out(part)
    }

    pub fn before(&self) -> Result<Before, Error> {
        let [a, b] = self.nodes;
        let noise_free = [noise_free(a)?, noise_free(b)?];
        let misfit = [
            misfit_before(&noise_free[0], a, b, self.metric)?,
            misfit_before(&noise_free[1], b, a, self.metric)?,
        ];
        let levels = [
            a.setup.simulate(&a.fit.x)?.level,
            b.setup.simulate(&b.fit.x)?.level,
        ];
        let either = |vessel: usize| {
            let [a, b] = levels.map(|level| level[vessel]);
            (a.0.min(b.0), a.1.max(b.1))
        };
        Ok(Before {
            levels: (0..self.problem.plant.vessels()).map(either).collect(),
            known: [information(a, self.metric), information(b, self.metric)],
            noise_free,
            misfit,
        })
    }

    pub fn simulated(&self, values: &[f64], interval: f64) -> Option<[SimulatedExperiment; 2]> {
        let on = |i: usize| {
            simulate_experiment(
                &self.nodes[i],
                &self.into,
                values,
                interval,
                self.time_constant,
            )
        };
        Some([on(0)?, on(1)?])
    }

    /// A sequence, linearised.
    pub fn tried(
        &self,
        sequence: &Sequence,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<Candidate> {
        let simulated = self.simulated(&sequence.values, bounds.interval)?;
        let of = |truth: usize| {
            let stand_in = 1 - truth;
            let (node, known) = (&self.nodes[stand_in], &before.known[stand_in]);
            linear(&simulated[truth], node, known, self.metric)
        };
        let plant = self.problem.plant;
        let reaches: Vec<Reach> = (0..plant.vessels())
            .map(|vessel| {
                let either = simulated
                    .each_ref()
                    .map(|simulated| simulated.levels[vessel]);
                let (low, high) = (either[0].0.min(either[1].0), either[0].1.max(either[1].1));
                Reach {
                    level: plant.level_name(vessel).to_string(),
                    // A tank that drains for a long time has a level below any reading.
                    low: if low.abs() < DRAINED * high.abs() {
                        0.0
                    } else {
                        low
                    },
                    high,
                }
            })
            .collect();
        let beyond = |(reach, &(low, high)): (&Reach, &(f64, f64))| {
            let outside = (low - reach.low).max(reach.high - high).max(0.0);
            outside / (high - low).max(f64::MIN_POSITIVE)
        };
        let excursions = reaches.iter().zip(&before.levels).map(beyond);
        Some(Candidate {
            excursion: excursions.fold(0.0, f64::max),
            at_limit: simulated.iter().any(|simulated| simulated.at_limit),
            kind: sequence.kind,
            low: sequence.low,
            high: sequence.high,
            clock: sequence.clock,
            levels: sequence.levels,
            draw: sequence.draw,
            slew: sequence.slew,
            power: power([of(0)?, of(1)?], self.ahead_of_each()),
            refitted: false,
            reaches,
        })
    }

    /// A sequence, linearised; slowed down if it would drive the controller to a limit.
    fn off_the_limits(
        &self,
        sequence: Sequence,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<Tried> {
        let first = self.tried(&sequence, bounds, before)?;
        let span = sequence.high - sequence.low;
        let time_constant = self.time_constant.min(bounds.duration);
        for slower in SLOWER.into_iter().filter(|_| first.at_limit) {
            let slew = span / (slower * time_constant);
            let sequence = sequence.slowed(slew, bounds.interval).ok()?;
            let candidate = self.tried(&sequence, bounds, before)?;
            if !candidate.at_limit {
                return Some((candidate, sequence));
            }
        }
        Some((first, sequence))
    }

    /// Candidates with the other model refitted; unchanged if the time limit is reached, because the error of an incomplete refit would
    /// count as power.
    pub fn confirmed(
        &self,
        (candidate, sequence): &Tried,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<Candidate> {
        let simulated = self.simulated(&sequence.values, bounds.interval)?;
        let of = |truth: usize| {
            refitted(
                &before.noise_free[truth],
                &simulated[truth],
                (&self.nodes[truth], &self.nodes[1 - truth]),
                before.misfit[truth],
                self.metric,
            )
            .ok()
        };
        let if_true = [of(0)?, of(1)?];
        if self.leaves_out("refits of experiments") {
            return Some(candidate.clone());
        }
        Some(Candidate {
            power: power(if_true, self.ahead_of_each()),
            refitted: true,
            ..candidate.clone()
        })
    }

    /// Whether a level would rise above the tank.
    fn overfills(&self, candidate: &Candidate) -> bool {
        let height = self.problem.known.tank_height.unwrap_or(f64::INFINITY);
        candidate.reaches.iter().any(|reach| reach.high > height)
    }

    /// Predicted power of all sequences within limits, linearised, the best first; and the number that would overfill a tank, or drive the
    /// controller to a limit.
    pub fn predictions(
        &self,
        bounds: &Bounds,
        seed: u64,
        before: &Before,
    ) -> Result<(Vec<Tried>, [usize; 2]), Error> {
        let mut all: Vec<(usize, Sequence)> = sequences(&bounds.room(), self.time_constant, seed)?
            .into_iter()
            .enumerate()
            .collect();
        // If the time does not suffice for all, a random selection is tried.
        all.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let (total, begun, done) = (all.len(), AtomicUsize::new(0), AtomicUsize::new(0));
        let mut tried: Vec<(usize, Tried)> = all
            .into_par_iter()
            .filter_map(|(place, sequence)| {
                let first = begun.fetch_add(1, Ordering::Relaxed) < FEWEST;
                if !first && self.leaves_out("some of the experiments") {
                    return None;
                }
                let tried = self.off_the_limits(sequence, bounds, before);
                (self.progress)(Progress {
                    phase: "trying experiments",
                    done: done.fetch_add(1, Ordering::Relaxed) + 1,
                    total,
                });
                Some((place, tried?))
            })
            .collect();
        tried.sort_by_key(|(place, _)| *place);
        let mut tried: Vec<Tried> = tried.into_iter().map(|(_, tried)| tried).collect();
        let finite = tried.len();
        tried.retain(|(candidate, _)| !self.overfills(candidate));
        let overfull = finite - tried.len();
        // At a limit the loop is open, and a fit of the loop is only approximate. If every sequence reaches a limit, this is accepted.
        let mut limited = tried.iter().filter(|(tried, _)| tried.at_limit).count();
        if limited < tried.len() {
            tried.retain(|(candidate, _)| !candidate.at_limit);
        } else {
            limited = 0;
        }
        sort(&mut tried);
        Ok((tried, [overfull, limited]))
    }

    /// Refits in rounds until the best experiment is a refitted one, so that no predicted power exceeds a confirmed one, as far as the time
    /// suffices.
    pub fn refit(&self, tried: &mut Vec<Tried>, bounds: &Bounds, before: &Before) {
        let mut done = 0;
        while done < MOST_REFITS
            && tried.first().is_some_and(|(first, _)| !first.refitted)
            && !self.leaves_out("refits of experiments")
        {
            let wanted: Vec<usize> = (0..tried.len())
                .filter(|&i| !tried[i].0.refitted)
                .take(ROUND)
                .collect();
            done += wanted.len();
            let confirmed: Vec<(usize, Option<Candidate>)> = wanted
                .into_par_iter()
                .map(|i| (i, self.confirmed(&tried[i], bounds, before)))
                .collect();
            // In reverse order, so that candidates without a refit can be removed.
            for (i, candidate) in confirmed.into_iter().rev() {
                match candidate {
                    Some(candidate) => tried[i].0 = candidate,
                    None => drop(tried.remove(i)),
                }
            }
            sort(tried);
            (self.progress)(Progress {
                phase: "confirming by refits",
                done: done.min(MOST_REFITS),
                total: MOST_REFITS,
            });
        }
        // After this number of rounds, the best refitted experiment is used.
        tried.sort_by_key(|(candidate, _)| !candidate.refitted);
    }

    pub fn run(&self, bounds: &Bounds, seed: u64) -> Result<Found, Error> {
        let before = self.before()?;
        // A misfit that is too large before the experiment would make that of the experiment too small.
        if self.nodes[0].setup.out_of_time() {
            return Err(NoExperiment::OutOfTime.into());
        }
        let (mut tried, [overfull, limited]) = self.predictions(bounds, seed, &before)?;
        let all_tried = !self.nodes[0].setup.out_of_time();
        allow(&self.nodes[0], REFITS);
        self.refit(&mut tried, bounds, &before);
        allow(&self.nodes[0], INSTEAD);
        if self.nodes[0].setup.stopped() {
            return Err(greybox::Error::Stopped.into());
        }
        let Some((best, sequence)) = tried.first().cloned() else {
            if !all_tried {
                return Err(NoExperiment::OutOfTime.into());
            }
            return Err(NoExperiment::Overfull {
                low: bounds.low,
                high: bounds.high,
                height: self.problem.known.tank_height.unwrap_or(f64::INFINITY),
            }
            .into());
        };
        let instead = || !self.leaves_out("what could be done instead");
        let again = instead().then(|| self.again(bounds, &before)).flatten();
        // With ample power no wider range is needed.
        let wider = if best.power.power < SUFFICIENT_POWER && instead() {
            self.wider(bounds, seed, &before)?
        } else {
            None
        };
        let longer = || self.times_as_long(&(best.clone(), sequence.clone()), bounds, &before);
        let times_as_long = instead().then(longer).flatten();
        let sensor = || self.second_sensor(&sequence, bounds, &before);
        let second_sensor = instead().then(sensor).flatten();
        Ok(Found {
            candidates: tried.into_iter().map(|(candidate, _)| candidate).collect(),
            overfull,
            limited,
            best,
            values: sequence.values,
            again,
            wider,
            times_as_long,
            second_sensor,
        })
    }
}

/// The best first.
fn sort(tried: &mut [Tried]) {
    tried.sort_by(|(a, _), (b, _)| by_use((&a.power, a.excursion), (&b.power, b.excursion)));
}
