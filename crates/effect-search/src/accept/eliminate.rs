//! Acceptance test: backward elimination of effects that the noise may explain as well.

use ct_signals::{ArModel, Record};
use estimation::{Fit, Noise, coloured};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::Error;
use crate::accept::partial::error_left;
use crate::fit::node::{Context, FINE, Node};

impl Context<'_> {
    /// Whether a set lowers the deviance significantly compared with one that lacks some of its effects: chi-square, corrected (Bonferroni)
    /// for all tried candidates and starts. A noise model of the lacking set with more coefficients imitates the effects: each of these
    /// coefficients counts as in Akaike's criterion.
    pub fn beyond_chance(&self, gained: (&Node, &Fit), lacking: (&Node, &Fit)) -> bool {
        let new = gained
            .0
            .added
            .iter()
            .filter(|i| !lacking.0.added.contains(i));
        let mut freedom = 0;
        let mut looks = 1.0;
        for &i in new {
            let candidate = &self.candidates[i];
            freedom += candidate.fitted().max(1);
            looks *= self.candidates.len() as f64 * (candidate.starts().len() as f64).max(1.0);
        }
        let freedom = freedom.max(gained.1.parameters.saturating_sub(lacking.1.parameters));
        let coefficients = |fit: &Fit| fit.noise.iter().map(ArModel::order).sum::<usize>();
        let more = coefficients(lacking.1).saturating_sub(coefficients(gained.1));
        let fall = lacking.1.deviance - gained.1.deviance + 2.0 * more as f64;
        let chance =
            ChiSquared::new(freedom.max(1) as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
        chance * looks < self.thresholds.false_claim
    }

    /// Backward elimination: removes effects that the noise explains as well, the least significant first. If the set contains a
    /// quantisation, the other effects have to be significant also when it is replaced by a smooth staircase.
    pub fn confirm(&self, mut node: Node, base: &Node, noise: &Noise) -> Result<Node, Error> {
        let mut smooth = self.smooth_rounding(&node, noise);
        loop {
            if self.limit.passed() {
                return self.confirm_by_sizes(node, base, noise);
            }
            let lacking = self.each_lacking(&node, base, noise);
            let is_chance = |lacking: &Node| {
                let without = |smooth: &Node| self.is_chance_in_smooth(smooth, lacking, noise);
                smooth.as_ref().and_then(without).unwrap_or(false)
            };
            let doubtful = lacking.into_iter().filter(|lacking| {
                node.gain_over(lacking) <= self.thresholds.bic_margin
                    || !self.beyond_chance((&node, &node.fit), (lacking, &lacking.fit))
                    || self.rests_on_few_readings(&node, lacking, noise)
                    || is_chance(lacking)
            });
            let Some(least) = doubtful.min_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic())) else {
                // Hard steps may fit single readings by chance.
                let is_smooth =
                    |smooth: &Node| node.gain_over(smooth) <= self.thresholds.bic_margin;
                return Ok(smooth.filter(is_smooth).unwrap_or(node));
            };
            smooth = smooth.and_then(|smooth| self.of_smooth(&smooth, &least, noise));
            node = least;
        }
    }

    /// Whether a set of a simulated loop is not better than one that lacks its effects if both are fitted on the measured inputs, with the noise
    /// model of the set's residual there. The noise that controllers feed back is taken out of the loop's residual by a linearised plant.
    /// Of a nonlinear plant a part remains, filtered by the dynamics of the model: an effect can imitate it, above all near a resonance.
    pub fn is_fed_back_noise(&self, node: &Node, lacking: &Node) -> bool {
        let Some(measured) = self.on_measured_inputs() else {
            return false;
        };
        let refits = measured.in_own_noise(node);
        let refits = refits.and_then(|own| {
            let refitted = |set: &Node| measured.refitted(set, &own.noise, FINE);
            Ok((refitted(node)?, refitted(lacking)?))
        });
        refits.is_ok_and(|(with, without)| {
            with.gain_over(&without) <= self.thresholds.bic_margin
                || !measured.beyond_chance((&with, &with.fit), (&without, &without.fit))
        })
    }

    /// Backward elimination without refits, if the time limit is reached: by the Wald statistic of each effect's sizes, which equals the
    /// fall of the deviance to first order. Sizes without a standard error say nothing.
    fn confirm_by_sizes(&self, mut node: Node, base: &Node, noise: &Noise) -> Result<Node, Error> {
        let context = Context {
            limit: self.limit.afterwards(),
            ..self.clone()
        };
        loop {
            let added = (base.added.len()..node.added.len()).filter_map(|position| {
                let (statistic, sizes) = self.wald(&node, position)?;
                let gain = statistic - sizes as f64 * self.samples().ln();
                (gain <= self.thresholds.bic_margin).then_some((position, gain))
            });
            let Some((least, _)) = added.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                return Ok(node);
            };
            node = context.without(&node, least, noise, FINE)?;
        }
    }

    /// Whether a set is better than one that lacks some of its effects because of a single reading: without it both sets, fitted again, are
    /// equally good. The same for functions of time and the beginnings of the records, where the unknown past of the inputs and states acts.
    fn rests_on_few_readings(&self, node: &Node, lacking: &Node, noise: &Noise) -> bool {
        let without = |node: &Node, records: &[Record]| {
            let setup = self.setup(&node.model).ok()?;
            let start = vec![node.fit.x.clone().into()];
            estimation::fit_from(&setup.against(records), start, noise, FINE).ok()
        };
        let Some(falls) = self.falls(node, lacking, noise) else {
            return false;
        };
        let outputs = self.problem.records[0].outputs.len();
        let new = node.added.iter().copied();
        let new: Vec<usize> = new.filter(|i| !lacking.added.contains(i)).collect();
        let in_time = self.in_time(&new) == new.len();
        let telling = [
            self.telling_reading(&falls, noise).map(|one| vec![one]),
            in_time.then(|| self.telling_beginning(&falls)).flatten(),
        ];
        telling.into_iter().flatten().any(|readings| {
            let mut records = self.problem.records.clone();
            for (series, row) in readings {
                records[series / outputs].outputs[series % outputs].values[row] = f64::NAN;
            }
            let (Some(with), Some(lacks)) = (without(node, &records), without(lacking, &records))
            else {
                return false;
            };
            lacks.bic() - with.bic() <= self.thresholds.bic_margin
                || !self.beyond_chance((node, &with), (lacking, &lacks))
        })
    }

    /// A partial explanation without the effects that depend on a single reading or hardly lower the simulation error; `None` if no effect stays
    /// that the criterion needs.
    pub fn without_small_effects(&self, mut node: Node, base: &Node) -> Option<Node> {
        let white = Noise::white(node.spec().outputs.len());
        while node.added.len() > base.added.len() {
            let lacking = self.each_lacking(&node, base, &white);
            let mut resting = lacking.into_iter().filter(|lacking| {
                node.gain_over(lacking) <= self.thresholds.bic_margin
                    || error_left(&lacking.fit, &node.fit) > self.thresholds.partial_error
                    || self.rests_on_few_readings(&node, lacking, &white)
            });
            let Some(less) = resting.next() else {
                return Some(node);
            };
            node = less;
        }
        None
    }

    /// The fall of the deviance at each reading of each series, from a set that lacks some effects to the one with them.
    fn falls(&self, node: &Node, lacking: &Node, noise: &Noise) -> Option<Vec<Vec<f64>>> {
        let whitened = |of: &Node| {
            let setup = self.setup(&of.model).ok()?;
            Some(noise.whiten(&estimation::residuals(&setup, &of.fit.x)?))
        };
        let (with, lacks) = (whitened(node)?, whitened(lacking)?);
        let scales = node.fit.scales();
        let falls = with
            .iter()
            .zip(&lacks)
            .enumerate()
            .map(|(s, (with, lacks))| {
                let scale = scales[s % scales.len()].powi(2);
                let rows = with.iter().zip(lacks);
                // A missing reading has no influence.
                rows.map(|(a, b)| (b * b - a * a) / scale)
                    .map(|fall| if fall.is_nan() { 0.0 } else { fall })
                    .collect::<Vec<f64>>()
            });
        Some(falls.collect())
    }

    /// The reading (series and row) that causes half or more of the fall of the deviance. With coloured noise, a reading affects as many rows
    /// after it as the noise model has coefficients.
    fn telling_reading(&self, falls: &[Vec<f64>], noise: &Noise) -> Option<(usize, usize)> {
        let all: f64 = falls.iter().flatten().sum();
        let rows = noise.order() + 1;
        let at_each = falls.iter().enumerate().flat_map(|(series, falls)| {
            let windows = (0..falls.len()).map(move |row| row..falls.len().min(row + rows));
            windows.map(move |window| (falls[window.clone()].iter().sum::<f64>(), series, window))
        });
        let (most, series, window) = at_each.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let row = window.max_by(|&a, &b| falls[series][a].total_cmp(&falls[series][b]))?;
        (most >= self.thresholds.telling_reading * all).then_some((series, row))
    }

    /// The readings (series and row) at the beginnings of the records, if they cause half or more of the fall of the deviance.
    fn telling_beginning(&self, falls: &[Vec<f64>]) -> Option<Vec<(usize, usize)>> {
        let rows = |falls: &Vec<f64>| (self.thresholds.beginning * falls.len() as f64) as usize;
        let all: f64 = falls.iter().flatten().sum();
        let first = falls.iter().flat_map(|falls| &falls[..rows(falls)]);
        if first.sum::<f64>() < self.thresholds.telling_reading * all {
            return None;
        }
        let of_each = falls.iter().enumerate();
        let readings =
            of_each.flat_map(|(series, falls)| (0..rows(falls)).map(move |row| (series, row)));
        Some(readings.collect())
    }

    /// The fit of a set with the noise model of its own residual.
    pub fn in_own_noise(&self, node: &Node) -> Result<Fit, Error> {
        let setup = self.setup(&node.model)?;
        Ok(coloured(
            &setup,
            node.fit.clone(),
            self.thresholds.noise_order,
            FINE,
        )?)
    }

    /// Standard deviation of the noise at each output, of a fit with a noise model of its own.
    pub fn noise_levels(&self, own: &Fit) -> Vec<f64> {
        let is_slow = self.is_slow(&own.noise);
        let level = |(noise, rmse): (&ArModel, &f64)| {
            // A short record does not determine the variance of slow disturbances; with a root near the unit circle, the variance of a noise
            // model is far from that of the residual.
            if is_slow {
                noise.sigma()
            } else {
                noise.stationary_std().min(*rmse).max(noise.sigma())
            }
        };
        own.noise.iter().zip(&own.rmse).map(level).collect()
    }

    /// The noise model of a set's residual, with a memory limited to a share of the longest record, because a root near one would absorb
    /// every slow effect. Also returns whether the memory had to be limited: then the residual may contain slow physics.
    pub fn noise_of(&self, node: &Node) -> Result<(Noise, bool), Error> {
        let setup = self.setup(&node.model)?;
        let noise = estimation::noise_of(&setup, &node.fit, self.thresholds.noise_order)?;
        let slow = self.slow_output(&noise).is_some();
        Ok((noise.with_memory_at_most(self.longest_memory()), slow))
    }

    /// The first output with a longer noise memory than a search accepts.
    pub fn slow_output(&self, noise: &Noise) -> Option<usize> {
        if self.longest_record() < self.thresholds.memory_times * self.thresholds.memory_limit {
            return None;
        }
        let longest = self.longest_memory().max(self.thresholds.memory_limit);
        let limited = noise.with_memory_at_most(longest);
        let mut pairs = noise.iter().zip(limited.iter());
        pairs.position(|(noise, limited)| noise != limited)
    }

    /// Whether the memory of a noise model is longer than a search accepts.
    pub fn is_slow(&self, noise: &Noise) -> bool {
        self.slow_output(noise).is_some()
    }

    /// The longest memory of a noise model for a search \[samples\].
    pub fn longest_memory(&self) -> f64 {
        self.thresholds.longest_memory * self.longest_record()
    }

    /// Rows of the longest record.
    fn longest_record(&self) -> f64 {
        let lengths = self.problem.records.iter().map(Record::len);
        lengths.max().unwrap_or(1) as f64
    }
}
