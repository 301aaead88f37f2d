//! Interface of a monitored model: a built-in plant, or a user's own model.

use std::sync::Arc;

use ct_signals::Hold;

use crate::{
    Alarm, Each, Error, Refused, Stage, TimeAxis, Units,
    fingerprint::Fingerprint,
    intake::{Readings, Sample},
    isolate::Kept,
    learn::Learned,
    sensitivity::Model as Running,
};

/// A model that can be watched; from a [`Model`](crate::Model) or an [`OwnModel`](crate::OwnModel).
#[derive(Clone)]
pub struct Watched<'a>(pub(crate) Arc<dyn Believed<'a> + 'a>);

/// An alarm as it was raised, and when it is looked at again.
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

/// Interface of a model for the monitor. States and simulations of a user's own model have the lifetime `'a`.
pub(crate) trait Believed<'a>: Send + Sync {
    /// Reason why the model cannot be monitored.
    fn check(&self) -> Result<(), Error>;
    fn inputs(&self) -> usize;
    fn outputs(&self) -> usize;
    fn states(&self) -> usize;
    /// What the inputs do between rows.
    fn hold(&self) -> Hold;
    /// An input that no row of this plant has.
    fn check_input(&self, value: f64) -> Result<(), Refused>;
    /// A reading that no sensor of this plant gives.
    fn check_reading(&self, value: f64) -> Result<(), Refused>;
    /// Properties that a saved state has to agree with.
    fn fingerprint(&self) -> Fingerprint;
    /// The model fitted to rows, and the states at the first of them; in words why it cannot be.
    fn learn(&self, samples: &[Sample], hold: Hold) -> Result<(Learned, Vec<f64>), String>;
    /// Name and unit of each parameter, in the order of [`Learned::theta`]; or the reason in words why there are none.
    fn parameters(&self, learned: &Learned, units: &Units)
    -> Result<Vec<(String, String)>, String>;
    /// Number of the first parameters for which derivatives are computed.
    fn lanes(&self, parameters: usize) -> usize;
    /// The learned model from these states on; `at_rest`: the input before the first row.
    fn run(&self, learned: &Learned, states: &[f64], at_rest: f64)
    -> Option<Box<dyn Running + 'a>>;
    /// Puts the states that are read where they are read.
    fn put_readings(&self, states: &mut Each<f64>, readings: &Readings);
    /// The name of an output, of several.
    fn output_name(&self, output: usize) -> Option<String>;
    /// Name of an output in a sentence: "at the ...".
    fn output_words(&self, output: usize, units: &Units) -> String;
    /// The unit of an output.
    fn output_unit(&self, output: usize, units: &Units) -> String;
    /// Evaluates the latest rows after the onset of a change; `said_in` has the units and times of the sentence.
    fn look(
        &self,
        learned: &Learned,
        hold: Hold,
        rows: &[Kept],
        growth: &Each<f64>,
        raised: &Raised,
        said_in: (&Units, &TimeAxis),
    ) -> Alarm;
}
