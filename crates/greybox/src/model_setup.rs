//! Fit of a user's own model to records: the vector of parameters, its bounds, its starts.
//!
//! The fitted vector holds the parameters in the order of the text, then for every record the initial values of the states. Time is that
//! of the records, in units of the model's time: `der()` is per such a unit. Inputs are held from row to row, or run in straight lines, as
//! their channels say; an output of a row is read with the inputs of that row.

mod build;
mod fit;
mod following;
mod linear_response;
mod rows;
mod simulated_loop;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ct_model::{Model, Variable};
use ct_signals::Record;
use estimation::Prior;

use self::build::samples_of;
pub use self::simulated_loop::{LoopController, SimulatedLoop};
use crate::{Error, PriorValue, TimeLimit, clock::Clock, output_noise::output_noise};

/// A model, the records, and which parameters are free.
#[derive(Debug, Clone)]
pub struct ModelSetup<'a> {
    model: &'a Model,
    records: &'a [Record],
    /// Seconds in one unit of the model's time.
    time_unit: f64,
    clock: Clock,
    names: Vec<String>,
    /// Start values of fits; fixed entries keep them.
    start: Vec<f64>,
    bounds: Vec<(f64, f64)>,
    free: Vec<usize>,
    samples: Vec<usize>,
    floors: Vec<f64>,
    priors: Vec<Prior>,
    known_scales: Option<Vec<f64>>,
    /// Relative tolerance of a simulation's steps.
    tolerance: f64,
    time_limit: Option<Arc<TimeLimit>>,
    interrupt: Option<&'a AtomicBool>,
    /// The controllers, if the loop is simulated.
    simulated_loop: Option<Arc<SimulatedLoop>>,
    /// Outputs contain an input that a controller drives without a state in between.
    reads_driven: bool,
}

/// ... and an initial state within this factor.
const STATE_REACH: f64 = 300.0;
/// Largest change of an output by the tolerance of the simulation, as a share of its noise.
const OF_NOISE: f64 = 1e-2;

impl<'a> ModelSetup<'a> {
    /// Adds a time limit: once it has passed, or `interrupt` is set, fits take no further steps.
    #[must_use]
    pub fn with_time_limit(self, limit: Arc<TimeLimit>, interrupt: Option<&'a AtomicBool>) -> Self {
        Self {
            time_limit: Some(limit),
            interrupt,
            ..self
        }
    }

    /// Adds priors of parameters.
    ///
    /// # Errors
    /// Where the model has no parameter of a name, or a value or its standard error cannot be.
    pub fn with_priors(mut self, priors: &BTreeMap<String, PriorValue>) -> Result<Self, Error> {
        let parameters = &self.names[..self.parameter_count()];
        self.priors = super::setup::priors_of(priors, parameters, &self.bounds)?;
        Ok(self)
    }

    /// The model and clock with other records, every parameter fixed at its value in a fitted vector: only initial states are fitted. A model
    /// that needs its loop runs in the loop of these records.
    ///
    /// # Errors
    /// As [`ModelSetup::new`]; if the model needs its loop, and a record lacks a reference or its command is not held.
    pub fn held_out<'b>(&self, records: &'b [Record], x: &[f64]) -> Result<ModelSetup<'b>, Error>
    where
        'a: 'b,
    {
        let count = self.parameter_count();
        let known = self.names[..count].iter().cloned();
        let known: BTreeMap<String, f64> = known.zip(x.iter().copied()).collect();
        let mut setup = ModelSetup::new(self.model, records, &known, self.time_unit)?;
        setup.clock = self.clock.with_records(records);
        let setup = setup.with_tolerance(self.tolerance).limited_as(self);
        Ok(match &self.simulated_loop {
            Some(of) if of.is_needed() => setup.in_loop(Arc::new(of.with_records(records)?)),
            _ => setup,
        })
    }

    /// The model, clock and fitted parameters with other records, without priors, on their measured inputs.
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
        Ok(setup.with_tolerance(self.tolerance).limited_as(self))
    }

    /// Parameters that are not fitted.
    pub(crate) fn known(&self) -> BTreeMap<String, f64> {
        let fixed = (0..self.parameter_count()).filter(|i| !self.free.contains(i));
        fixed
            .map(|i| (self.names[i].clone(), self.start[i]))
            .collect()
    }

    /// Uses the limits of another setup.
    pub(crate) fn limited_as(self, other: &ModelSetup<'a>) -> Self {
        Self {
            time_limit: other.time_limit.clone(),
            interrupt: other.interrupt,
            ..self
        }
    }

    /// The records.
    #[must_use]
    pub fn records(&self) -> &'a [Record] {
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

    /// Number of entries that are parameters.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.model.spec().parameters.len()
    }

    /// Start values of fits.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// Restricts the fit to these entries of the fitted ones.
    #[must_use]
    pub fn with_free(&self, only: &[usize]) -> Self {
        let mut setup = self.clone();
        setup.free.retain(|i| only.contains(i));
        setup
    }

    /// Sets the known standard deviation of each output's noise: outputs are weighted by these, and not by their residuals.
    #[must_use]
    pub fn with_scales(self, scales: Vec<f64>) -> Self {
        Self {
            known_scales: Some(scales),
            ..self
        }
    }

    /// Sets the relative tolerance of a simulation's steps ([`ct_model::Simulation::with_tolerance`]).
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The largest tolerance that fits take \[relative\]: that of fits from many starts, whose best result is fitted again with the tolerance of
    /// the setup.
    pub const LARGEST_TOLERANCE: f64 = 1e-6;

    /// The largest tolerance, up to [`Self::LARGEST_TOLERANCE`], with which the outputs change by at most a hundredth of their noise, the standard deviation at each
    /// output: that of [`ct_model::TOLERANCE`] where no larger one is sufficient, or the simulation is not finite.
    #[must_use]
    pub fn sufficient_tolerance(&self, x: &[f64], noise: &[f64]) -> f64 {
        let with = |tolerance: f64| self.clone().with_tolerance(tolerance).simulate(x);
        let Some(exact) = with(ct_model::TOLERANCE) else {
            return ct_model::TOLERANCE;
        };
        let is_sufficient = |found: Vec<Vec<f64>>| {
            let series = found.iter().zip(&exact).zip(noise.iter().cycle());
            let mut changes = series.flat_map(|((found, exact), noise)| {
                let pairs = found.iter().zip(exact);
                pairs.map(move |(found, exact)| (found - exact).abs() / noise)
            });
            changes.all(|change| change <= OF_NOISE)
        };
        let mut tolerance = Self::LARGEST_TOLERANCE;
        while tolerance > 2.0 * ct_model::TOLERANCE {
            if with(tolerance).is_some_and(is_sufficient) {
                return tolerance;
            }
            tolerance /= 10.0;
        }
        ct_model::TOLERANCE
    }

    /// Standard deviation of the noise of each output, from a linear prediction from the past, which is nearly independent of model errors;
    /// that of the residual if there are too few samples. `None` if the simulation diverges.
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

    /// Number of outputs.
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

    /// Whether an entry is the initial value of a state that an output measures.
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

    /// The model, entries and starts with other records of the same number, outputs and time.
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
}
