//! Records made ready: checked, centred, with the input of the loop as the reference explains it.

use ct_lti::Hold;

use crate::grid::{Held, Lengths, Path};
use crate::loop_model::LoopModel;
use crate::{Data, Error, Structure};

/// Samples for each parameter that are needed.
pub(crate) const SAMPLES_PER_PARAMETER: usize = 3;

/// A record as the passes use it.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    pub(crate) time: Vec<f64>,
    /// Where the steps are even.
    pub(crate) step: Option<f64>,
    /// About its mean where an offset is estimated and the record need not begin at rest.
    pub(crate) y: Vec<f64>,
    pub(crate) inputs: Vec<Vec<f64>>,
    holds: Vec<Hold>,
    /// In a loop the first input as the reference explains it: free of the record's noise.
    instrument: Option<Vec<f64>>,
    pub(crate) y_mean: f64,
    pub(crate) u_means: Vec<f64>,
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
    /// A valid record, about its means where asked for, with the first input as the reference explains it.
    pub(crate) fn new(record: &Data, centre: bool, instrument: Option<Vec<f64>>) -> Self {
        let mean = |values: &[f64]| match centre {
            true => values.iter().sum::<f64>() / values.len() as f64,
            false => 0.0,
        };
        let less = |values: &[f64], mean: f64| values.iter().map(|v| v - mean).collect();
        let y_mean = mean(&record.output);
        let u_means: Vec<f64> = record.inputs.iter().map(|u| mean(&u.values)).collect();
        let inputs = record.inputs.iter().zip(&u_means);
        Self {
            time: record.time.clone(),
            step: record.even_step(),
            y: less(&record.output, y_mean),
            inputs: inputs.map(|(u, mean)| less(&u.values, *mean)).collect(),
            holds: record.inputs.iter().map(|u| u.hold).collect(),
            instrument: instrument.map(|u| less(&u, u_means[0])),
            y_mean,
            u_means,
        }
    }

    /// So many rows from the first one on.
    pub(crate) fn first_rows(&self, rows: usize) -> Self {
        let rows = rows.min(self.len());
        let part = |values: &Vec<f64>| values[..rows].to_vec();
        Self {
            time: part(&self.time),
            y: part(&self.y),
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

/// All records, checked against the structure and each other.
pub(crate) fn prepare(records: &[Data], structure: &Structure) -> Result<Vec<Prepared>, Error> {
    structure.validate()?;
    let Some(first) = records.first() else {
        return Err(Error::NoRecord);
    };
    let in_loop = first.reference.is_some();
    let core = structure.parameters();
    let own = structure.of_record();
    let mut samples = 0;
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
        let needed = SAMPLES_PER_PARAMETER * own.max(1);
        if record.len() < needed {
            return Err(Error::TooShortRecord {
                record: record.name.clone(),
                samples: record.len(),
                needed,
            });
        }
        if in_loop {
            record.require_even("the model of the loop")?;
        }
        samples += record.len();
    }
    let parameters = core + own * records.len();
    let needed = SAMPLES_PER_PARAMETER * parameters;
    if samples < needed {
        return Err(Error::TooShort {
            samples,
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
        |record| record.output.clone(),
        || "the output".into(),
    )?;
    if in_loop {
        let reference = |record: &Data| record.reference.clone().unwrap_or_default();
        moves(records, reference, || "the reference".into())?;
    }
    let centre = structure.offset && structure.initial_states;
    let prepared: Vec<Prepared> = records
        .iter()
        .map(|record| {
            let u = &record.inputs[0].values;
            let explained = |r: &[f64]| match LoopModel::fit(r, u) {
                Some(model) => Ok(model.simulate(r, u[0])),
                None => Err(Error::NoLoopModel {
                    record: record.name.clone(),
                    samples: u.len(),
                    needed: LoopModel::NEEDED,
                }),
            };
            let instrument = record.reference.as_deref().map(explained).transpose()?;
            Ok(Prepared::new(record, centre, instrument))
        })
        .collect::<Result<_, Error>>()?;
    let largest = structure.largest_delay();
    for (record, data) in prepared.iter().zip(records) {
        let left = record.len() - record.first_known(largest).min(record.len());
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

/// Refuses a signal that stands still in all records.
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
