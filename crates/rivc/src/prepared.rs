//! Records made ready: checked, centred, with the input of the loop as the reference explains it.

use ct_lti::Hold;
use ct_signals::interpolated;

use crate::grid::{Held, Lengths, Path};
use crate::layout::Layout;
use crate::loop_model::LoopModel;
use crate::{Data, Error, Structure};

/// Samples for each parameter that are needed.
pub(crate) const SAMPLES_PER_PARAMETER: usize = 3;

/// A record as the passes use it.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    pub(crate) time: Vec<f64>,
    /// Step, if all steps are equal.
    pub(crate) step: Option<f64>,
    /// About its mean where an offset is estimated and the record need not begin at rest; on lines where readings are missing.
    pub(crate) y: Vec<f64>,
    /// For each sample whether its reading is missing; empty if none is missing.
    missing: Vec<bool>,
    pub(crate) inputs: Vec<Vec<f64>>,
    holds: Vec<Hold>,
    /// In a loop the first input as the reference explains it: free of the record's noise.
    instrument: Option<Vec<f64>>,
    pub(crate) y_mean: f64,
    pub(crate) u_means: Vec<f64>,
    /// Whether the record is a part of the preceding one.
    pub(crate) continues: bool,
}

/// Means that are subtracted from a record, or from the parts of one.
pub(crate) struct Means {
    y: f64,
    inputs: Vec<f64>,
}

impl Means {
    /// Means of all parts together; 0 without centring.
    pub(crate) fn of(parts: &[Data], centre: bool) -> Self {
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0_usize), |(sum, n), v| (sum + v, n + 1));
            match centre {
                true => sum / count as f64,
                false => 0.0,
            }
        };
        let readings = parts.iter().flat_map(|part| &part.output);
        let inputs = parts.first().map_or(0, |part| part.inputs.len());
        let input = |j: usize| parts.iter().flat_map(move |part| &part.inputs[j].values);
        Self {
            y: mean(&mut readings.copied().filter(|y| !y.is_nan())),
            inputs: (0..inputs).map(|j| mean(&mut input(j).copied())).collect(),
        }
    }
}

/// The inputs with their delays.
#[derive(Debug, Clone, Default)]
pub(crate) struct Paths {
    pub(crate) lengths: Lengths,
    /// Number of the length of each step.
    pub(crate) steps: Vec<usize>,
    pub(crate) inputs: Vec<Path>,
    pub(crate) instrument: Option<Path>,
}

impl Prepared {
    /// A valid record about these means, with the first input as the reference explains it.
    pub(crate) fn new(record: &Data, means: Means, instrument: Option<Vec<f64>>) -> Self {
        let less = |values: &[f64], mean: f64| values.iter().map(|v| v - mean).collect();
        let Means {
            y: y_mean,
            inputs: u_means,
        } = means;
        let inputs = record.inputs.iter().zip(&u_means);
        let (y, missing) = match record.readings() == record.len() {
            true => (less(&record.output, y_mean), Vec::new()),
            false => (
                less(&interpolated(&record.output), y_mean),
                record.output.iter().map(|y| y.is_nan()).collect(),
            ),
        };
        Self {
            time: record.time.clone(),
            step: record.even_step(),
            y,
            missing,
            inputs: inputs.map(|(u, mean)| less(&u.values, *mean)).collect(),
            holds: record.inputs.iter().map(|u| u.hold).collect(),
            instrument: instrument.map(|u| less(&u, u_means[0])),
            y_mean,
            u_means,
            continues: record.continues,
        }
    }

    /// Whether the reading of a sample is missing.
    pub(crate) fn is_missing(&self, k: usize) -> bool {
        self.missing.get(k).copied().unwrap_or(false)
    }

    /// Whether any is.
    pub(crate) fn lacks_readings(&self) -> bool {
        !self.missing.is_empty()
    }

    /// Number of present readings from a sample on.
    pub(crate) fn readings_from(&self, first: usize) -> usize {
        (first..self.len()).filter(|k| !self.is_missing(*k)).count()
    }

    /// The given number of first rows.
    pub(crate) fn first_rows(&self, rows: usize) -> Self {
        let rows = rows.min(self.len());
        let part = |values: &Vec<f64>| values[..rows].to_vec();
        let missing = self.missing.iter().take(rows).copied();
        Self {
            time: part(&self.time),
            y: part(&self.y),
            missing: missing.collect(),
            inputs: self.inputs.iter().map(part).collect(),
            instrument: self.instrument.as_ref().map(part),
            ..self.clone()
        }
    }

    /// Whether the first input is one that a reference explains.
    pub(crate) fn is_in_loop(&self) -> bool {
        self.instrument.is_some()
    }

    /// Share of the first input's power about its mean that the reference explains, in a loop.
    pub(crate) fn explained(&self) -> Option<f64> {
        let instrument = self.instrument.as_ref()?;
        let mean = self.inputs[0].iter().sum::<f64>() / self.len() as f64;
        let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
        let all = square(&mut self.inputs[0].iter().map(|u| u - mean));
        let left = square(&mut self.inputs[0].iter().zip(instrument).map(|(u, r)| u - r));
        Some((1.0 - left / all).max(0.0))
    }

    pub(crate) fn len(&self) -> usize {
        self.y.len()
    }

    /// The first sample at which all inputs are known under delays of up to this.
    pub(crate) fn first_known(&self, delay: f64) -> usize {
        let from = self.time[0] + delay;
        let early = 1e-9 * delay;
        self.time.partition_point(|t| *t < from - early)
    }

    pub(crate) fn paths(&self, delays: &[f64]) -> Paths {
        let mut lengths = Lengths::default();
        let steps = match self.step {
            Some(step) => vec![lengths.number(step); self.len() - 1],
            None => self
                .time
                .windows(2)
                .map(|pair| lengths.number(pair[1] - pair[0]))
                .collect(),
        };
        let mut path = |values: &[f64], j: usize| {
            let held = Held {
                time: &self.time,
                step: self.step,
                values,
                hold: self.holds[j],
            };
            held.delayed(delays[j], &mut lengths)
        };
        let inputs = self.inputs.iter().enumerate();
        let inputs = inputs.map(|(j, values)| path(values, j)).collect();
        let instrument = self.instrument.as_ref().map(|values| path(values, 0));
        Paths {
            lengths,
            steps,
            inputs,
            instrument,
        }
    }
}

/// All records, after checks against the structure and against each other.
pub(crate) fn prepare(records: &[Data], structure: &Structure) -> Result<Vec<Prepared>, Error> {
    structure.validate()?;
    let Some(first) = records.first() else {
        return Err(Error::NoRecord);
    };
    let in_loop = first.reference.is_some();
    let core = structure.parameters();
    let own = structure.of_record();
    let (mut samples, mut missing) = (0, 0);
    for record in records {
        record.validate(structure.m.len())?;
        if record.reference.is_some() != in_loop {
            return Err(Error::MixedLoops {
                record: record.name.clone(),
                found: if in_loop {
                    "no reference"
                } else {
                    "a reference"
                },
                first: if in_loop { "one" } else { "none" },
            });
        }
        let needed = needed_alone(structure);
        let readings = record.readings();
        if readings < needed {
            return Err(Error::TooShortRecord {
                record: record.name.clone(),
                samples: readings,
                missing: record.len() - readings,
                needed,
            });
        }
        if in_loop {
            record.require_even("the model of the loop")?;
        }
        samples += readings;
        missing += record.len() - readings;
    }
    let continues = records.iter().map(|record| record.continues);
    let parameters = Layout::new(core, structure, continues).unknowns();
    let needed = SAMPLES_PER_PARAMETER * parameters;
    if samples < needed {
        return Err(Error::TooShort {
            samples,
            missing,
            needed,
            parameters,
        });
    }
    for j in 0..structure.m.len() {
        let values = |record: &Data| record.inputs[j].values.clone();
        moves(records, values, || format!("input {}", j + 1))?;
    }
    moves(
        records,
        |record| {
            record
                .output
                .iter()
                .copied()
                .filter(|y| !y.is_nan())
                .collect()
        },
        || "the output".into(),
    )?;
    if in_loop {
        let reference = |record: &Data| record.reference.clone().unwrap_or_default();
        moves(records, reference, || "the reference".into())?;
    }
    let centre = structure.offset && structure.initial_states;
    let explained = |record: &Data| match (&record.reference, &record.inputs[0].values) {
        (None, _) => Ok(None),
        (Some(r), u) => match LoopModel::fit(r, u) {
            Some(model) => Ok(Some(model.simulate(r, u[0]))),
            None => Err(Error::NoLoopModel {
                record: record.name.clone(),
                samples: u.len(),
                needed: LoopModel::NEEDED,
            }),
        },
    };
    let mut prepared: Vec<Prepared> = Vec::with_capacity(records.len());
    let mut rest = records;
    while !rest.is_empty() {
        let parts = 1 + rest
            .iter()
            .skip(1)
            .take_while(|part| part.continues)
            .count();
        let (group, behind) = rest.split_at(parts);
        for record in group {
            prepared.push(Prepared::new(
                record,
                Means::of(group, centre),
                explained(record)?,
            ));
        }
        rest = behind;
    }
    let largest = structure.largest_delay();
    for (record, data) in prepared.iter().zip(records) {
        let left = record.readings_from(record.first_known(largest));
        let needed = SAMPLES_PER_PARAMETER * (core + own);
        if largest > 0.0 && left < needed {
            return Err(Error::DelayTooLong {
                record: data.name.clone(),
                delay: largest,
                left,
                samples: record.len(),
                needed,
                parameters: core + own,
            });
        }
    }
    Ok(prepared)
}

/// Readings that a record needs for what is its own.
fn needed_alone(structure: &Structure) -> usize {
    SAMPLES_PER_PARAMETER * structure.of_record().max(1)
}

impl Data {
    /// Whether a record has enough readings for its offset and initial states with the largest delay, and, in a loop, enough samples for a
    /// model of its input: a shorter part of a record is rejected by [`estimate`](crate::estimate()), and contains little information.
    pub fn is_long_enough(&self, structure: &Structure) -> bool {
        let largest = structure.largest_delay();
        let from = |t: f64| self.time.first().is_some_and(|first| t >= first + largest);
        let late = self.time.iter().zip(&self.output);
        let readings = late.filter(|(t, y)| from(**t) && !y.is_nan()).count();
        let needed = match largest > 0.0 {
            true => SAMPLES_PER_PARAMETER * (structure.parameters() + structure.of_record()),
            false => needed_alone(structure),
        };
        readings >= needed && (self.reference.is_none() || self.len() >= LoopModel::NEEDED)
    }
}

/// Refuses a signal that is constant in all records.
fn moves(
    records: &[Data],
    of: impl Fn(&Data) -> Vec<f64>,
    name: impl Fn() -> String,
) -> Result<(), Error> {
    let mut value = f64::NAN;
    for record in records {
        let values = of(record);
        value = values.first().copied().unwrap_or(value);
        if values.iter().any(|v| Some(v) != values.first()) {
            return Ok(());
        }
    }
    Err(Error::Constant {
        what: name(),
        value,
    })
}
