//! Builds a setup from a model and its records: free parameters, bounds, and start values.

use ct_model::{About, Given, Model, Variable};
use ct_signals::Record;
use estimation::within;
use std::collections::BTreeMap;

use super::{ModelSetup, STATE_REACH};
use crate::Error;
use crate::clock::Clock;

/// If the text sets no bound, a parameter stays within this factor of its value in the text, ...
const REACH: f64 = 1e4;
/// ... and within this one where it suffices.
const NEAR: f64 = 30.0;

/// A value closer to a bound than this share of the width of the bounds is at it.
const NEAR_BOUND: f64 = 1e-3;

/// The scales of the noise have converged if none changes by more than this share. Where a model lacks an effect, the errors of two outputs
/// change by a few times the share by which their weights do.
pub(super) const SETTLED: f64 = 2e-4;

/// Bounds of the text; without them plus and minus `factor` times the value, so that a fit cannot diverge. For a value of zero there are no
/// such bounds.
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
pub(super) fn samples_of(records: &[Record], outputs: usize) -> Vec<usize> {
    let present = |o: usize| {
        let outputs = records.iter().map(move |record| &record.outputs[o]);
        outputs.map(|y| y.values.len() - y.missing()).sum()
    };
    (0..outputs).map(present).collect()
}

impl ModelSetup<'_> {
    /// The same setup, whose parameters without bounds in the text stay near their start values.
    pub(super) fn near_starts(&self) -> Self {
        let mut near = self.clone();
        let parameters = self.model.spec().parameters.iter();
        for (bounds, parameter) in near.bounds.iter_mut().zip(parameters) {
            *bounds = bounds_of(&parameter.about, parameter.value, NEAR);
        }
        near
    }

    /// Whether a vector ends at a bound of this setup that another one does not have.
    pub(super) fn is_narrower_at(&self, other: &Self, x: &[f64]) -> bool {
        let mut free = self.free.iter();
        free.any(|&i| {
            let ((low, high), wide) = (self.bounds[i], other.bounds[i]);
            let near = NEAR_BOUND * (high - low);
            low > wide.0 && x[i] < low + near || high < wide.1 && x[i] > high - near
        })
    }
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
        for (record, of) in records.iter().zip(ct_signals::parts::suffixes(records)) {
            for (i, state) in spec.states.iter().enumerate() {
                let about = &state.about;
                if !state.fixed {
                    free.push(names.len());
                }
                names.push(format!("{}(0){of}", about.name));
                // If an output measures the state, the initial value comes from the record.
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
            tolerance: ct_model::TOLERANCE,
            time_limit: None,
            interrupt: None,
            simulated_loop: None,
            reads_driven: false,
        })
    }
}
