//! Limits of an experiment from the user, checked against the records.

use std::collections::BTreeMap;

use ct_signals::{Record, shown};

use super::InputRange;
use super::sequences::Room;
use crate::Problem;

/// Least number of samples per fitted parameter, ...
const SAMPLES_PER_PARAMETER: usize = 3;
/// ... and largest total number of samples.
const MOST_SAMPLES: usize = 20_000;

/// Limits of an experiment; missing values are derived from the records.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Limits {
    /// Inputs that are applied; if none is named, all inputs that change in the records. The others are held at their median.
    pub inputs: Vec<String>,
    /// Smallest and largest value of an input \[its unit\]. By default the range of the records.
    pub ranges: BTreeMap<String, (f64, f64)>,
    /// Largest change of an input per second.
    pub slews: BTreeMap<String, f64>,
    /// Length \[s\]. By default that of the longest record.
    pub duration: Option<f64>,
    /// Seed of the sequences that are drawn.
    pub seed: u64,
}

/// An experiment that cannot be proposed. A message about an argument begins with its name: `duration`, `slew`, `input`, `between`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoExperiment {
    /// The two effects are the same.
    #[error(
        "between {effect} {effect}: an effect cannot be distinguished from itself; give two different effects"
    )]
    SameEffect {
        /// The effect.
        effect: String,
    },
    /// An effect that the model has.
    #[error(
        "{effect} is in the model already, so that there is nothing to decide; remove it from the model first"
    )]
    InModel {
        /// The effect.
        effect: String,
    },
    /// An effect could not be fitted.
    #[error("{effect} cannot be fitted to these records")]
    NoFit {
        /// The effect.
        effect: String,
    },
    /// The model is unstable without its controllers.
    #[error(
        "the model is unstable without its controllers, and an experiment would run without them: move the reference of the loop instead"
    )]
    NeedsLoop,
    /// A model without inputs.
    #[error("the model has no input that an experiment could move")]
    NoInput,
    /// The model has no input of this name.
    #[error("input {name}: the model has no such input; it has {known}")]
    UnknownInput {
        /// Name as given.
        name: String,
        /// Names of the inputs.
        known: String,
    },
    /// The range's ends are in the wrong order, equal or not finite.
    #[error("input {input}={}..{}: the smaller value comes first, and they have to differ", shown(*low), shown(*high))]
    Range {
        /// The input.
        input: String,
        /// First end.
        low: f64,
        /// Second end.
        high: f64,
    },
    /// The input is constant in the records, and no range is given.
    #[error("the records hold one value of {input}, {}, so its permitted range is not known; give a range", shown(*value))]
    NoRange {
        /// The input.
        input: String,
        /// Its value.
        value: f64,
    },
    /// Too few samples, or too many.
    #[error("duration {} s holds {samples} samples at one every {} s; give between {} and {} s", shown(*duration), shown(*interval), shown(*least as f64 * interval), shown(MOST_SAMPLES as f64 * interval))]
    Duration {
        /// The length \[s\].
        duration: f64,
        /// Samples in it.
        samples: usize,
        /// The fewest.
        least: usize,
        /// The sampling interval \[s\].
        interval: f64,
    },
    /// A slew limit that is too small.
    #[error("slew {} a second moves {input} by less than its range within {} s", shown(*slew), shown(*duration))]
    Slew {
        /// The input.
        input: String,
        /// Largest change in a second.
        slew: f64,
        /// The length \[s\].
        duration: f64,
    },
    /// The time limit has passed before there was a result.
    #[error(
        "the time did not suffice to fit both effects and to try experiments; allow more time, or give fewer rows or a shorter duration"
    )]
    OutOfTime,
}

/// An input that is applied, by its position in the model, and its limits.
pub(super) type Applied = (usize, InputRange, Room);

/// The checked limits.
pub(super) struct Bounds {
    pub applied: Vec<Applied>,
    /// Constant values of the other inputs.
    pub held: Vec<f64>,
    pub duration: f64,
    pub interval: f64,
    pub samples: usize,
}

/// The median of some values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

impl Bounds {
    /// `parameters`: how many are fitted.
    pub fn new(
        problem: &Problem,
        limits: &Limits,
        parameters: usize,
    ) -> Result<Self, NoExperiment> {
        let spec = &problem.spec;
        let names: Vec<&str> = spec.inputs.iter().map(|u| u.about.name.as_str()).collect();
        if names.is_empty() {
            return Err(NoExperiment::NoInput);
        }
        let asked = limits.inputs.iter();
        for name in asked.chain(limits.ranges.keys()).chain(limits.slews.keys()) {
            if !names.contains(&name.as_str()) {
                return Err(NoExperiment::UnknownInput {
                    name: name.clone(),
                    known: names.join(", "),
                });
            }
        }
        let longest = problem
            .records
            .iter()
            .max_by(|a, b| a.duration().total_cmp(&b.duration()));
        let interval = longest.map_or(1.0, Record::sample_interval);
        let duration = limits
            .duration
            .or(longest.map(Record::duration))
            .unwrap_or(0.0);
        let samples = (duration / interval).round().clamp(0.0, 1e9) as usize + 1;
        let least = SAMPLES_PER_PARAMETER * parameters.max(4);
        if !(least..=MOST_SAMPLES).contains(&samples) || !duration.is_finite() {
            return Err(NoExperiment::Duration {
                duration,
                samples,
                least,
                interval,
            });
        }
        let visited = |i: usize| {
            let values = problem
                .records
                .iter()
                .map(|record| record.inputs[i].range());
            values
                .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
                .unwrap_or((0.0, 0.0))
        };
        let mut applied = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let own = |all: &Vec<String>| all.iter().any(|asked| asked == name);
            let given = limits.ranges.get(*name);
            let (from, to) = visited(i);
            let (low, high) = given.copied().unwrap_or((from, to));
            if !limits.inputs.is_empty() && !own(&limits.inputs) {
                continue;
            }
            if given.is_none() && from == to {
                if limits.inputs.is_empty() && names.len() > 1 {
                    continue;
                }
                return Err(NoExperiment::NoRange {
                    input: (*name).to_string(),
                    value: from,
                });
            }
            let input = (*name).to_string();
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(NoExperiment::Range { input, low, high });
            }
            let slew = limits.slews.get(*name).copied();
            if let Some(slew) = slew.filter(|slew| slew.is_nan() || slew * duration < high - low) {
                return Err(NoExperiment::Slew {
                    input,
                    slew,
                    duration,
                });
            }
            let range = InputRange {
                input,
                unit: spec.inputs[i].about.unit.clone(),
                low,
                high,
                visited: given.is_none(),
                slew,
            };
            let room = Room {
                low,
                high,
                visited: (from, to),
                slew,
                duration,
                interval,
                samples,
            };
            applied.push((i, range, room));
        }
        if applied.is_empty() {
            return Err(NoExperiment::NoRange {
                input: names[0].to_string(),
                value: visited(0).0,
            });
        }
        let held = (0..names.len()).map(|i| {
            let values = longest.map(|record| record.inputs[i].values.clone());
            let value = median(values.unwrap_or_default());
            let range = applied.iter().find(|(own, ..)| *own == i);
            range.map_or(value, |(_, range, _)| value.clamp(range.low, range.high))
        });
        Ok(Self {
            held: held.collect(),
            applied,
            duration,
            interval,
            samples,
        })
    }
}
