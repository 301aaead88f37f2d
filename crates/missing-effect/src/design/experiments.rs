//! The search among the sequences: all of them linearised, the most promising refitted.

use std::sync::atomic::{AtomicUsize, Ordering};

use ct_signals::Record;
use greybox::Triangle;
use rayon::prelude::*;

use super::{
    limits::{Bounds, Refused},
    plan::{Candidate, Power, Reach, SecondSensor},
    play::{Loop, Played, play},
    power::power,
    second_sensor,
    separation::{Metric, imagined, information, linear, misfit_before, refitted},
    sequences::{Kind, Sequence, sequences},
};
use crate::{Error, Problem, Progress, search::Node};

/// Experiments of a round of refits, and the most in all.
const ROUND: usize = 6;
const MOST_REFITS: usize = 24;

/// What the search needs to know.
pub(crate) struct Search<'s, 'a> {
    pub problem: &'s Problem,
    pub nodes: &'s [Node<'a>; 2],
    pub metric: &'s Metric,
    pub into: Loop<'s>,
    /// The slowest of the plant \[s\].
    pub time_constant: f64,
    pub progress: &'s (dyn Fn(Progress) + Sync),
}

/// What it finds.
pub(crate) struct Found {
    pub candidates: Vec<Candidate>,
    pub overfull: usize,
    pub best: Candidate,
    /// The best one's sequence.
    pub values: Vec<f64>,
    pub again: Option<Candidate>,
    pub wider: Option<Candidate>,
    pub second_sensor: Option<SecondSensor>,
}

/// A sequence and what it promises.
type Tried = (Candidate, Sequence);

/// What each node knows from the records, and how far each is from the other's simulation of them.
struct Before {
    known: [Triangle; 2],
    imagined: [Vec<Record>; 2],
    /// `misfit[i]`: of the other to what `i` imagines.
    misfit: [f64; 2],
}

impl Search<'_, '_> {
    /// By how much the criterion of the second is above that of the first.
    pub fn ahead(&self) -> f64 {
        self.nodes[0].gain_over(&self.nodes[1])
    }

    /// By how much each is ahead of the other.
    pub fn ahead_of_each(&self) -> [f64; 2] {
        [self.ahead(), -self.ahead()]
    }

    fn before(&self) -> Result<Before, Error> {
        let [a, b] = self.nodes;
        let imagined = [imagined(a)?, imagined(b)?];
        let misfit = [
            misfit_before(&imagined[0], b, self.metric)?,
            misfit_before(&imagined[1], a, self.metric)?,
        ];
        Ok(Before {
            known: [information(a), information(b)],
            imagined,
            misfit,
        })
    }

    fn played(&self, values: &[f64], interval: f64) -> Option<[Played; 2]> {
        let on = |i: usize| {
            play(
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
    fn tried(&self, sequence: &Sequence, bounds: &Bounds, before: &Before) -> Option<Candidate> {
        let played = self.played(&sequence.values, bounds.interval)?;
        let of = |truth: usize| {
            let stand_in = 1 - truth;
            let (node, known) = (&self.nodes[stand_in], &before.known[stand_in]);
            linear(&played[truth], node, known, self.metric)
        };
        let plant = self.problem.plant;
        let reaches = (0..plant.vessels())
            .map(|vessel| {
                let either = played.each_ref().map(|played| played.levels[vessel]);
                Reach {
                    level: plant.level_name(vessel).to_string(),
                    low: either[0].0.min(either[1].0),
                    high: either[0].1.max(either[1].1),
                }
            })
            .collect();
        Some(Candidate {
            kind: sequence.kind,
            low: sequence.low,
            high: sequence.high,
            clock: sequence.clock,
            levels: sequence.levels,
            draw: sequence.draw,
            power: power([of(0)?, of(1)?], self.ahead_of_each()),
            refitted: false,
            reaches,
        })
    }

    /// The same, the other refitted.
    fn confirmed(
        &self,
        (candidate, sequence): &Tried,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<Candidate> {
        let played = self.played(&sequence.values, bounds.interval)?;
        let of = |truth: usize| {
            refitted(
                &before.imagined[truth],
                &played[truth],
                &self.nodes[1 - truth],
                before.misfit[truth],
                self.metric,
            )
            .ok()
        };
        Some(Candidate {
            power: power([of(0)?, of(1)?], self.ahead_of_each()),
            refitted: true,
            ..candidate.clone()
        })
    }

    /// It would lead a level above the tank.
    fn overfills(&self, candidate: &Candidate) -> bool {
        let height = self.problem.known.tank_height.unwrap_or(f64::INFINITY);
        candidate.reaches.iter().any(|reach| reach.high > height)
    }

    /// All sequences within limits, linearised, the best first; and how many would overfill a tank.
    fn promises(
        &self,
        bounds: &Bounds,
        seed: u64,
        before: &Before,
    ) -> Result<(Vec<Tried>, usize), Error> {
        let all = sequences(bounds, self.time_constant, seed)?;
        let (total, done) = (all.len(), AtomicUsize::new(0));
        let mut tried: Vec<Tried> = all
            .into_par_iter()
            .filter_map(|sequence| {
                let candidate = self.tried(&sequence, bounds, before);
                (self.progress)(Progress {
                    phase: "trying experiments",
                    done: done.fetch_add(1, Ordering::Relaxed) + 1,
                    total,
                });
                Some((candidate?, sequence))
            })
            .collect();
        let finite = tried.len();
        tried.retain(|(candidate, _)| !self.overfills(candidate));
        let overfull = finite - tried.len();
        sort(&mut tried);
        Ok((tried, overfull))
    }

    /// Refits in rounds until no promise is above what a refit has shown.
    fn refit(&self, tried: &mut [Tried], bounds: &Bounds, before: &Before) {
        let mut done = 0;
        while done < MOST_REFITS {
            let best = tried
                .iter()
                .filter(|(candidate, _)| candidate.refitted)
                .map(|(candidate, _)| candidate.power.power)
                .fold(f64::NEG_INFINITY, f64::max);
            let mut wanted: Vec<usize> = (0..tried.len())
                .filter(|&i| !tried[i].0.refitted && tried[i].0.power.power > best)
                .take(ROUND)
                .collect();
            if done == 0 {
                // Of every kind the most promising, whatever the straight line says of it.
                for kind in [Kind::Step, Kind::Staircase, Kind::Binary, Kind::MultiLevel] {
                    wanted.extend(tried.iter().position(|(tried, _)| tried.kind == kind));
                }
                wanted.sort_unstable();
                wanted.dedup();
            }
            if wanted.is_empty() {
                break;
            }
            done += wanted.len();
            let confirmed: Vec<(usize, Option<Candidate>)> = wanted
                .into_par_iter()
                .map(|i| (i, self.confirmed(&tried[i], bounds, before)))
                .collect();
            let mut any = false;
            for (i, candidate) in confirmed {
                if let Some(candidate) = candidate {
                    tried[i].0 = candidate;
                    any = true;
                }
            }
            (self.progress)(Progress {
                phase: "confirming by refits",
                done: done.min(MOST_REFITS),
                total: MOST_REFITS,
            });
            if !any {
                break;
            }
        }
        sort(tried);
    }

    pub fn run(&self, bounds: &Bounds, seed: u64) -> Result<Found, Error> {
        let before = self.before()?;
        let (mut tried, overfull) = self.promises(bounds, seed, &before)?;
        self.refit(&mut tried, bounds, &before);
        let Some((best, sequence)) = tried.first().cloned() else {
            return Err(Refused::Overfull {
                low: bounds.low,
                high: bounds.high,
                height: self.problem.known.tank_height.unwrap_or(f64::INFINITY),
            }
            .into());
        };
        let again = self.again(bounds, &before);
        let wider = match bounds.wider(self.problem, matches!(self.into, Loop::Closed(_))) {
            Some(wider) => {
                let (promised, _) = self.promises(&wider, seed, &before)?;
                let first = promised.first();
                first.and_then(|best| self.confirmed(best, &wider, &before))
            }
            None => None,
        };
        let second_sensor = self.second_sensor(&sequence, bounds, &before);
        Ok(Found {
            candidates: tried.into_iter().map(|(candidate, _)| candidate).collect(),
            overfull,
            best,
            values: sequence.values,
            again,
            wider: wider.filter(|wider| wider.power.power > 0.0),
            second_sensor,
        })
    }

    /// What the longest record played, once more.
    fn again(&self, bounds: &Bounds, before: &Before) -> Option<Candidate> {
        let records = self.problem.records.iter();
        let record = records.max_by_key(|record| record.len())?;
        let played = match (&self.into, &record.reference) {
            (Loop::Closed(_), Some(reference)) => reference,
            _ => &record.input,
        };
        let (low, high) = played.range();
        let sequence = Sequence {
            kind: Kind::Again,
            clock: bounds.interval,
            levels: None,
            draw: None,
            low,
            high,
            values: played.values.clone(),
        };
        let tried = self.tried(&sequence, bounds, before)?;
        let tried = (tried, sequence);
        self.confirmed(&tried, bounds, before).or(Some(tried.0))
    }

    fn second_sensor(
        &self,
        best: &Sequence,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<SecondSensor> {
        let plant = self.problem.plant;
        if plant.vessels() < 2 {
            return None;
        }
        let played = self.played(&best.values, bounds.interval)?;
        let existing = |truth: usize| {
            let [truth, other] = [&self.nodes[truth], &self.nodes[1 - truth]];
            second_sensor::in_existing(truth, other, self.metric)
        };
        let experiment = |truth: usize| {
            let (node, other) = (&self.nodes[truth], &self.nodes[1 - truth]);
            let known = &before.known[1 - truth];
            second_sensor::in_experiment(&played[truth], node, other, known, self.metric)
        };
        // Records that were recorded anew have decided nothing yet: what is ahead is what a parameter costs.
        let [a, b] = self.nodes.each_ref().map(|node| node.fit.parameters as f64);
        let fewer = (b - a) * (self.nodes[0].setup.samples() as f64).ln();
        let fresh = |if_true: [f64; 2]| -> Power { power(if_true, [fewer, -fewer]) };
        Some(SecondSensor {
            level: plant.level_name(0).to_string(),
            existing_without: fresh(before.misfit.map(|misfit| misfit / self.metric.variance)),
            existing_with: fresh([existing(0)?, existing(1)?]),
            best_with: power([experiment(0)?, experiment(1)?], self.ahead_of_each()),
        })
    }
}

/// What a refit has shown first, then what is promised; the best first.
fn sort(tried: &mut [Tried]) {
    tried.sort_by(|(a, _), (b, _)| {
        b.refitted
            .cmp(&a.refitted)
            .then(b.power.power.total_cmp(&a.power.power))
    });
}
