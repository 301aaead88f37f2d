//! Learned parameters of a plant and of its noise.

use ct_signals::{ArModel, Hold};
use greybox::{Noise, PriorValue};
use plants::{Known, Placed, Plant, Scales, Structure, Term};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::{MOST_COEFFICIENTS, MOST_SUBSTEPS};
use crate::core::KEPT;
use crate::scatter::Limit;
use crate::threshold::relative_error;

/// The believed model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The plant.
    pub plant: Plant,
    /// Known constants of the plant.
    pub known: Known,
    /// The effects in the model.
    pub effects: Vec<Placed>,
    /// Terms of the user's own in the model.
    pub terms: Vec<Term>,
    /// First guesses by name: `alpha`, `overflow.rim`.
    pub start: BTreeMap<String, f64>,
    /// Names in `start` that are not fitted, but monitored.
    pub fixed: Vec<String>,
    /// Priors of parameters, by the same names.
    pub priors: BTreeMap<String, PriorValue>,
    /// Hold of the command between rows.
    pub hold: Hold,
}

impl Model {
    /// The plant with default settings of its parameters, under a command that is held between rows.
    #[must_use]
    pub fn new(plant: Plant, known: Known) -> Self {
        Self {
            plant,
            known,
            effects: Vec::new(),
            terms: Vec::new(),
            start: BTreeMap::new(),
            fixed: Vec::new(),
            priors: BTreeMap::new(),
            hold: Hold::Zero,
        }
    }

    /// The plant with its effects.
    pub(crate) fn structure(&self, scales: Scales) -> Result<Structure, plants::Error> {
        let plant = Structure::new(self.plant, self.known.clone(), scales);
        let effects = self
            .effects
            .iter()
            .try_fold(plant, |structure, &placed| structure.with(placed))?;
        self.terms
            .iter()
            .try_fold(effects, |structure, term| structure.with_term(term.clone()))
    }

    pub(super) fn fixed(&self) -> BTreeMap<String, f64> {
        let value = |name: &String| Some((name.clone(), *self.start.get(name)?));
        self.fixed.iter().filter_map(value).collect()
    }
}

/// Result of learning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Learned {
    /// The parameters, in the structure's order.
    pub theta: Vec<f64>,
    /// Covariance of the parameters, row by row; zero for a parameter that was not fitted, or is held at a bound.
    pub covariance: Vec<f64>,
    /// The noise of each output.
    pub outputs: Vec<OutputNoise>,
    /// The slowest time constant \[s\].
    pub time_constant: f64,
    /// The usual step of the time \[s\].
    pub interval: f64,
    /// Typical operating states.
    pub operating: Vec<f64>,
    /// For a plant: scales of its effects, and steps of the simulation per interval.
    pub scales: Option<Scales>,
    pub substeps: usize,
}

/// The noise of an output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OutputNoise {
    /// Coefficients and innovations' standard deviation \[output unit\].
    pub coefficients: Vec<f64>,
    pub sigma: f64,
    /// Number of readings in the learning phase.
    pub readings: usize,
    /// Limit of the differences between neighbouring innovations.
    pub scatter: Limit,
}

impl OutputNoise {
    pub(crate) fn model(&self) -> Option<ArModel> {
        ArModel::from_coefficients(&self.coefficients, self.sigma).ok()
    }

    fn sound(&self) -> bool {
        self.sigma.is_finite()
            && self.sigma > 0.0
            && self.readings <= KEPT
            && self.coefficients.len() <= MOST_COEFFICIENTS
            && self.model().is_some()
            && self.scatter.sound()
    }
}

impl Learned {
    pub(crate) fn noise(&self) -> Option<Noise> {
        let models: Option<Vec<ArModel>> = self.outputs.iter().map(OutputNoise::model).collect();
        models.map(Noise::of)
    }

    /// Number of rows in the learning phase.
    pub(crate) fn rows(&self) -> usize {
        let readings = self.outputs.iter().map(|output| output.readings);
        readings.max().unwrap_or(0)
    }

    /// The relative standard error of the noise's slow part ([`relative_error`]) at the output where it is largest, because this output may
    /// be the only one that shows a change.
    pub(crate) fn relative_error(&self) -> Option<f64> {
        let of_output = |output: &OutputNoise| {
            let model = output.model()?;
            Some(relative_error(&model, output.readings))
        };
        let errors: Option<Vec<f64>> = self.outputs.iter().map(of_output).collect();
        Some(errors?.into_iter().fold(0.0, f64::max))
    }

    /// The slowest time constant in rows.
    pub(crate) fn rows_per_time_constant(&self) -> f64 {
        self.time_constant / self.interval
    }

    /// Positions and standard errors of the parameters that were fitted.
    pub(crate) fn errors(&self) -> Vec<(usize, f64)> {
        let n = self.theta.len();
        (0..n)
            .map(|i| (i, self.covariance[i * n + i].sqrt()))
            .filter(|(_, error)| *error > 0.0)
            .collect()
    }

    /// The covariance among some of the parameters, row by row.
    pub(crate) fn covariance_of(&self, positions: &[usize]) -> Vec<f64> {
        let n = self.theta.len();
        positions
            .iter()
            .flat_map(|i| positions.iter().map(move |j| self.covariance[i * n + j]))
            .collect()
    }

    pub(crate) fn sound(&self, parameters: usize, outputs: usize) -> bool {
        let finite = [self.time_constant, self.interval];
        self.theta.len() == parameters
            && self.covariance.len() == parameters * parameters
            && finite.iter().all(|v| v.is_finite() && *v > 0.0)
            && self.substeps <= MOST_SUBSTEPS
            && self.outputs.len() == outputs
            && self.outputs.iter().all(OutputNoise::sound)
    }
}
