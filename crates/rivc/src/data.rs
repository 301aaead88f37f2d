//! Records as the estimators see them: any number of inputs, one output, times that may be uneven.

use ct_lti::Hold;

use crate::Error;

/// Steps that differ by more than this share of the first one are uneven.
const EVEN: f64 = 1e-6;

/// One input of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// One value for each sample, input unit.
    pub values: Vec<f64>,
    /// What it does between samples.
    pub hold: Hold,
}

/// One record.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// For messages.
    pub name: String,
    /// Sampling instants \[time\], rising; their steps may differ.
    pub time: Vec<f64>,
    /// The inputs, in the order of the structure.
    pub inputs: Vec<Input>,
    /// The output at the sampling instants, output unit.
    pub output: Vec<f64>,
    /// The reference of a loop whose controller moves the first input; nothing in open loop. In a loop the instruments come from it,
    /// whatever the controller.
    pub reference: Option<Vec<f64>>,
}

impl Data {
    /// One input, held between samples, with even steps from time 0; open loop.
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

    /// Checks lengths, numbers and times, for so many inputs.
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
        let mut signals: Vec<(String, &[f64])> = inputs
            .map(|(j, input)| (named(j), &input.values[..]))
            .collect();
        signals.push(("the output".into(), &self.output));
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

    /// The step where all are the same to 1e-6, else the first sample whose step differs, with it.
    pub(crate) fn even_step(&self) -> Result<f64, (usize, f64, f64)> {
        let n = self.len();
        let (Some(first), Some(last)) = (self.time.first(), self.time.last()) else {
            return Ok(0.0);
        };
        if n < 2 {
            return Ok(0.0);
        }
        let mean = (last - first) / (n - 1) as f64;
        let steps = self.time.windows(2).map(|pair| pair[1] - pair[0]);
        match steps
            .enumerate()
            .find(|(_, step)| (step - mean).abs() > EVEN * mean)
        {
            Some((k, step)) => Err((k + 1, step, mean)),
            None => Ok(mean),
        }
    }

    /// [`Data::even_step`], refused for what counts in samples.
    pub(crate) fn require_even(&self, what: &'static str) -> Result<f64, Error> {
        self.even_step()
            .map_err(|(index, step, expected)| Error::Uneven {
                record: self.name.clone(),
                index,
                step,
                expected,
                what,
            })
    }
}
