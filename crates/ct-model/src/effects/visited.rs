//! Ranges of the variables in the data, or in the simulation of the model without effects. Bounds and start values of effects follow from
//! these ranges.

use std::collections::BTreeMap;

use crate::expression::Variable;
use crate::simulation::{Model, NoSolution, Simulation};
use crate::spec::{ModelSpec, Output};

/// Number of stored quantiles of a signal, at equal distances.
const QUANTILES: usize = 101;

/// Values that differ by no more than this share of the width belong to one level of a signal.
const SAME_LEVEL: f64 = 0.01;

/// Range of the values of a variable, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
    /// Value in the first row.
    pub first: f64,
    /// Quantiles at equal distances from the smallest to the largest; empty where they are not known.
    pub quantiles: Vec<f64>,
}

impl Span {
    /// Range of values; values that are not finite are ignored. `None` if no value is finite.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let first = *sorted.first()?;
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len() - 1;
        let at = |k: usize| sorted[(k * last + (QUANTILES - 1) / 2) / (QUANTILES - 1)];
        Some(Self {
            low: sorted[0],
            high: sorted[last],
            first,
            quantiles: (0..QUANTILES).map(at).collect(),
        })
    }

    /// Width of the range. For a constant variable, its absolute value, or one if this is zero: a width is never zero.
    #[must_use]
    pub fn width(&self) -> f64 {
        let width = self.high - self.low;
        if width > 1e-12 * self.high.abs().max(self.low.abs()) {
            return width;
        }
        if self.high == 0.0 {
            1.0
        } else {
            self.high.abs()
        }
    }

    /// The quantile for this share.
    #[must_use]
    pub fn quantile(&self, share: f64) -> f64 {
        let Some(last) = self.quantiles.len().checked_sub(1) else {
            return self.low + share * (self.high - self.low);
        };
        let place = share.clamp(0.0, 1.0) * last as f64;
        let below = (0..last).take_while(|&k| (k + 1) as f64 <= place).count();
        let above = (below + 1).min(last);
        let (a, b) = (self.quantiles[below], self.quantiles[above]);
        a + (place - below as f64) * (b - a)
    }

    /// Places of a threshold: the quantiles for these shares. If a signal has no more levels than places, quantiles are levels themselves,
    /// and most of them the most frequent ones; then the places divide the distances between the levels.
    #[must_use]
    pub fn thresholds(&self, shares: &[f64]) -> Vec<f64> {
        let mut divided = self.levels();
        if !(2..=shares.len()).contains(&divided.len()) {
            return shares.iter().map(|share| self.quantile(*share)).collect();
        }
        let divide = |_: &f64| {
            let width = |k: usize| divided[k] - divided[k - 1];
            let wider = |&a: &usize, &b: &usize| width(a).total_cmp(&width(b)).then(b.cmp(&a));
            let widest = (1..divided.len()).max_by(wider).unwrap_or(1);
            let middle = 0.5 * (divided[widest - 1] + divided[widest]);
            divided.insert(widest, middle);
            middle
        };
        shares.iter().map(divide).collect()
    }

    /// Distinct quantiles in ascending order; one within [`SAME_LEVEL`] of the width above a level belongs to it.
    fn levels(&self) -> Vec<f64> {
        let mut levels: Vec<f64> = Vec::new();
        for &value in &self.quantiles {
            let apart = |level: &f64| value - level > SAME_LEVEL * self.width();
            if levels.last().is_none_or(apart) {
                levels.push(value);
            }
        }
        levels
    }

    /// Range of the magnitudes that are not zero.
    #[must_use]
    pub fn magnitudes(&self) -> Self {
        let (low, high) = (self.low.abs(), self.high.abs());
        let magnitudes = self.quantiles.iter().map(|value| value.abs());
        let mut quantiles: Vec<f64> = magnitudes.filter(|value| *value > 0.0).collect();
        quantiles.sort_by(f64::total_cmp);
        let around_zero = self.low < 0.0 && self.high > 0.0;
        let least = if around_zero { 0.0 } else { low.min(high) };
        Self {
            low: quantiles.first().copied().unwrap_or(least),
            high: low.max(high),
            first: self.first.abs(),
            quantiles,
        }
    }

    /// The range of both.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        let mut quantiles: Vec<f64> = self
            .quantiles
            .iter()
            .chain(&other.quantiles)
            .copied()
            .collect();
        quantiles.sort_by(f64::total_cmp);
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            first: self.first,
            quantiles,
        }
    }
}

/// Ranges of all variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Visited {
    /// Ranges of the known inputs, states and flows (including outputs); for others a range from zero to one is assumed.
    pub spans: BTreeMap<Variable, Span>,
    /// Begin of the records on the clock that `time` of the model follows \[its unit\].
    pub begin: f64,
    /// Time from the first row to the last \[unit of the model's time\].
    pub duration: f64,
    /// Between two rows \[unit of the model's time\].
    pub interval: f64,
    /// The unit of the model's time, as it is written: `s`, `h`.
    pub time_unit: String,
}

impl Visited {
    /// Default without data: a thousand rows with a step of one second; ranges from the bounds and values in the text.
    #[must_use]
    pub fn nominal(spec: &ModelSpec) -> Self {
        let of = |variable: Variable| {
            let about = spec.about(variable);
            let low = if about.min.is_finite() {
                about.min
            } else {
                0.0
            };
            let high = if about.max > low && about.max.is_finite() {
                about.max
            } else {
                low + 1.0
            };
            let span = Span {
                low,
                high,
                first: low,
                quantiles: Vec::new(),
            };
            (variable, span)
        };
        Self {
            spans: spec.variables().map(of).collect(),
            begin: 0.0,
            duration: 1000.0,
            interval: 1.0,
            time_unit: "s".to_string(),
        }
    }

    /// What a simulation visits at rows: `inputs` by row, held from row to row; `parameters` and `initial` as for [`Simulation::new`].
    ///
    /// # Errors
    /// Where the simulation cannot go on.
    ///
    /// # Panics
    /// Where the numbers of inputs, parameters or states are not the model's.
    pub fn of_simulation(
        spec: &ModelSpec,
        (parameters, initial): (&[f64], &[f64]),
        time: &[f64],
        inputs: &[Vec<f64>],
        time_unit: &str,
    ) -> Result<Self, NoSolution> {
        let mut shown = spec.clone();
        let all = Self::simulated(spec);
        let outputs = all.iter().map(|&variable| Output { variable });
        shown.outputs = outputs.collect();
        let model = Model::new(shown);
        let begin = time.first().copied().unwrap_or(0.0);
        let mut simulation = Simulation::new(&model, parameters, initial, begin);
        let mut values = vec![Vec::with_capacity(time.len()); all.len()];
        let mut row = vec![0.0; all.len()];
        for (k, now) in inputs.iter().enumerate().take(time.len()) {
            simulation.read(now, &mut row);
            for (values, value) in values.iter_mut().zip(&row) {
                values.push(*value);
            }
            if k + 1 < time.len() {
                simulation.advance(now, now, time[k + 1])?;
            }
        }
        let by_rows = |i: usize| inputs.iter().map(|row| row[i]).collect();
        let inputs = (0..spec.inputs.len()).map(by_rows).collect();
        let series = all.into_iter().zip(values).collect();
        Ok(Self::of_series(series, inputs, time, time_unit))
    }

    /// The variables of a simulation whose ranges are needed: states, then flows.
    #[must_use]
    pub fn simulated(spec: &ModelSpec) -> Vec<Variable> {
        let states = (0..spec.states.len()).map(Variable::State);
        let flows = (0..spec.flows.len()).map(Variable::Flow);
        states.chain(flows).collect()
    }

    /// Ranges of the series of a record: simulated variables, and inputs in their order. `time` \[the model's unit\] of the rows;
    /// `time_unit`: its name.
    #[must_use]
    pub fn of_series(
        series: Vec<(Variable, Vec<f64>)>,
        inputs: Vec<Vec<f64>>,
        time: &[f64],
        time_unit: &str,
    ) -> Self {
        let inputs = inputs.into_iter().enumerate();
        let spans = inputs.map(|(i, values)| (Variable::Input(i), values));
        let spans = spans.chain(series);
        let begin = time.first().copied().unwrap_or(0.0);
        let duration = time.last().copied().unwrap_or(begin) - begin;
        Self {
            spans: spans
                .filter_map(|(variable, values)| Some((variable, Span::of(&values)?)))
                .collect(),
            begin,
            duration: if duration > 0.0 { duration } else { 1.0 },
            interval: if time.len() > 1 && duration > 0.0 {
                duration / (time.len() - 1) as f64
            } else {
                1.0
            },
            time_unit: time_unit.to_string(),
        }
    }

    /// Joins the range of another record to this one.
    pub fn join(&mut self, other: &Self) {
        for (variable, span) in &other.spans {
            let joined = self.spans.get(variable).map(|own| own.joined(span));
            self.spans
                .insert(*variable, joined.unwrap_or_else(|| span.clone()));
        }
        let end = (self.begin + self.duration).max(other.begin + other.duration);
        self.begin = self.begin.min(other.begin);
        self.duration = end - self.begin;
        self.interval = self.interval.min(other.interval);
    }

    /// The range of a variable, from zero to one where it is not known.
    #[must_use]
    pub fn span(&self, variable: Variable) -> Span {
        self.spans.get(&variable).cloned().unwrap_or(Span {
            low: 0.0,
            high: 1.0,
            first: 0.0,
            quantiles: Vec::new(),
        })
    }
}
