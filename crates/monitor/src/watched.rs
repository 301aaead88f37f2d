//! Interface of a monitored model: a built-in plant, or a user's own model.

use std::sync::Arc;

use ct_signals::Hold;
use plants::Domain;

use crate::{
    Alarm, Each, Error, NotUsed, Stage, Units,
    fingerprint::Fingerprint,
    intake::{Readings, Sample},
    isolate::Kept,
    learn::Learned,
    sensitivity::Model as Running,
};

/// A model that can be watched; from a [`Model`](crate::Model) or an [`OwnModel`](crate::OwnModel).
#[derive(Clone)]
pub struct Watched(pub(crate) Arc<dyn Believed>);

/// An alarm, and the times of its evaluations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Raised {
    pub stage: Stage,
    /// Now \[s\].
    pub time: f64,
    /// Time of the alarm \[s\].
    pub since: f64,
    /// The score that exceeded its threshold, and the threshold.
    pub score: f64,
    pub threshold: f64,
    /// The output with the largest deviation.
    pub output: usize,
}

/// Interface of a model for the monitor.
pub(crate) trait Believed: Send + Sync {
    /// Reason why the model cannot be monitored.
    fn check(&self) -> Result<(), Error>;
    fn inputs(&self) -> usize;
    fn outputs(&self) -> usize;
    fn states(&self) -> usize;
    /// What the inputs do between rows.
    fn hold(&self) -> Hold;
    /// An input outside the possible range of this plant.
    fn check_input(&self, value: f64) -> Result<(), NotUsed>;
    /// A reading outside the possible range of this plant's sensors.
    fn check_reading(&self, value: f64) -> Result<(), NotUsed>;
    /// Properties that a saved state has to agree with.
    fn fingerprint(&self) -> Fingerprint;
    /// The model fitted to rows, and the states at the first of them; or the reason in words why there is none.
    fn learn(&self, samples: &[Sample], hold: Hold) -> Result<(Learned, Vec<f64>), String>;
    /// Name and unit of each parameter, in the order of [`Learned::theta`]; or the reason in words why there are none.
    fn parameters(&self, learned: &Learned, units: &Units)
    -> Result<Vec<(String, String)>, String>;
    /// Number of the first parameters for which derivatives are computed.
    fn lanes(&self, parameters: usize) -> usize;
    /// The learned model from these states on; `at_rest`: the input before the first row.
    fn run(&self, learned: &Learned, states: &[f64], at_rest: f64) -> Option<Box<dyn Running>>;
    /// Sets the measured states to their readings.
    fn put_readings(&self, states: &mut Each<f64>, readings: &Readings);
    /// The name of an output, of several.
    fn output_name(&self, output: usize) -> Option<String>;
    /// The domain of a plant; `None` for a user's own model.
    fn domain(&self, units: &Units) -> Option<Domain>;
    /// The unit of an output.
    fn output_unit(&self, output: usize, units: &Units) -> String;
    /// Evaluates the latest rows after the onset of a change.
    fn look(
        &self,
        learned: &Learned,
        hold: Hold,
        rows: &[Kept],
        growth: &Each<f64>,
        raised: &Raised,
        units: &Units,
    ) -> Alarm;
}
