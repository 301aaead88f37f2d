//! The learned model beside the plant: innovations, scores and the tracked parameters, a row at a time.

use ct_signals::{Hold, Whitener};
use plants::{MAX_VESSELS, Structure};

use crate::{
    Innovation,
    bank::Bank,
    intake::Sample,
    isolate::Kept,
    learn::Learned,
    sensitivity::{Model, command, lanes, model},
    tracker::{Tracker, TrackerState},
};

/// The running model; what it holds is rebuilt from rows, and never saved.
pub(crate) struct Watch {
    model: Box<dyn Model>,
    whitener: Whitener,
    hold: Hold,
    inverse_sigma: f64,
    last: Option<Sample>,
    /// Seconds since the last reading.
    since: f64,
    /// A derivative for each lane, one for an offset of the reading, the residual.
    row: Vec<f64>,
}

/// What the learned model says of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Said {
    /// Its levels.
    pub levels: [f64; MAX_VESSELS],
    /// Where what the command moves stands \[input unit\].
    pub stands: f64,
    /// Its reading \[output unit\].
    pub modelled: f64,
    /// What the reading says; `None` where that is lost.
    pub innovation: Option<Innovation>,
    /// Seconds since the reading before; zero for the first.
    pub step: f64,
}

impl Said {
    /// With its row, to be kept.
    pub(crate) fn of(&self, sample: Sample) -> Kept {
        Kept {
            sample,
            levels: self.levels,
            stands: self.stands,
            modelled: self.modelled,
            innovation: self.innovation.map_or(0.0, |said| said.standardised),
        }
    }
}

impl Watch {
    /// From given levels on; `None` where the learned numbers do not make a model.
    pub(crate) fn new(
        structure: &Structure,
        learned: &Learned,
        hold: Hold,
        levels: &[f64],
        at_rest: f64,
    ) -> Option<Self> {
        let lanes = lanes(learned.theta.len());
        let vessels = structure.plant.vessels();
        let model = model(
            structure,
            learned.substeps,
            &learned.theta,
            levels.get(..vessels)?,
            at_rest,
        )
        .ok()?;
        Some(Self {
            model,
            whitener: learned.noise()?.whitener(lanes + 2),
            hold,
            inverse_sigma: 1.0 / learned.sigma,
            last: None,
            since: 0.0,
            row: vec![0.0; lanes + 2],
        })
    }

    /// Follows the plant to its next row.
    pub(crate) fn follow(&mut self, sample: &Sample) -> Said {
        if let Some(last) = &self.last {
            let step = sample.time - last.time;
            self.model.advance(command(self.hold, last, sample), step);
            self.since += step;
        }
        self.last = Some(*sample);
        let lanes = self.row.len() - 2;
        let (levels, stands) = (self.model.levels(), self.model.stands());
        let modelled = self.model.read(&mut self.row[..lanes]);
        let mut said = Said {
            levels,
            stands,
            modelled,
            innovation: None,
            step: 0.0,
        };
        let Some(output) = sample.output else {
            self.whitener.skip();
            return said;
        };
        let residual = output - modelled;
        self.row[lanes] = 1.0;
        self.row[lanes + 1] = residual;
        self.whitener.push(&mut self.row);
        for value in &mut self.row {
            *value *= self.inverse_sigma;
        }
        said.innovation = Some(Innovation {
            residual,
            standardised: self.row[lanes + 1],
        });
        said.step = std::mem::take(&mut self.since);
        said
    }

    /// Lets the scores and the tracker see the reading that was followed last, `growth` times as noisy as was learned.
    pub(crate) fn judge(
        &mut self,
        bank: &mut Bank,
        tracker: Option<&mut Tracker>,
        covariance: &[f64],
        threshold: f64,
        (step, growth): (f64, f64),
    ) -> bool {
        if !self.row.iter().all(|value| value.is_finite()) {
            return false;
        }
        if growth > 1.0 {
            for value in &mut self.row {
                *value /= growth;
            }
        }
        if let Some(tracker) = tracker
            && step > 0.0
        {
            tracker.update(&self.row, step);
        }
        bank.update(&self.row, covariance, threshold)
    }
}

/// The tracker as it was learned.
pub(crate) fn as_learned(learned: &Learned) -> TrackerState {
    let positions: Vec<usize> = tracked(learned).iter().map(|(i, _)| *i).collect();
    TrackerState::learned(&learned.covariance_of(&positions))
}

/// Lanes and learned standard errors of the parameters that are tracked.
pub(crate) fn tracked(learned: &Learned) -> Vec<(usize, f64)> {
    let mut errors = learned.errors();
    errors.retain(|(i, _)| *i < lanes(learned.theta.len()));
    errors
}
