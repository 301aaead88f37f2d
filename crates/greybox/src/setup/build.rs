//! Construction of a setup from a structure and its records.

use ct_signals::{Channel, Record};
use plants::{Domain, Known, MAX_VESSELS, OutputScales, Plant, Scales, Structure, deciles};
use std::collections::BTreeMap;

use super::{Setup, at_rest, pump_of};
use crate::Error;
use crate::clock::{Clock, span};
use crate::feedback::Feedback;
use crate::reading_step::reading_step;

/// Initial scales of records for a structure, before any simulation.
pub(crate) fn scales_of(records: &[Record], plant: Plant, known: &Known) -> Option<Scales> {
    let wider = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
    let input = records.iter().map(Record::input_range).reduce(wider)?;
    let input_2 = records
        .iter()
        .filter_map(|record| Some(record.inputs.get(1)?.range()))
        .reduce(wider);
    let ranges: Vec<(f64, f64)> = (0..known.outputs(plant).len())
        .map(|o| output_range(records, o))
        .collect::<Option<_>>()?;
    let output = ranges.iter().copied().reduce(wider)?;
    let sample = records
        .iter()
        .map(Record::sample_interval)
        .fold(f64::INFINITY, f64::min);
    let mut scales = Scales::from_ranges(input, output, sample, span(records));
    scales.input_2 = input_2;
    let commands = |signal: fn(&Record) -> Option<&Channel>| {
        let signals = records.iter().filter_map(signal);
        deciles(signals.flat_map(|signal| &signal.values).copied().collect())
    };
    scales.input_deciles = [
        commands(|record| Some(&record.inputs[0])),
        commands(|record| record.inputs.get(1)),
    ];
    let readings = |o: usize| {
        let outputs = records.iter().map(move |record| &record.outputs[o]);
        deciles(outputs.flat_map(Channel::present).collect())
    };
    let vessels = known.outputs(plant);
    // The range of a level that is not measured is assumed to be that of the lowest measured level.
    let lowest = (0..vessels.len()).max_by_key(|&o| vessels[o])?;
    scales.level_deciles = [readings(lowest); MAX_VESSELS];
    for (o, (vessel, (low, high))) in vessels.into_iter().zip(ranges).enumerate() {
        scales.level[vessel] = (low, high);
        scales.operating_level[vessel] = 0.5 * (low + high);
        scales.level_deciles[vessel] = readings(o);
    }
    // The second input is a command only for joined tanks; a measured disturbance gives no information on the actuator's range.
    if let Some((low, high)) = input_2.filter(|_| plant.joined()) {
        scales.input_range = scales.input_range.max(low.abs()).max(high.abs());
    }
    if let Some(range) = known.input_range {
        scales.input_range = range;
    }
    scales.outputs = (0..known.outputs(plant).len())
        .map(|o| OutputScales {
            reading_step: reading_step(records, o).unwrap_or(0.0),
            ..OutputScales::default()
        })
        .collect();
    Some(scales)
}

/// Smallest and largest reading of an output in all records; `None` where it has none.
fn output_range(records: &[Record], output: usize) -> Option<(f64, f64)> {
    let ranges = records
        .iter()
        .filter_map(|record| Some(record.outputs.get(output)?.range()));
    ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

impl<'a> Setup<'a> {
    /// A setup of a structure and records.
    ///
    /// # Errors
    /// If there is no record, a record is invalid or lacks samples of an input, or `fixed` names a parameter that does not exist.
    pub fn new(
        structure: Structure,
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
    ) -> Result<Self, Error> {
        Self::build(structure, records, fixed, None)
    }

    pub(super) fn build(
        structure: Structure,
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
        feedback: Option<Feedback>,
    ) -> Result<Self, Error> {
        if records.is_empty() {
            return Err(Error::NoRecord);
        }
        for record in records {
            record.validate()?;
            record.require_whole_inputs()?;
        }
        let outputs = structure.scales.outputs.len();
        if let Some(record) = records.iter().find(|r| r.outputs.len() != outputs) {
            return Err(Error::Outputs {
                record: record.name.clone(),
                given: record.outputs.len(),
                needed: outputs,
            });
        }
        let plant = structure.plant;
        let mut names = structure.parameter_names();
        let mut bounds: Vec<(f64, f64)> = structure
            .parameters()
            .iter()
            .map(|p| (p.lower, p.upper))
            .collect();
        for name in fixed.keys() {
            // A fixed parameter of an effect that is not active is not an error: the value is used once the effect is active.
            let effect_known = name
                .split_once('.')
                .is_some_and(|(effect, _)| plants::EffectInfo::find(effect).is_some());
            if !names.contains(name) && !effect_known {
                return Err(Error::UnknownParameter {
                    name: name.clone(),
                    known: names.join(", "),
                });
            }
        }
        let mut free: Vec<usize> = (0..names.len())
            .filter(|&i| !fixed.contains_key(&names[i]))
            .collect();
        let reach = structure.scales.largest_level().max(f64::MIN_POSITIVE);
        // The lower bound is above zero: the slope of the outflow is infinite for an empty tank, and an iterate that reached it could not
        // leave.
        let lowest = if plant.outlet() == plants::Outlet::Torricelli {
            1e-6 * reach
        } else {
            -1e3 * reach
        };
        let lags = structure.lags();
        let parameters = names.len();
        let suffixes = ct_signals::parts::suffixes(records);
        for (r, (record, of)) in records.iter().zip(&suffixes).enumerate() {
            for vessel in 0..plant.vessels() {
                free.push(names.len());
                names.push(format!("{}(0){of}", plant.level_name(vessel)));
                bounds.push((lowest, 1e3 * reach));
            }
            // The input before the record is unknown, so the initial state of a lag is a free parameter.
            for &lag in &lags {
                let (name, range) = structure.lag_before(lag, at_rest(record)[pump_of(lag)]);
                let name = name + of;
                if !fixed.contains_key(&name) {
                    free.push(names.len());
                }
                names.push(name);
                bounds.push(range);
            }
            if let Some(feedback) = &feedback {
                for (name, range) in feedback.entries(r, structure.scales.input) {
                    let name = name + of;
                    if feedback.released && !fixed.contains_key(&name) {
                        free.push(names.len());
                    }
                    names.push(name);
                    bounds.push(range);
                }
            }
        }
        let count = |o: usize| {
            let outputs = records.iter().map(|record| &record.outputs[o]);
            outputs
                .map(|output| output.values.len() - output.missing())
                .sum()
        };
        // One millionth of the output's range or, for a constant reading, of the largest level.
        let floor = |o: usize| match output_range(records, o) {
            Some((low, high)) if outputs > 1 && low < high => 1e-6 * (high - low),
            Some(_) if outputs > 1 => 1e-6 * reach,
            _ => 0.0,
        };
        Ok(Self {
            known_scales: None,
            priors: Vec::new(),
            samples: (0..outputs).map(count).collect(),
            floors: (0..outputs).map(floor).collect(),
            structure,
            records,
            fixed,
            substeps: 1,
            stop: None,
            interrupt: None,
            time_limit: None,
            names,
            bounds,
            free,
            parameters,
            feedback,
            clock: Clock::of(records),
        })
    }

    /// A setup with scales and domain from the records alone.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn from_records(
        plant: plants::Plant,
        known: plants::Known,
        effects: &[plants::Placed],
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
    ) -> Result<Self, Error> {
        let known_outputs = known.outputs(plant).len();
        if let Some(record) = records.iter().find(|r| r.outputs.len() != known_outputs) {
            return Err(Error::Outputs {
                record: record.name.clone(),
                given: record.outputs.len(),
                needed: known_outputs,
            });
        }
        let scales = scales_of(records, plant, &known).ok_or(Error::NoRecord)?;
        let mut structure = Structure::new(plant, known, scales);
        if let Some(output) = records.first().and_then(|record| record.outputs.first()) {
            structure.domain = Domain::of(plant, &output.unit);
        }
        for &effect in effects {
            structure = structure.with(effect)?;
        }
        Self::new(structure, records, fixed)
    }
}
