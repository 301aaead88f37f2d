//! Whether a fitted set of effects is credible: sizes inside their bounds, physical levels, and predicted features of the readings that are
//! visible in the record.

use ct_signals::Channel;
use plants::{Outlet, Placed};

use crate::fit::node::{Node, transfer};

/// A level above the largest reading by this factor is not physical if the height of the tanks is not known, ...
const HIGHEST: f64 = 100.0;
/// ... and one this many times that height where the height is known: a small error of an area shifts levels that are not measured.
const ABOVE_RIM: f64 = 1.5;

/// A sensor at the end of its range: the reading counts as increasing further from this correlation with the level on, over this number of
/// samples.
const LIMIT: &str = "sensor_saturation";
const RISES: f64 = 0.5;
const BEYOND: usize = 50;

/// A modelled reading has a drop if it falls by this share of the effect's step within this number of samples.
const DROPS: &str = "sensor_hysteresis";
const FALLEN: f64 = 0.7;
const DURATION: usize = 6;
/// The record does not show these drops if the measured reading, less the model without the effect, falls by less than this share of them
/// in all, and the noise of that sum is smaller than the drops by this factor.
const SEEN: f64 = 0.5;
const CLEAR: f64 = 4.0;

/// A value closer to a bound than this share of the range is at the bound.
const EDGE: f64 = 1e-6;

impl Node<'_> {
    /// Whether the size of every added effect is inside its plausible range, neither absent nor at the far end, and every level is
    /// physical.
    pub fn plausible(&self) -> bool {
        !self.added.iter().any(|placed| self.at_the_edge(*placed)) && self.credible()
    }

    /// Whether no added effect is absent, and every level is physical. While other effects are missing, a size may reach its far bound
    /// because it compensates for them.
    pub fn possible(&self) -> bool {
        let absent = |placed: &Placed| {
            self.size_of(*placed).is_some_and(|(size, at)| {
                (self.fit.x[at] - size.absent).abs() <= EDGE * (size.upper - size.lower)
            })
        };
        !self.added.iter().any(absent) && self.credible()
    }

    /// Whether the effects' consequences for levels and readings are physical and visible in the records.
    fn credible(&self) -> bool {
        self.physical() && !self.reads_beyond_limit() && !self.drops_unseen()
    }

    /// The reading still rises with the level although the model is at the sensor's limit: then the limit is not real.
    fn reads_beyond_limit(&self) -> bool {
        let structure = &self.setup.structure;
        let Some(placed) = self.added.iter().find(|placed| placed.effect.id == LIMIT) else {
            return false;
        };
        let unlimited = || {
            let setup = self
                .setup
                .with_structure(structure.without(placed.effect))
                .ok()?;
            let level = self.of_output(
                *placed,
                setup.simulate(&transfer(self, &setup)).ok()?.output,
            );
            let residual = self.of_output(*placed, self.setup.residuals(&self.fit.x).ok()?);
            let limit = self.fit.x[self.size_of(*placed)?.1];
            let beyond: Vec<(f64, f64)> = level
                .concat()
                .into_iter()
                .zip(residual.concat())
                .filter(|(level, residual)| *level > limit && !residual.is_nan())
                .collect();
            (beyond.len() >= BEYOND).then(|| correlation(&beyond))
        };
        unlimited().is_some_and(|correlation| correlation > RISES)
    }

    /// Whether no level is above the tank's rim, if it is known, or far above the readings.
    fn physical(&self) -> bool {
        let structure = &self.setup.structure;
        if structure.plant.outlet() != Outlet::Torricelli {
            return true;
        }
        let readings = self.setup.measured().map(Channel::range);
        let highest = readings.fold(0.0, |most: f64, (low, high)| {
            most.max(low.abs()).max(high.abs())
        });
        let most = structure
            .known
            .tank_height
            .map_or(HIGHEST * highest, |height| ABOVE_RIM * height.max(highest));
        self.setup.simulate(&self.fit.x).is_ok_and(|simulated| {
            let levels = &simulated.level[..structure.plant.vessels()];
            levels.iter().all(|(_, high)| *high <= most)
        })
    }

    /// Whether the modelled reading has steps at instants at which the measured reading has no step.
    fn drops_unseen(&self) -> bool {
        let Some(placed) = self.added.iter().find(|placed| placed.effect.id == DROPS) else {
            return false;
        };
        let unseen = || {
            let step = self.fit.x[self.size_of(*placed)?.1];
            let structure = self.setup.structure.without(placed.effect);
            let setup = self.setup.with_structure(structure).ok()?;
            let with = self.of_output(*placed, self.setup.simulate(&self.fit.x).ok()?.output);
            let without = self.of_output(
                *placed,
                setup.simulate(&transfer(self, &setup)).ok()?.output,
            );
            let (mut predicted, mut seen, mut noise, mut events, mut count) = (0.0, 0.0, 0.0, 0, 0);
            for ((with, without), record) in with.iter().zip(&without).zip(self.setup.records) {
                let added: Vec<f64> = with.iter().zip(without).map(|(a, b)| a - b).collect();
                let rest: Vec<f64> = record.outputs[placed.vessel]
                    .interpolated()
                    .iter()
                    .zip(without)
                    .map(|(y, model)| y - model)
                    .collect();
                noise += rest
                    .windows(2)
                    .map(|pair| (pair[1] - pair[0]).powi(2))
                    .sum::<f64>();
                count += rest.len();
                let mut k = 0;
                while k + DURATION < added.len() {
                    let end = k + DURATION;
                    if added[end] - added[k] > -FALLEN * step {
                        k += 1;
                        continue;
                    }
                    predicted += added[end] - added[k];
                    seen += rest[end] - rest[k];
                    events += 1;
                    k = end;
                }
            }
            let noise = (noise / count.max(1) as f64).sqrt() * f64::from(events).sqrt();
            (events > 0 && -predicted > CLEAR * noise).then_some(seen > SEEN * predicted)
        };
        unseen().unwrap_or(false)
    }

    /// From the series of each record and output, those of the output at which an effect acts.
    fn of_output(&self, placed: Placed, series: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let own = series.into_iter().skip(placed.vessel);
        own.step_by(self.setup.outputs()).collect()
    }

    /// The size of an added effect is absent or at the far end of its plausible range.
    pub fn at_the_edge(&self, placed: Placed) -> bool {
        let Some((leading, at)) = self.size_of(placed) else {
            return false;
        };
        let room = EDGE * (leading.upper - leading.lower);
        let size = self.fit.x[at];
        size <= leading.lower + room || size >= leading.upper - room
    }
}

fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (a, b) = pairs
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xx += (x - a) * (x - a);
        yy += (y - b) * (y - b);
        xy += (x - a) * (y - b);
    }
    xy / (xx * yy).sqrt().max(f64::MIN_POSITIVE)
}
