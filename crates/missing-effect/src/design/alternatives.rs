//! Alternatives to an experiment: the same again, repetitions, a wider range, or a second sensor.

use super::{
    experiments::{Before, Search, Tried},
    limits::Bounds,
    plan::{Candidate, SecondSensor, Wider},
    second_sensor,
    simulated::Loop,
};
use crate::Error;
use effect_search::design::{Kind, Power, Prospect, Sequence, power, prospect, times_as_long};

/// Largest useful number of repetitions of an experiment.
const MOST_TIMES: f64 = 20.0;

impl Search<'_, '_> {
    /// Number of repetitions after which the experiment decides, if it does.
    pub fn times_as_long(
        &self,
        (best, sequence): &Tried,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<usize> {
        let times = times_as_long(&best.power, self.ahead_of_each())?.ceil();
        let times = (times <= MOST_TIMES).then_some(times as usize)?;
        let longer = sequence.repeated(times, &bounds.room()).ok()?;
        let tried = self.tried(&longer, bounds, before)?;
        (prospect(&tried.power) == Prospect::Decides && !tried.at_limit).then_some(times)
    }

    /// Result of a wider range.
    pub fn wider(
        &self,
        bounds: &Bounds,
        seed: u64,
        before: &Before,
    ) -> Result<Option<Wider>, Error> {
        let in_loop = matches!(self.into, Loop::Closed(_));
        let Some(wider) = bounds.wider(self.problem, in_loop) else {
            return Ok(None);
        };
        let (mut predicted, _) = self.predictions(&wider, seed, before)?;
        predicted.sort_by(|(a, _), (b, _)| b.power.power.total_cmp(&a.power.power));
        let best = predicted
            .first()
            .and_then(|best| self.confirmed(best, &wider, before));
        // The best of a few random experiments does not represent the range.
        let best = best.filter(|_| !self.leaves_out("a wider range"));
        Ok(best.map(|best| Wider {
            low: wider.low,
            high: wider.high,
            best,
        }))
    }

    /// What the longest record had, once more.
    pub fn again(&self, bounds: &Bounds, before: &Before) -> Option<Candidate> {
        let records = self.problem.records.iter();
        let record = records.max_by_key(|record| record.len())?;
        let applied = match (&self.into, record.references.first()) {
            (Loop::Closed(_), Some(reference)) => reference,
            _ => &record.inputs[0],
        };
        let (low, high) = applied.range();
        let sequence = Sequence {
            kind: Kind::Again,
            clock: bounds.interval,
            levels: None,
            draw: None,
            slew: None,
            low,
            high,
            values: applied.values.clone(),
        };
        let tried = self.tried(&sequence, bounds, before)?;
        let tried = (tried, sequence);
        self.confirmed(&tried, bounds, before).or(Some(tried.0))
    }

    pub fn second_sensor(
        &self,
        best: &Sequence,
        bounds: &Bounds,
        before: &Before,
    ) -> Option<SecondSensor> {
        let plant = self.problem.plant;
        let vessel = second_sensor::place(&self.nodes[0].setup.structure)?;
        let simulated = self.simulated(&best.values, bounds.interval)?;
        let existing = |truth: usize| {
            let [truth, other] = [&self.nodes[truth], &self.nodes[1 - truth]];
            second_sensor::in_existing(truth, other, self.metric)
        };
        let experiment = |truth: usize| {
            let (node, other) = (&self.nodes[truth], &self.nodes[1 - truth]);
            let known = &before.known[1 - truth];
            second_sensor::in_experiment(&simulated[truth], node, other, known, self.metric)
        };
        // Repeated records have not decided anything before: the criteria differ only by the penalty of a parameter.
        let [a, b] = self.nodes.each_ref().map(|node| node.fit.penalty);
        let fewer = b - a;
        let fresh = |if_true: [f64; 2]| -> Power { power(if_true, [fewer, -fewer]) };
        Some(SecondSensor {
            level: plant.level_name(vessel).to_string(),
            existing_without: fresh(before.misfit.map(|misfit| misfit / self.metric.variance())),
            existing_with: fresh([existing(0)?, existing(1)?]),
            best_with: power([experiment(0)?, experiment(1)?], self.ahead_of_each()),
        })
    }
}
