//! A user's own model for the monitor.
//!
//! The parameters that are watched are those that the text declares as `parameter`, in its order; constants and `final parameter`s stay as
//! they are. Those that the model file knows are not fitted, and watched all the same: they may change.

mod isolate;
mod learn;
mod onset;
mod simulation;

use std::collections::BTreeMap;
use std::sync::Arc;

use ct_model::effects::Candidate;
use ct_model::{Given, Model, Variable};
use ct_signals::Hold;
use greybox::PriorValue;
use missing_effect::GROUP_MARGIN;
use plants::Domain;

use self::simulation::running;
use crate::{
    Alarm, Each, Error, NotUsed, Other, Size, Units, Verdict, Watched,
    fingerprint::{Fingerprint, TIME_UNIT},
    intake::{Readings, Sample},
    isolate::Kept,
    learn::Learned,
    sensitivity::Model as Running,
    watched::{Believed, Raised},
};

/// A user's own model, and its known properties.
#[derive(Debug, Clone)]
pub struct OwnModel {
    /// The model.
    pub model: Arc<Model>,
    /// Parameters that are not fitted, by name.
    pub known: BTreeMap<String, f64>,
    /// Priors of parameters, by name.
    pub priors: BTreeMap<String, PriorValue>,
    /// Hold of the inputs between rows.
    pub hold: Hold,
    /// Seconds in one unit of the model's time, above zero.
    pub time_unit: f64,
    /// Candidates of the user's own, for the isolation in addition to the catalogue's effects.
    pub candidates: Arc<[CandidateModel]>,
}

/// A candidate of the user's own, and the watched model with it.
#[derive(Debug, Clone)]
pub struct CandidateModel {
    /// The candidate.
    pub candidate: Candidate,
    /// The monitored model with the candidate inserted: common variables have the same names.
    pub model: Model,
}

impl OwnModel {
    /// The model with default settings: time in seconds, inputs held between rows.
    #[must_use]
    pub fn new(model: impl Into<Arc<Model>>) -> Self {
        Self {
            model: model.into(),
            known: BTreeMap::new(),
            priors: BTreeMap::new(),
            hold: Hold::Zero,
            time_unit: 1.0,
            candidates: Arc::new([]),
        }
    }

    /// Positions of the parameters that are watched among all of the model.
    fn watched(&self) -> Vec<usize> {
        let parameters = self.model.spec().parameters.iter().enumerate();
        let fitted = parameters.filter(|(_, parameter)| parameter.given == Given::Fitted);
        fitted.map(|(i, _)| i).collect()
    }

    /// All parameters, with these values for the monitored ones.
    fn parameters_with(&self, theta: &[f64]) -> Vec<f64> {
        let mut all = self.model.parameters();
        for (value, parameter) in all.iter_mut().zip(&self.model.spec().parameters) {
            *value = *self.known.get(&parameter.about.name).unwrap_or(value);
        }
        for (i, value) in self.watched().into_iter().zip(theta) {
            all[i] = *value;
        }
        all
    }

    fn output(&self, output: usize) -> &ct_model::About {
        let spec = self.model.spec();
        spec.about(spec.outputs[output].variable)
    }
}

/// Adds the result of the isolation to an alarm, if it explains the rows.
fn put_in(alarm: &mut Alarm, suspects: &[isolate::Suspect]) {
    let explains = |best: &&isolate::Suspect| {
        best.plausible && best.evidence > 0.0 && !best.left.is_more_than_noise()
    };
    let Some(best) = suspects.first().filter(explains) else {
        return;
    };
    let near = |s: &&isolate::Suspect| s.plausible && best.evidence - s.evidence < GROUP_MARGIN;
    alarm.effects = suspects
        .iter()
        .filter(near)
        .map(|s| s.effect.clone())
        .collect();
    alarm.verdict = match alarm.effects.len() {
        1 => Verdict::Effect,
        _ => Verdict::Undecided,
    };
    alarm.since = Some(best.since);
    alarm.evidence = Some(best.evidence);
    alarm.next = suspects.get(1).map(|next| Other {
        effect: next.effect.clone(),
        evidence: next.evidence,
    });
    let (name, value, unit) = best.size.clone();
    alarm.size = Some(Size {
        name,
        value,
        unit,
        vessel: None,
        at_sensor: false,
    });
}

impl From<OwnModel> for Watched {
    fn from(model: OwnModel) -> Self {
        Self(Arc::new(model))
    }
}

impl Believed for OwnModel {
    fn check(&self) -> Result<(), Error> {
        if self.model.spec().reads_time() {
            return Err(Error::Time);
        }
        if self.watched().is_empty() {
            return Err(Error::NoParameters);
        }
        Ok(())
    }

    fn inputs(&self) -> usize {
        self.model.spec().inputs.len()
    }

    fn outputs(&self) -> usize {
        self.model.spec().outputs.len()
    }

    fn states(&self) -> usize {
        self.model.spec().states.len()
    }

    fn hold(&self) -> Hold {
        self.hold
    }

    fn check_input(&self, _value: f64) -> Result<(), NotUsed> {
        Ok(())
    }

    fn check_reading(&self, _value: f64) -> Result<(), NotUsed> {
        Ok(())
    }

    fn fingerprint(&self) -> Fingerprint {
        let mut all = Fingerprint::new();
        let mut add = |key: String, value: String| drop(all.insert(key, value));
        // Compared in normalised form: a comment or another layout does not make another model.
        add("model".into(), self.model.spec().to_string());
        add("hold".into(), format!("{:?}", self.hold).to_lowercase());
        add(TIME_UNIT.into(), self.time_unit.to_string());
        for (name, value) in &self.known {
            add(format!("known {name}"), value.to_string());
        }
        for (name, PriorValue { value, std_error }) in &self.priors {
            add(
                format!("prior of {name}"),
                format!("{value} +- {std_error}"),
            );
        }
        all
    }

    fn learn(&self, samples: &[Sample], hold: Hold) -> Result<(Learned, Vec<f64>), String> {
        learn::learn(self, samples, hold)
    }

    fn parameters(
        &self,
        _learned: &Learned,
        _units: &Units,
    ) -> Result<Vec<(String, String)>, String> {
        let named = |i: usize| {
            let about = &self.model.spec().parameters[i].about;
            (about.name.clone(), about.unit.clone())
        };
        Ok(self.watched().into_iter().map(named).collect())
    }

    fn lanes(&self, parameters: usize) -> usize {
        parameters
    }

    fn run(&self, learned: &Learned, states: &[f64], _at_rest: f64) -> Option<Box<dyn Running>> {
        (states.len() == self.states()).then(|| running(self, &learned.theta, states))
    }

    fn put_readings(&self, states: &mut Each<f64>, readings: &Readings) {
        for (output, reading) in self.model.spec().outputs.iter().zip(readings) {
            if let (Variable::State(i), Some(reading)) = (output.variable, reading) {
                states[i] = *reading;
            }
        }
    }

    fn output_name(&self, output: usize) -> Option<String> {
        (self.outputs() > 1).then(|| self.output(output).name.clone())
    }

    fn domain(&self, _units: &Units) -> Option<Domain> {
        None
    }

    fn output_unit(&self, output: usize, _units: &Units) -> String {
        self.output(output).unit.clone()
    }

    fn look(
        &self,
        learned: &Learned,
        hold: Hold,
        rows: &[Kept],
        growth: &Each<f64>,
        raised: &Raised,
        _units: &Units,
    ) -> Alarm {
        let mut alarm = Alarm::unexplained(raised, self.output_name(raised.output));
        alarm.since = onset::onset(self, learned, hold, rows, growth, raised.since);
        let found = alarm.since.map_or_else(Vec::new, |since| {
            isolate::isolate(self, learned, hold, rows, growth, since)
        });
        put_in(&mut alarm, &found);
        alarm
    }
}
