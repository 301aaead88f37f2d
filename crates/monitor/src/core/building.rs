//! Builds the running monitor from plain numbers and the stored rows.

use ct_signals::Hold;

use super::{Core, Running};
use crate::{
    bank::windows,
    learn::OutputNoise,
    scatter::{Most, SHARE},
    threshold::threshold,
    tracker::Tracker,
    watch::{Watch, tracked},
};

/// Number of rows for settling when the simulation is built again.
const RUN_UP: usize = 1024;

impl Core {
    pub(super) fn set_checkpoint(&mut self) {
        self.since.clear();
        self.checkpoint.clone_from(&self.now);
    }

    /// A checkpoint, and everything built again from it.
    pub(super) fn settle_checkpoint(&mut self) {
        if let Some(tracker) = self.running.as_ref().and_then(|r| r.tracker.as_ref()) {
            self.now.tracker = Some(tracker.state());
        }
        self.set_checkpoint();
        self.build();
    }

    /// A checkpoint after which the tracker estimates the parameters again, because they have changed abruptly.
    pub(super) fn let_go(&mut self) {
        self.settle_checkpoint();
        if let Some(tracker) = &mut self.now.tracker {
            tracker.open();
        }
        self.set_checkpoint();
        self.build();
    }

    pub(super) fn hold(&self) -> Hold {
        if self.now.every > 1 {
            Hold::First
        } else {
            self.model.0.hold()
        }
    }

    /// Builds what runs, from given states on.
    pub(super) fn start(&mut self, states: &[f64], at_rest: f64) {
        self.running = self.running_from(states, at_rest);
    }

    pub(super) fn running_from(&self, states: &[f64], at_rest: f64) -> Option<Running> {
        let learned = self.now.learned.as_ref()?;
        let bank = self.now.bank.as_ref()?;
        let watch = Watch::new(&self.model, learned, self.hold(), states, at_rest)?;
        let memory = self.settings.memory * learned.time_constant;
        let tracker =
            self.now.tracker.as_ref().and_then(|state| {
                Tracker::new(state, &tracked(learned, bank.parameters()), memory)
            });
        let lanes: Vec<usize> = (0..bank.parameters()).collect();
        let outputs = &learned.outputs;
        let most =
            |output: &OutputNoise, samples| Most::new(&output.scatter, samples, outputs.len());
        // The false alarm rate refers to rows; scores and blocks use means of several rows.
        let samples = self.settings.rows_between_false_alarms / self.now.every as f64;
        let threshold = threshold(
            &windows(learned.rows_per_time_constant()),
            bank.directions(),
            samples / (1.0 - SHARE),
            learned.relative_error()?,
        );
        Some(Running {
            watch,
            tracker,
            covariance: learned.covariance_of(&lanes),
            threshold,
            most: outputs.iter().map(|output| most(output, samples)).collect(),
        })
    }

    /// Builds the running model from the present numbers and the stored rows.
    pub(super) fn build(&mut self) -> Option<()> {
        let from = self.now.kept.len().saturating_sub(RUN_UP);
        let first = self.now.kept.get(from)?;
        let mut running = self.running_from(&first.states, first.stands)?;
        for kept in self.now.kept.range(from..) {
            running.watch.follow(&kept.sample);
        }
        self.running = Some(running);
        Some(())
    }
}
