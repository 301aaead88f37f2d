//! A model of its user's text against records: the vector that is fitted, its bounds, its starts.
//!
//! The fitted vector holds the parameters in the order of the text, then for every record the initial values of the states. Time is that
//! of the records, in units of the model's time: `der()` is per such a unit. Inputs are held from row to row, or run in straight lines, as
//! their channels say; an output of a row is read with the inputs of that row.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ct_model::{About, Dual, Given, Model, Simulation, Variable};
use ct_signals::{Hold, Record};
use estimation::{Fit, Noise, Prior, Residuals, Robust, Sample, Start, within};

use crate::{Error, FitOptions, PriorValue, TimeLimit, clock::Clock, output_noise::output_noise};

/// A model, the records, and which parameters are free.
#[derive(Debug, Clone)]
pub struct ModelSetup<'a> {
    model: &'a Model,
    records: &'a [Record],
    /// Seconds in one unit of the model's time.
    time_unit: f64,
    clock: Clock,
    names: Vec<String>,
    /// Where fits begin; fixed entries stay there.
    start: Vec<f64>,
    bounds: Vec<(f64, f64)>,
    free: Vec<usize>,
    samples: Vec<usize>,
    floors: Vec<f64>,
    priors: Vec<Prior>,
    known_scales: Option<Vec<f64>>,
    time_limit: Option<Arc<TimeLimit>>,
    interrupt: Option<&'a AtomicBool>,
}

/// Where the text sets no bound a parameter stays within this factor of its value there, ...
const REACH: f64 = 30.0;
/// ... and an initial state within this one.
const STATE_REACH: f64 = 300.0;
/// Rounds in which outputs are weighted anew by their noise.
const WEIGHTINGS: usize = 3;
/// Scales of the noise have settled when none changes by more than this share.
const SETTLED: f64 = 0.02;

/// Bounds of the text, and where it has none a factor of the value there: a fit that runs away says nothing. Nothing bounds a value of zero.
fn bounds_of(about: &About, value: f64, factor: f64) -> (f64, f64) {
    let reach = if value == 0.0 {
        f64::INFINITY
    } else {
        factor * value.abs()
    };
    let low = if about.min.is_finite() {
        about.min
    } else {
        -reach
    };
    let high = if about.max.is_finite() {
        about.max
    } else {
        reach
    };
    (low, high)
}

/// Samples of each output in all records, missing ones aside.
fn samples_of(records: &[Record], outputs: usize) -> Vec<usize> {
    let present = |o: usize| {
        let outputs = records.iter().map(move |record| &record.outputs[o]);
        outputs.map(|y| y.values.len() - y.missing()).sum()
    };
    (0..outputs).map(present).collect()
}

impl<'a> ModelSetup<'a> {
    /// A model against records whose channels are those of the model, in its order; the parameters of `known` have these values and are not
    /// fitted. `time_unit`: seconds in one unit of the model's time.
    ///
    /// # Errors
    /// Where there is no record, a record is not sound, lacks samples of an input or has another number of channels, or `known` names a
    /// parameter that there is not.
    pub fn new(
        model: &'a Model,
        records: &'a [Record],
        known: &BTreeMap<String, f64>,
        time_unit: f64,
    ) -> Result<Self, Error> {
        let spec = model.spec();
        if records.is_empty() {
            return Err(Error::NoRecord);
        }
        for record in records {
            record.validate()?;
            record.require_whole_inputs()?;
            if record.outputs.len() != spec.outputs.len() {
                return Err(Error::Outputs {
                    record: record.name.clone(),
                    given: record.outputs.len(),
                    needed: spec.outputs.len(),
                });
            }
            if record.inputs.len() != spec.inputs.len() {
                return Err(Error::Inputs {
                    record: record.name.clone(),
                    given: record.inputs.len(),
                    needed: spec.inputs.len(),
                });
            }
        }
        let mut names: Vec<String> = Vec::new();
        let mut start = model.parameters();
        let mut bounds = Vec::new();
        let mut free = Vec::new();
        for (i, parameter) in spec.parameters.iter().enumerate() {
            let given = known.get(&parameter.about.name);
            if let Some(value) = given {
                start[i] = *value;
            }
            if parameter.given == Given::Fitted && given.is_none() {
                free.push(i);
            }
            names.push(parameter.about.name.clone());
            bounds.push(bounds_of(&parameter.about, parameter.value, REACH));
        }
        if let Some(name) = known.keys().find(|name| !names.contains(name)) {
            return Err(Error::UnknownParameter {
                name: name.clone(),
                known: names.join(", "),
            });
        }
        let starts = model.starts(&start);
        for (r, record) in records.iter().enumerate() {
            for (i, state) in spec.states.iter().enumerate() {
                let about = &state.about;
                if !state.fixed {
                    free.push(names.len());
                }
                names.push(if records.len() > 1 {
                    format!("{}(0), record {}", about.name, r + 1)
                } else {
                    format!("{}(0)", about.name)
                });
                // Where an output reads the state, the record knows better.
                let read = spec
                    .outputs
                    .iter()
                    .position(|o| o.variable == Variable::State(i));
                let first = read.and_then(|o| record.outputs[o].present().next());
                let guess = first.filter(|_| !state.fixed).unwrap_or(starts[i]);
                let largest = guess.abs().max(starts[i].abs());
                bounds.push(bounds_of(about, largest, STATE_REACH));
                start.push(within(guess, bounds[bounds.len() - 1]));
            }
        }
        let outputs = 0..spec.outputs.len();
        let all = |o: usize| records.iter().map(move |record| &record.outputs[o]);
        let floor = |o| {
            let ranges = all(o).map(ct_signals::Channel::range);
            let range = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
            let width = range.map_or(0.0, |(low, high)| high - low);
            if spec.outputs.len() > 1 {
                1e-6 * width
            } else {
                0.0
            }
        };
        Ok(Self {
            samples: samples_of(records, spec.outputs.len()),
            floors: outputs.map(floor).collect(),
            clock: Clock::of(records),
            model,
            records,
            time_unit,
            names,
            start,
            bounds,
            free,
            priors: Vec::new(),
            known_scales: None,
            time_limit: None,
            interrupt: None,
        })
    }

    /// The same with a limit: once it has passed, or `interrupt` is set, fits take no further steps.
    #[must_use]
    pub fn with_time_limit(self, limit: Arc<TimeLimit>, interrupt: Option<&'a AtomicBool>) -> Self {
        Self {
            time_limit: Some(limit),
            interrupt,
            ..self
        }
    }

    /// The same with what is known of parameters beside the records.
    ///
    /// # Errors
    /// Where the model has no parameter of a name, or a value or its standard error cannot be.
    pub fn with_priors(mut self, priors: &BTreeMap<String, PriorValue>) -> Result<Self, Error> {
        let parameters = &self.names[..self.parameter_count()];
        self.priors = super::setup::priors_of(priors, parameters, &self.bounds)?;
        Ok(self)
    }

    /// The same model and clock against other records, every parameter fixed at its value in a fitted vector: initial states are fitted.
    ///
    /// # Errors
    /// As [`ModelSetup::new`].
    pub fn held_out<'b>(&self, records: &'b [Record], x: &[f64]) -> Result<ModelSetup<'b>, Error>
    where
        'a: 'b,
    {
        let count = self.parameter_count();
        let known = self.names[..count].iter().cloned();
        let known: BTreeMap<String, f64> = known.zip(x.iter().copied()).collect();
        let mut setup = ModelSetup::new(self.model, records, &known, self.time_unit)?;
        setup.clock = self.clock.with_records(records);
        Ok(setup.limited_as(self))
    }

    /// The same model, clock and fitted parameters against other records, without priors.
    ///
    /// # Errors
    /// As [`ModelSetup::new`].
    pub fn with_records<'b>(&self, records: &'b [Record]) -> Result<ModelSetup<'b>, Error>
    where
        'a: 'b,
    {
        let known = self.known();
        let mut setup = ModelSetup::new(self.model, records, &known, self.time_unit)?;
        setup.clock = self.clock.with_records(records);
        Ok(setup.limited_as(self))
    }

    /// Parameters that are not fitted.
    pub(crate) fn known(&self) -> BTreeMap<String, f64> {
        let fixed = (0..self.parameter_count()).filter(|i| !self.free.contains(i));
        fixed
            .map(|i| (self.names[i].clone(), self.start[i]))
            .collect()
    }

    /// The same with the limits of another one.
    pub(crate) fn limited_as(self, other: &ModelSetup<'a>) -> Self {
        Self {
            time_limit: other.time_limit.clone(),
            interrupt: other.interrupt,
            ..self
        }
    }

    /// The records.
    pub(crate) fn records(&self) -> &'a [Record] {
        self.records
    }

    /// Seconds in one unit of the model's time.
    pub(crate) fn time_unit(&self) -> f64 {
        self.time_unit
    }

    /// Positions of the entries that are fitted.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// Names of the vector's entries.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// How many entries are parameters.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.model.spec().parameters.len()
    }

    /// Where fits begin.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// The same of which only these of its fitted entries are fitted.
    #[must_use]
    pub fn with_free(&self, only: &[usize]) -> Self {
        let mut setup = self.clone();
        setup.free.retain(|i| only.contains(i));
        setup
    }

    /// The same with the standard deviation of each output's noise known: outputs count by them, and not by their residuals.
    #[must_use]
    pub fn with_scales(self, scales: Vec<f64>) -> Self {
        Self {
            known_scales: Some(scales),
            ..self
        }
    }

    /// Standard deviation of the noise of each output as a linear prediction from the past leaves it, which what the model lacks hardly enters;
    /// that of the residual where there are too few samples. `None` where the simulation cannot go on.
    #[must_use]
    pub fn output_noise(&self, x: &[f64]) -> Option<Vec<f64>> {
        let simulated = self.simulate(x)?;
        let noise = output_noise(self.records, &simulated);
        let residual = |o: usize| {
            let outputs = self.records.iter().map(|record| &record.outputs[o]);
            let series = simulated.iter().skip(o).step_by(self.outputs());
            let pairs = outputs
                .zip(series)
                .flat_map(|(y, m)| y.values.iter().zip(m));
            let squares: f64 = pairs
                .filter(|(y, _)| !y.is_nan())
                .map(|(y, m)| (y - m).powi(2))
                .sum();
            (squares / self.samples[o].max(1) as f64).sqrt()
        };
        let all = noise.into_iter().enumerate();
        Some(
            all.map(|(o, noise)| noise.unwrap_or_else(|| residual(o)))
                .collect(),
        )
    }

    /// Instants of a record's rows on the clock of the model \[unit of the model's time\].
    #[must_use]
    pub fn model_time(&self, record: usize) -> Vec<f64> {
        let time = &self.records[record].time;
        let begin = self.clock.begins[record] / self.time_unit;
        time.iter()
            .map(|t| begin + (t - time[0]) / self.time_unit)
            .collect()
    }

    /// How many outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.samples.len()
    }

    /// Samples of each output, missing ones aside.
    pub(crate) fn samples_per_output(&self) -> &[usize] {
        &self.samples
    }

    /// Bounds of an entry.
    pub(crate) fn bound(&self, i: usize) -> (f64, f64) {
        self.bounds[i]
    }

    /// An entry is the initial value of a state that an output reads.
    pub(crate) fn is_read(&self, i: usize) -> bool {
        let spec = self.model.spec();
        i.checked_sub(self.parameter_count()).is_some_and(|i| {
            let state = Variable::State(i % spec.states.len());
            spec.is_output(state)
        })
    }

    /// The first rows of every record, a share of each.
    pub(crate) fn first_rows(&self, share: f64) -> Vec<Record> {
        let first = |record: &Record| {
            let rows = (share * record.len() as f64).ceil() as usize;
            record.rows(0..rows.clamp(1, record.len()))
        };
        self.records.iter().map(first).collect()
    }

    /// The same model, entries and starts against other records of the same number, outputs and time.
    #[must_use]
    pub fn against<'b>(&self, records: &'b [Record]) -> ModelSetup<'b>
    where
        'a: 'b,
    {
        ModelSetup {
            records,
            samples: samples_of(records, self.outputs()),
            ..self.clone()
        }
    }

    /// Fits from many starts. Of several outputs each counts by its noise, which is what the past of its residual does not explain: where the
    /// model fails at one output, that does not make the others' readings worth more.
    ///
    /// # Errors
    /// Where no start gives a finite simulation.
    pub fn fit(&self, options: &FitOptions) -> Result<Fit, Error> {
        let white = Noise::white(self.samples.len());
        let starts = self.starts(options.starts, options.seed, options.stopping);
        let mut fit = estimation::fit_from(self, starts.clone(), &white, options.stopping)?;
        if self.samples.len() < 2 {
            return Ok(fit);
        }
        let mut weighted = self.clone();
        for round in 0..WEIGHTINGS {
            let scales = weighted.output_noise(&fit.x).ok_or(Error::Stopped)?;
            let settled = weighted.known_scales.as_ref().is_some_and(|known| {
                known
                    .iter()
                    .zip(&scales)
                    .all(|(a, b)| (a / b - 1.0).abs() < SETTLED)
            });
            if settled {
                break;
            }
            weighted.known_scales = Some(scales);
            let mut from: Vec<Start> = vec![fit.x.clone().into()];
            if round == 0 {
                from.extend(starts.iter().cloned());
            }
            fit = estimation::fit_from(&weighted, from, &white, options.stopping)?;
        }
        Ok(fit)
    }

    /// The uncertainty of a fit under the noise of its residual, of order zero to `order` at each output ([`estimation::robust`]): [`Self::fit`]
    /// takes the noise for white.
    ///
    /// # Errors
    /// Where the simulation is not finite at the fit.
    pub fn robust(&self, fit: &Fit, order: usize) -> Result<Robust, Error> {
        Ok(estimation::robust(self, fit, order)?)
    }

    /// The initial states that fit best with all else fixed, in white noise.
    ///
    /// # Errors
    /// Where the simulation is not finite.
    pub fn fit_states(&self, options: &FitOptions) -> Result<Vec<f64>, Error> {
        if self.free.is_empty() {
            return Ok(self.start.clone());
        }
        let noise = Noise::white(self.samples.len());
        let fit = estimation::fit_from(
            self,
            vec![self.start.clone().into()],
            &noise,
            options.stopping,
        )?;
        Ok(fit.x)
    }

    /// The outputs that the model gives, a series for each record and output; `None` where the simulation cannot go on.
    #[must_use]
    pub fn simulate(&self, x: &[f64]) -> Option<Vec<Vec<f64>>> {
        let residuals = estimation::residuals(self, x)?;
        let measured = self.records.iter().flat_map(|record| &record.outputs);
        let simulated = measured.zip(residuals);
        // Where nothing was measured the residual says nothing: those are simulated on their own.
        if simulated
            .clone()
            .all(|(measured, _)| measured.missing() == 0)
        {
            let model =
                simulated.map(|(y, r)| y.values.iter().zip(r).map(|(y, r)| y - r).collect());
            return Some(model.collect());
        }
        let mut all = vec![Vec::new(); self.records.len() * self.samples.len()];
        self.each_instant::<0>(x, &[], |r, _, outputs| {
            for (o, y) in outputs.iter().enumerate() {
                all[r * self.samples.len() + o].push(y.re);
            }
            Some(())
        })?;
        Some(all)
    }

    /// Simulates all records with derivatives by some entries, at most `L` of them at once, and shows the outputs row by row with the
    /// entries of the lanes.
    fn each_instant<const L: usize>(
        &self,
        x: &[f64],
        by: &[usize],
        mut each: impl FnMut(usize, usize, &[Dual<L>]) -> Option<()>,
    ) -> Option<()> {
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let outputs = self.samples.len();
        let mut inputs = vec![0.0; self.model.spec().inputs.len()];
        let mut to = inputs.clone();
        for (r, record) in self.records.iter().enumerate() {
            let own = count + r * states..count + (r + 1) * states;
            let lanes: Vec<usize> = by
                .iter()
                .copied()
                .filter(|i| *i < count || own.contains(i))
                .collect();
            let mut chunks: Vec<&[usize]> = lanes.chunks(L.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let begin = self.clock.begins[r] / self.time_unit;
            let mut simulations: Vec<Simulation<'_, Dual<L>>> = chunks
                .iter()
                .map(|chunk| {
                    let dual = |i: usize| {
                        let lane = chunk.iter().position(|own| *own == i).unwrap_or(L);
                        Dual::<L>::variable(x[i], lane)
                    };
                    let parameters: Vec<_> = (0..count).map(dual).collect();
                    let initial: Vec<_> = own.clone().map(dual).collect();
                    Simulation::new(self.model, &parameters, &initial, begin)
                })
                .collect();
            let mut read = vec![Dual::<L>::variable(0.0, L); outputs * chunks.len()];
            for k in 0..record.len() {
                for (i, input) in record.inputs.iter().enumerate() {
                    inputs[i] = input.values[k];
                    to[i] = match input.hold {
                        Hold::First if k + 1 < record.len() => input.values[k + 1],
                        _ => input.values[k],
                    };
                }
                for (simulation, read) in simulations.iter_mut().zip(read.chunks_exact_mut(outputs))
                {
                    simulation.read(&inputs, read);
                }
                each(r, k, &read)?;
                if k + 1 < record.len() {
                    let until = begin + (record.time[k + 1] - record.time[0]) / self.time_unit;
                    for simulation in &mut simulations {
                        simulation.advance(&inputs, &to, until).ok()?;
                    }
                }
            }
        }
        Some(())
    }

    /// [`Residuals::each_row`]; no generic function, so that simulations with derivatives are compiled here and not again in every crate that
    /// fits.
    #[inline(never)]
    fn show_rows(&self, x: &[f64], each: &mut dyn FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        // A record has the parameters and its own states.
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let parameters = self.free.iter().filter(|&&i| i < count).count();
        let of = |r: usize| count + r * states..count + (r + 1) * states;
        let own = |r: usize| self.free.iter().filter(|i| of(r).contains(i)).count();
        let lanes = parameters + (0..self.records.len()).map(own).max().unwrap_or(0);
        match lanes {
            0..=2 => self.each_row_in_lanes::<2>(x, &self.free, each),
            3..=4 => self.each_row_in_lanes::<4>(x, &self.free, each),
            5..=8 => self.each_row_in_lanes::<8>(x, &self.free, each),
            9..=12 => self.each_row_in_lanes::<12>(x, &self.free, each),
            _ => self.each_row_in_lanes::<8>(x, &self.free, each),
        }
    }

    /// [`Residuals::each_residual`].
    #[inline(never)]
    fn show_residuals(
        &self,
        x: &[f64],
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        self.each_row_in_lanes::<0>(x, &[], each)
    }

    fn each_row_in_lanes<const L: usize>(
        &self,
        x: &[f64],
        by: &[usize],
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        let (count, states) = (self.parameter_count(), self.model.spec().states.len());
        let columns = by.len() + 1;
        let outputs = self.samples.len();
        let mut row = vec![0.0; columns];
        self.each_instant::<L>(x, by, |r, k, read| {
            let own = count + r * states..count + (r + 1) * states;
            for output in 0..outputs {
                row.fill(0.0);
                let mine = (0..by.len()).filter(|&c| by[c] < count || own.contains(&by[c]));
                for (lane, column) in mine.enumerate() {
                    row[column] = read[lane / L.max(1) * outputs + output].eps[lane % L.max(1)];
                }
                let model = read[output].re;
                let measured = self.records[r].outputs[output].values[k];
                row[columns - 1] = measured - model;
                let sample = Sample {
                    output,
                    first: k == 0,
                    missing: measured.is_nan(),
                };
                let finite = row[..columns - 1].iter().all(|v| v.is_finite()) && model.is_finite();
                if !(finite && each(sample, &mut row)) {
                    return None;
                }
            }
            Some(())
        })
    }
}

impl Residuals for ModelSetup<'_> {
    fn free(&self) -> &[usize] {
        &self.free
    }

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn samples(&self) -> &[usize] {
        &self.samples
    }

    fn each_row(&self, x: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        self.show_rows(x, &mut each)
    }

    fn each_residual(
        &self,
        x: &[f64],
        mut each: impl FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        self.show_residuals(x, &mut each)
    }

    fn floor(&self, output: usize) -> f64 {
        self.floors[output]
    }

    fn known_scales(&self) -> Option<&[f64]> {
        self.known_scales.as_deref()
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn out_of_time(&self) -> bool {
        let interrupted = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        self.interrupt.is_some_and(interrupted)
            || self.time_limit.as_ref().is_some_and(|limit| limit.passed())
    }
}
