//! What a monitor needs of the model that it watches: one of the plants, or a model of its user's own.

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
pub struct Watched(pub(crate) Arc<dyn Believed>);

/// An alarm as it was raised, and when it is looked at again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Raised {
    pub stage: Stage,
    /// Now \[s\].
    pub time: f64,
    /// When it was raised \[s\].
    pub since: f64,
    /// What passed, and what it had to pass.
    pub score: f64,
    pub threshold: f64,
    /// The output at which it shows most.
    pub output: usize,
}

/// What the monitor asks of a model.
pub(crate) trait Believed: Send + Sync {
    /// Why it cannot be watched.
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
    /// What a saved state has to agree with.
    fn fingerprint(&self) -> Fingerprint;
    /// The model fitted to rows, and the states at the first of them; in words why it cannot be.
    fn learn(&self, samples: &[Sample], hold: Hold) -> Result<(Learned, Vec<f64>), String>;
    /// Name and unit of each parameter, in the order of [`Learned::theta`]; in words why there are none.
    fn parameters(&self, learned: &Learned, units: &Units)
    -> Result<Vec<(String, String)>, String>;
    /// By how many of so many parameters, the first ones, derivatives are taken.
    fn lanes(&self, parameters: usize) -> usize;
    /// The learned model from these states on; `at_rest`: the first input before.
    fn run(&self, learned: &Learned, states: &[f64], at_rest: f64) -> Option<Box<dyn Running>>;
    /// Puts the states that are read where they are read.
    fn put_readings(&self, states: &mut Each<f64>, readings: &Readings);
    /// The name of an output, of several.
    fn output_name(&self, output: usize) -> Option<String>;
    /// What an output is called in a sentence: "at the ...".
    fn output_words(&self, output: usize, units: &Units) -> String;
    /// The unit of an output.
    fn output_unit(&self, output: usize, units: &Units) -> String;
    /// What the latest rows say of what began; units and times of its sentence are those of `said_in`.
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
