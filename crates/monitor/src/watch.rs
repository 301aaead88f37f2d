//! The learned model run in parallel with the plant: innovations, scores and the tracked parameters, row by row.

use ct_signals::{Hold, Whitener};

use crate::{
    Each, Innovation,
    bank::Bank,
    intake::Sample,
    isolate::Kept,
    learn::Learned,
    sensitivity::Model,
    tracker::{Tracker, TrackerState},
    watched::Watched,
};

/// The running model; it is rebuilt from rows, and never saved.
pub(crate) struct Watch {
    model: Box<dyn Model>,
    /// The noise of each output: what whitens it, and one over its standard deviation.
    noises: Vec<(Whitener, f64)>,
    hold: Hold,
    last: Option<Sample>,
    /// Seconds since the last sample with a reading.
    since: f64,
    lanes: usize,
    /// A row for each output: a derivative for each seed, one for an offset of each output, the residual. Those of the outputs that have a
    /// reading come first, in order.
    rows: Vec<f64>,
    /// Outputs that have a reading.
    read: Vec<usize>,
}

/// Output of the learned model for a row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Said {
    /// States of the model.
    pub states: Each<f64>,
    /// State of the actuator \[input unit\].
    pub stands: f64,
    /// Simulated readings \[output unit\].
    pub modelled: Each<f64>,
    /// Innovation of each reading; `None` if the reading is missing.
    pub innovations: Each<Option<Innovation>>,
    /// Seconds since the sample with a reading before; zero for the first.
    pub step: f64,
}

impl Said {
    /// The same with its row, for storage.
    pub(crate) fn of(&self, sample: Sample) -> Kept {
        Kept {
            sample,
            states: self.states.clone(),
            stands: self.stands,
            modelled: self.modelled.clone(),
            innovations: self
                .innovations
                .iter()
                .map(|said| said.map_or(0.0, |said| said.standardised))
                .collect(),
        }
    }

    /// Whether any output has a reading.
    pub(crate) fn any(&self) -> bool {
        self.innovations.iter().any(Option::is_some)
    }
}

impl Watch {
    /// Starts from given states; `None` if the learned numbers do not make a model.
    pub(crate) fn new(
        model: &Watched,
        learned: &Learned,
        hold: Hold,
        states: &[f64],
        at_rest: f64,
    ) -> Option<Self> {
        let lanes = model.0.lanes(learned.theta.len());
        let outputs = learned.outputs.len();
        Some(Self {
            model: model.0.run(learned, states, at_rest)?,
            noises: learned
                .noise()?
                .iter()
                .map(|noise| (noise.whitener(lanes + outputs + 1), 1.0 / noise.sigma()))
                .collect(),
            hold,
            last: None,
            since: 0.0,
            lanes,
            rows: vec![0.0; outputs * (lanes + outputs + 1)],
            read: Vec::with_capacity(outputs),
        })
    }

    /// Simulates the plant to the next row.
    pub(crate) fn follow(&mut self, sample: &Sample) -> Said {
        if let Some(last) = &self.last {
            self.model.advance(self.hold, last, sample);
            self.since += sample.time - last.time;
        }
        self.model.observe(sample);
        self.last = Some(sample.clone());
        let mut said = Said {
            states: self.model.states(),
            stands: self.model.stands(),
            modelled: Each::new(),
            innovations: Each::new(),
            step: 0.0,
        };
        let (lanes, last) = (self.lanes, self.lanes + self.noises.len());
        self.read.clear();
        for (output, (whitener, inverse_sigma)) in self.noises.iter_mut().enumerate() {
            let row = &mut self.rows[self.read.len() * (last + 1)..][..=last];
            let modelled = self.model.read(output, &mut row[..lanes]);
            said.modelled.push(modelled);
            let Some(reading) = sample.outputs[output] else {
                whitener.skip();
                said.innovations.push(None);
                continue;
            };
            let residual = reading - modelled;
            row[lanes..last].fill(0.0);
            row[lanes + output] = 1.0;
            row[last] = residual;
            whitener.push(row);
            for value in row.iter_mut() {
                *value *= *inverse_sigma;
            }
            said.innovations.push(Some(Innovation {
                residual,
                standardised: row[last],
            }));
            self.read.push(output);
        }
        if said.any() {
            said.step = std::mem::take(&mut self.since);
        }
        said
    }

    /// Updates the scores and the tracker with the latest readings, with the noise of each output `growth` times the learned one.
    pub(crate) fn judge(
        &mut self,
        bank: &mut Bank,
        tracker: Option<&mut Tracker>,
        covariance: &[f64],
        threshold: f64,
        (step, growth): (f64, &Each<f64>),
    ) -> bool {
        let width = self.lanes + self.noises.len() + 1;
        let rows = &mut self.rows[..self.read.len() * width];
        if !rows.iter().all(|value| value.is_finite()) {
            return false;
        }
        for (row, output) in rows.chunks_exact_mut(width).zip(&self.read) {
            if growth[*output] > 1.0 {
                for value in row {
                    *value /= growth[*output];
                }
            }
        }
        if let Some(tracker) = tracker
            && step > 0.0
        {
            tracker.update(rows.chunks_exact(width), step);
        }
        bank.update(rows, covariance, threshold)
    }
}

/// The tracker after learning.
pub(crate) fn as_learned(learned: &Learned, lanes: usize) -> TrackerState {
    let positions: Vec<usize> = tracked(learned, lanes).iter().map(|(i, _)| *i).collect();
    TrackerState::learned(&learned.covariance_of(&positions))
}

/// Seed indices and learned standard errors of the tracked parameters, if they have a seed index.
pub(crate) fn tracked(learned: &Learned, lanes: usize) -> Vec<(usize, f64)> {
    let mut errors = learned.errors();
    errors.retain(|(i, _)| *i < lanes);
    errors
}
