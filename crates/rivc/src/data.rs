//! Records for the estimators: any number of inputs, one output, times that may be uneven.

use ct_lti::Hold;

use crate::Error;

/// Times further from an even grid than this share of a step are uneven.
const EVEN: f64 = 1e-6;
/// Methods that count samples accept times within this share of a step of an even grid.
const NEARLY_EVEN: f64 = 0.1;

/// One input of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// One value for each sample, input unit.
    pub values: Vec<f64>,
    /// Hold between samples.
    pub hold: Hold,
}

/// One record.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Name in messages.
    pub name: String,
    /// Sampling instants \[time\], rising; their steps may differ.
    pub time: Vec<f64>,
    /// The inputs, in the order of the structure.
    pub inputs: Vec<Input>,
    /// The output at the sampling instants, output unit; NaN where its reading is missing.
    pub output: Vec<f64>,
    /// The reference of a loop whose controller drives the first input; none in open loop. In a loop the reference gives the instruments,
    /// for any controller.
    pub reference: Option<Vec<f64>>,
    /// Whether the record continues the preceding one in the list, after a time with unknown inputs: it has its own initial state, and
    /// shares the offset and the noise of that record.
    pub continues: bool,
}

impl Data {
    /// Record with one input that is held between samples, with even steps from time 0; open loop.
    pub fn even(step: f64, u: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name: "record".into(),
            time: (0..y.len()).map(|k| k as f64 * step).collect(),
            inputs: vec![Input {
                values: u,
                hold: Hold::Zero,
            }],
            output: y,
            reference: None,
            continues: false,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Number of present readings of the output.
    pub fn readings(&self) -> usize {
        self.output.iter().filter(|y| !y.is_nan()).count()
    }

    /// Checks lengths, numbers and times, and that there are this many inputs.
    pub(crate) fn validate(&self, inputs: usize) -> Result<(), Error> {
        let record = || self.name.clone();
        let length = |what: String, expected: usize, found: usize| {
            if expected == found {
                return Ok(());
            }
            let record = record();
            Err(Error::Length {
                record,
                what,
                expected,
                found,
            })
        };
        length("the list of inputs".into(), inputs, self.inputs.len())?;
        let named = |j: usize| format!("input {}", j + 1);
        let inputs = self.inputs.iter().enumerate();
        let output = "the output".to_owned();
        length(output.clone(), self.len(), self.output.len())?;
        if let Some(index) = self.output.iter().position(|y| y.is_infinite()) {
            return Err(Error::NotFinite {
                record: record(),
                what: output,
                index,
                value: self.output[index],
            });
        }
        let mut signals: Vec<(String, &[f64])> = inputs
            .map(|(j, input)| (named(j), &input.values[..]))
            .collect();
        if let Some(reference) = &self.reference {
            signals.push(("the reference".into(), reference));
        }
        signals.push(("time".into(), &self.time));
        for (what, values) in signals {
            length(what.clone(), self.len(), values.len())?;
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::NotFinite {
                    record: record(),
                    what,
                    index,
                    value: values[index],
                });
            }
        }
        if self.len() < 2 {
            return Err(Error::TooShortRecord {
                record: record(),
                samples: self.len(),
                missing: 0,
                needed: 2,
            });
        }
        if self.readings() == 0 {
            return Err(Error::NoReading { record: record() });
        }
        let falls = self.time.windows(2).position(|pair| pair[1] <= pair[0]);
        if let Some(k) = falls {
            return Err(Error::Time {
                record: record(),
                index: k + 1,
                before: self.time[k],
                after: self.time[k + 1],
            });
        }
        Ok(())
    }

    /// The mean step \[time\].
    pub(crate) fn mean_step(&self) -> f64 {
        let last = self.len() - 1;
        (self.time[last] - self.time[0]) / last as f64
    }

    /// The first sample that is further from an even grid than this share of a step.
    fn off_grid(&self, share: f64) -> Option<usize> {
        let step = self.mean_step();
        let on_grid = |k: usize| self.time[0] + k as f64 * step;
        let times = self.time.iter().enumerate();
        times
            .skip(1)
            .find(|(k, t)| (*t - on_grid(*k)).abs() > share * step)
            .map(|(k, _)| k)
    }

    /// The step where the times are even to 1e-6 of it.
    pub(crate) fn even_step(&self) -> Option<f64> {
        match self.off_grid(EVEN) {
            Some(_) => None,
            None => Some(self.mean_step()),
        }
    }

    /// Rejects times that are not nearly even, for methods that count samples.
    pub(crate) fn require_even(&self, what: &'static str) -> Result<(), Error> {
        match self.off_grid(NEARLY_EVEN) {
            Some(index) => Err(Error::Uneven {
                record: self.name.clone(),
                index,
                step: self.time[index] - self.time[index - 1],
                expected: self.mean_step(),
                what,
            }),
            None => Ok(()),
        }
    }
}
