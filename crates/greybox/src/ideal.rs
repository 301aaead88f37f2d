//! What records without noise would tell of a model: its time constants, how it is simulated, and the parameters that no such record
//! determines.
//!
//! The records are simulated from the values of the text. All inputs step at random within their bounds, at sampling intervals from a tenth
//! of the shortest time constant to a tenth of the longest one, so that fast and slow parts are excited. A group of parameters is not
//! determined if a combination of their columns in the Jacobian is zero (local identifiability; E. Walter, L. Pronzato, Identification of
//! Parametric Models, 1997, section 2.3).

use std::collections::BTreeMap;

use ct_model::{About, Method, Model, ModelSpec, Simulation};
use ct_signals::{Channel, Record, excitation};
use estimation::{Residuals, Triangle, within};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::ModelSetup;

/// Samples of each record.
const SAMPLES: usize = 300;
/// Number of samples for which an input is constant.
const HELD: std::ops::RangeInclusive<usize> = 3..=40;
/// Number of samples per time constant, ...
const PER_CONSTANT: f64 = 10.0;
/// ... and the largest ratio of two successive sampling intervals.
const RATIO: f64 = 30.0;
/// Largest number of sampling intervals.
const INTERVALS: usize = 8;
/// An eigenvalue below this share of the largest one is that of an integrator.
const INTEGRATOR: f64 = 1e-12;
const SEED: u64 = 1;

/// A model's time constants and what ideal records of it determine.
#[derive(Debug, Clone, PartialEq)]
pub struct IdealRecords {
    /// Time constants about the start of the model, the shortest first; none of integrators \[unit of the model's time\].
    pub time_constants: Vec<f64>,
    /// The method by which the longest record was simulated.
    pub method: Method,
    /// Names of the parameters that have no effect on the outputs of these records alone, or in a combination.
    pub not_determined: Vec<Vec<String>>,
    /// Names of the inputs without bounds in the text, and the ranges that were taken.
    pub assumed: Vec<(String, (f64, f64))>,
}

/// Why a model has no ideal records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NotIdeal {
    /// The model delays something: its time constants are not known.
    #[error("the model delays something")]
    Delay,
    /// An equation has no finite value or slope at the start values.
    #[error(
        "an equation has no finite value or slope at the start values: give other starts, or min and max of the inputs"
    )]
    Start,
    /// The simulation of a record fails.
    #[error("the simulation fails: give the inputs the bounds of your plant, min and max")]
    Simulation,
}

/// The bounds of an input; where one is missing, one unit from the other, or 0 to 1.
fn range(about: &About) -> (f64, f64) {
    match (about.min.is_finite(), about.max.is_finite()) {
        (true, true) => (about.min, about.max),
        (true, false) => (about.min, about.min + 1.0),
        (false, true) => (about.max - 1.0, about.max),
        (false, false) => (0.0, 1.0),
    }
}

/// Simulates a model with ideal records; the parameters of `known` have these values.
///
/// # Errors
/// Where the model cannot be simulated so.
pub fn ideal_records(
    model: &Model,
    known: &BTreeMap<String, f64>,
) -> Result<IdealRecords, NotIdeal> {
    let spec = model.spec();
    let mut parameters = model.parameters();
    for (value, parameter) in parameters.iter_mut().zip(&spec.parameters) {
        *value = *known.get(&parameter.about.name).unwrap_or(value);
    }
    let ranges: Vec<(f64, f64)> = spec
        .inputs
        .iter()
        .map(|input| range(&input.about))
        .collect();
    let middle: Vec<f64> = ranges
        .iter()
        .map(|(low, high)| 0.5 * (low + high))
        .collect();
    let starts = model.starts(&parameters);
    let time_constants = time_constants(model, &parameters, &starts, &middle).ok_or_else(|| {
        if model.has_delays() {
            NotIdeal::Delay
        } else {
            NotIdeal::Start
        }
    })?;
    let (shortest, longest) = match time_constants.as_slice() {
        [] => (1.0, 1.0),
        [first, .., last] => (*first, *last),
        [only] => (*only, *only),
    };
    let count = ((longest / shortest).ln() / RATIO.ln()).ceil() as usize + 1;
    let count = count.min(INTERVALS);
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut method = Method::Exact;
    let mut records = Vec::new();
    let mut begins = Vec::new();
    for i in 0..count {
        let share = i as f64 / (count - 1).max(1) as f64;
        let interval = shortest * (longest / shortest).powf(share) / PER_CONSTANT;
        let inputs = ranges
            .iter()
            .map(|(low, high)| excitation::steps(SAMPLES, HELD, *low, *high, &mut rng).ok());
        let inputs: Vec<Vec<f64>> = inputs.collect::<Option<_>>().ok_or(NotIdeal::Simulation)?;
        let begin = displaced(spec, &starts, &mut rng);
        let outputs;
        (outputs, method) = outputs_of(model, &parameters, &begin, interval, &inputs)
            .ok_or(NotIdeal::Simulation)?;
        let channel =
            |(about, values): (&About, Vec<f64>)| Channel::new(&about.name, &about.unit, values);
        let inputs = spec.about_inputs().zip(inputs).map(channel).collect();
        let outputs = spec.about_outputs().zip(outputs).map(channel).collect();
        records.push(Record::sampled("ideal", interval, inputs, outputs));
        begins.push(begin);
    }
    let setup = ModelSetup::new(model, &records, known, 1.0).map_err(|_| NotIdeal::Simulation)?;
    let mut x = parameters;
    x.extend(begins.into_iter().flatten());
    let mut triangle = Triangle::new(setup.free().len() + 1);
    let rows = setup.each_row(&x, |_, row| {
        triangle.push(row);
        true
    });
    triangle.finish();
    if rows.is_none() || !triangle.is_finite() {
        return Err(NotIdeal::Simulation);
    }
    let unbounded = |about: &&About| !(about.min.is_finite() && about.max.is_finite());
    let assumed = spec
        .inputs
        .iter()
        .map(|input| &input.about)
        .filter(unbounded);
    let fitted = setup
        .free()
        .iter()
        .filter(|&&i| i < setup.parameter_count());
    let all: Vec<usize> = (0..setup.free().len()).collect();
    let fitted = fitted.count();
    let name = |&column: &usize| setup.names()[setup.free()[column]].clone();
    let (_, groups) = triangle.independent_among(&all);
    let groups = groups
        .into_iter()
        .filter(|group| group.iter().any(|&i| i < fitted));
    let mut not_determined: Vec<Vec<String>> = groups
        .map(|group| group.iter().filter(|&&i| i < fitted).map(name).collect())
        .collect();
    not_determined.sort();
    not_determined.dedup();
    Ok(IdealRecords {
        time_constants,
        method,
        not_determined,
        assumed: assumed
            .map(|about| (about.name.clone(), range(about)))
            .collect(),
    })
}

/// Initial states of a record: those of the text; without inputs the ones that are not fixed are displaced at random, as a model that starts
/// at rest would stay there.
fn displaced(spec: &ModelSpec, starts: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut begin = starts.to_vec();
    if !spec.inputs.is_empty() {
        return begin;
    }
    for (value, state) in begin.iter_mut().zip(&spec.states) {
        if !state.fixed {
            let scale = if *value == 0.0 { 1.0 } else { value.abs() };
            let about = &state.about;
            *value = within(
                *value + scale * rng.random_range(-0.5..0.5),
                (about.min, about.max),
            );
        }
    }
    begin
}

/// Outputs of a model without noise, and the method by which it was simulated; nothing if the simulation fails.
fn outputs_of(
    model: &Model,
    parameters: &[f64],
    starts: &[f64],
    interval: f64,
    inputs: &[Vec<f64>],
) -> Option<(Vec<Vec<f64>>, Method)> {
    let mut simulation = Simulation::new(model, parameters, starts, 0.0);
    let mut read = vec![0.0; model.spec().outputs.len()];
    let mut outputs = vec![Vec::with_capacity(SAMPLES); read.len()];
    for k in 0..SAMPLES {
        let row: Vec<f64> = inputs.iter().map(|input| input[k]).collect();
        simulation.read(&row, &mut read);
        for (output, reading) in outputs.iter_mut().zip(&read) {
            output.push(*reading);
        }
        let next = interval * (k + 1) as f64;
        simulation.advance(&row, &row, next).ok()?;
    }
    Some((outputs, simulation.method()))
}

/// Of the model about its start.
fn time_constants(
    model: &Model,
    parameters: &[f64],
    starts: &[f64],
    inputs: &[f64],
) -> Option<Vec<f64>> {
    let form = model.linear_about(parameters, starts, inputs, 0.0)?;
    let states = form.a.len();
    if states == 0 {
        return Some(Vec::new());
    }
    let matrix = DMatrix::from_fn(states, states, |i, j| form.a[i][j]);
    let rates: Vec<f64> = matrix
        .complex_eigenvalues()
        .iter()
        .map(|s| s.norm())
        .collect();
    let fastest = rates.iter().copied().fold(0.0, f64::max);
    let rates = rates
        .into_iter()
        .filter(|rate| *rate > INTEGRATOR * fastest);
    let mut constants: Vec<f64> = rates.map(|rate| 1.0 / rate).collect();
    constants.sort_by(f64::total_cmp);
    Some(constants)
}
