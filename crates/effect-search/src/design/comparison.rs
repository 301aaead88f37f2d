//! Two fitted effects, and their responses in an experiment.

use std::collections::BTreeMap;

use ct_signals::{Record, range_of};
use estimation::{Noise, Start, Triangle, fit_from, linearise};
use greybox::{ModelSetup, PriorValue};

use super::limits::Bounds;
use super::separation::{information, least};
use super::{Experiment, InputSequenceKind, Kind, NoExperiment, Power, Reach, power};
use crate::Error;
use crate::fit::node::{Context, FINE, Node};

/// Both effects, and their results on the records.
pub(super) struct Comparison<'s, 'a> {
    context: &'s Context<'a>,
    nodes: &'s [Node; 2],
    noise: &'s Noise,
    /// Standard deviation of the innovations of each output.
    scales: Vec<f64>,
    /// R factor of the parameters of each model.
    known: [Triangle; 2],
    /// Simulations of the existing records by each model, without noise.
    simulated: [Vec<Record>; 2],
    /// `before[i]`: misfit of the other model to the response of model `i`.
    before: [f64; 2],
    /// Range of each output.
    visited: Vec<(f64, f64)>,
}

/// An output's range, missing samples aside.
fn range(values: &[f64]) -> (f64, f64) {
    range_of(values.iter().filter(|v| v.is_finite()))
}

fn joined(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0.min(b.0), a.1.max(b.1))
}

impl<'s, 'a> Comparison<'s, 'a> {
    pub fn new(
        context: &'s Context<'a>,
        nodes: &'s [Node; 2],
        noise: &'s Noise,
        scales: Vec<f64>,
    ) -> Result<Self, Error> {
        let records = &context.problem.records;
        let no_fit = |i: usize| {
            let last = nodes[i].added[nodes[i].added.len() - 1];
            let effect = context.candidates[last].id.clone();
            Error::from(NoExperiment::NoFit { effect })
        };
        let of = |i: usize| -> Result<(Triangle, Vec<Record>), Error> {
            let node = &nodes[i];
            let setup = context.setup(&node.model)?.with_scales(scales.clone());
            let rows = linearise(&setup, &node.fit.x, noise).ok_or_else(|| no_fit(i))?;
            let known = information(&rows, setup.free(), setup.parameter_count());
            let series = setup.simulate(&node.fit.x).ok_or_else(|| no_fit(i))?;
            let mut series = series.into_iter();
            let mut simulated = records.clone();
            for output in simulated.iter_mut().flat_map(|record| &mut record.outputs) {
                let model = series.next().unwrap_or_default();
                for (value, model) in output.values.iter_mut().zip(model) {
                    // Missing readings stay missing.
                    if !value.is_nan() {
                        *value = model;
                    }
                }
            }
            Ok((known, simulated))
        };
        let ((first, by_first), (second, by_second)) = (of(0)?, of(1)?);
        let outputs = 0..records[0].outputs.len();
        let visited = outputs.map(|o| {
            let ranges = records
                .iter()
                .map(|record| range(&record.outputs[o].values));
            ranges.fold((f64::INFINITY, f64::NEG_INFINITY), joined)
        });
        let mut comparison = Self {
            context,
            nodes,
            noise,
            scales,
            known: [first, second],
            visited: visited.collect(),
            simulated: [by_first, by_second],
            before: [0.0; 2],
        };
        for truth in 0..2 {
            comparison.before[truth] = comparison
                .misfit(truth, None)
                .ok_or_else(|| no_fit(1 - truth))?;
        }
        Ok(comparison)
    }

    pub fn scales(&self) -> &[f64] {
        &self.scales
    }

    /// Amount by which the criterion of each is below that of the other.
    pub fn ahead(&self) -> [f64; 2] {
        let ahead = self.nodes[0].gain_over(&self.nodes[1]);
        [ahead, -ahead]
    }

    /// A model with other records, outputs weighted by their noise, and priors of its parameters with the values of the true model.
    fn setup<'b>(
        &'b self,
        i: usize,
        truth: usize,
        records: &'b [Record],
    ) -> Option<ModelSetup<'b>> {
        let node = &self.nodes[i];
        let setup = self.context.setup(&node.model).ok()?;
        let setup = setup.with_records(records).ok()?;
        let mut priors: BTreeMap<String, PriorValue> = self.context.problem.priors.clone();
        let names = setup.names()[..setup.parameter_count()].to_vec();
        priors.retain(|name, _| names.contains(name));
        for (name, prior) in &mut priors {
            prior.value = self.nodes[truth].value(name).unwrap_or(prior.value);
        }
        let setup = setup.with_priors(&priors).ok()?;
        Some(setup.with_scales(self.scales.clone()))
    }

    /// A model's vector in an experiment: the initial states are those of the first record.
    fn vector(&self, i: usize) -> Vec<f64> {
        let spec = self.nodes[i].spec();
        let length = spec.parameters.len() + spec.states.len();
        self.nodes[i].fit.x[..length].to_vec()
    }

    /// Simulated record of an experiment, if one of the two models is true.
    fn simulated_record(
        &self,
        truth: usize,
        inputs: &[Vec<f64>],
        bounds: &Bounds,
    ) -> Option<Record> {
        let of = &self.context.problem.records[0];
        let zeros = vec![0.0; bounds.samples];
        let mut record = Record {
            name: "the experiment".to_string(),
            time: bounds.time(),
            inputs: of
                .inputs
                .iter()
                .zip(inputs)
                .map(|(of, values)| of.with_values(values.clone()))
                .collect(),
            outputs: of
                .outputs
                .iter()
                .map(|of| of.with_values(zeros.clone()))
                .collect(),
            ..Record::default()
        };
        let series = {
            let records = std::slice::from_ref(&record);
            let setup = self.setup(truth, truth, records)?;
            setup.simulate(&self.vector(truth))?
        };
        let finite = series.iter().flatten().all(|value| value.is_finite());
        for (output, values) in record.outputs.iter_mut().zip(series) {
            output.values = values;
        }
        finite.then_some(record)
    }

    /// An experiment, linearised.
    pub fn tried(
        &self,
        applied: Vec<InputSequenceKind>,
        inputs: &[Vec<f64>],
        bounds: &Bounds,
    ) -> Option<Experiment> {
        let shown = [
            self.simulated_record(0, inputs, bounds)?,
            self.simulated_record(1, inputs, bounds)?,
        ];
        let apart = |truth: usize| {
            let stand_in = 1 - truth;
            let records = std::slice::from_ref(&shown[truth]);
            let setup = self.setup(stand_in, truth, records)?;
            let rows = linearise(&setup, &self.vector(stand_in), self.noise)?;
            Some(least(&rows, &self.known[stand_in]) / self.scales[0].powi(2))
        };
        let power = power([apart(0)?, apart(1)?], self.ahead());
        let outputs = self.context.problem.records[0].outputs.iter().enumerate();
        let reaches = outputs.map(|(o, output)| {
            let of = |record: &Record| range(&record.outputs[o].values);
            let (low, high) = joined(of(&shown[0]), of(&shown[1]));
            Reach {
                output: output.name.clone(),
                low,
                high,
                visited_low: self.visited[o].0,
                visited_high: self.visited[o].1,
            }
        });
        let reaches: Vec<Reach> = reaches.collect();
        Some(Experiment {
            excursion: reaches.iter().map(Reach::excursion).fold(0.0, f64::max),
            inputs: applied,
            power,
            refitted: false,
            reaches,
        })
    }

    /// Misfit of the other model to one model's simulation of the existing records and of an experiment, after a refit.
    fn misfit(&self, truth: usize, experiment: Option<Record>) -> Option<f64> {
        let stand_in = 1 - truth;
        let mut records = self.simulated[truth].clone();
        let mut x = self.nodes[stand_in].fit.x.clone();
        if let Some(experiment) = experiment {
            records.push(experiment);
            let count = self.nodes[stand_in].spec().parameters.len();
            x.extend_from_slice(&self.vector(stand_in)[count..]);
        }
        let setup = self.setup(stand_in, truth, &records)?;
        let fit = fit_from(&setup, vec![Start::from(x)], self.noise, FINE).ok()?;
        Some(fit.cost)
    }

    /// The power of an experiment by refits.
    pub fn confirmed(&self, inputs: &[Vec<f64>], bounds: &Bounds) -> Option<Power> {
        let apart = |truth: usize| {
            let shown = self.simulated_record(truth, inputs, bounds)?;
            let misfit = self.misfit(truth, Some(shown))?;
            Some(((misfit - self.before[truth]) / self.scales[0].powi(2)).max(0.0))
        };
        Some(power([apart(0)?, apart(1)?], self.ahead()))
    }

    /// Repetition of the longest record's experiment.
    pub fn again(&self, bounds: &Bounds) -> Option<Experiment> {
        let records = &self.context.problem.records;
        let longest = records
            .iter()
            .max_by(|a, b| a.duration().total_cmp(&b.duration()))?;
        let own = Bounds {
            applied: bounds.applied.clone(),
            held: bounds.held.clone(),
            duration: longest.duration(),
            interval: bounds.interval,
            samples: longest.len(),
        };
        let inputs: Vec<Vec<f64>> = longest
            .inputs
            .iter()
            .map(|input| input.values.clone())
            .collect();
        let applied = longest.inputs.iter().map(|input| {
            let (low, high) = input.range();
            InputSequenceKind {
                input: input.name.clone(),
                kind: Kind::Again,
                low,
                high,
                clock: bounds.interval,
                levels: None,
            }
        });
        let mut experiment = self.tried(applied.collect(), &inputs, &own)?;
        experiment.power = self.confirmed(&inputs, &own)?;
        experiment.refitted = true;
        Some(experiment)
    }
}
