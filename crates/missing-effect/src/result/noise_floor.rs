//! The noise floor of each output.

use ct_signals::ArModel;
use greybox::Noise;
use serde::{Deserialize, Serialize};

/// The noise floor of an output and how it was obtained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    /// Name of the output.
    pub output: String,
    /// Standard deviation of the noise, in the output's unit.
    #[serde(deserialize_with = "crate::result::number")]
    pub level: f64,
    /// Standard deviation of what cannot be predicted from its own past, in the output's unit.
    #[serde(deserialize_with = "crate::result::number")]
    pub innovation: f64,
    /// Autoregressive coefficients of the noise: `v[k] = sum a_i v[k-i] + e[k]`; empty for white noise.
    #[serde(deserialize_with = "crate::result::numbers")]
    pub coefficients: Vec<f64>,
    /// In words: which model's residual it was estimated from.
    pub source: String,
}

impl NoiseFloor {
    /// Noise model for residual tests: the level of the noise floor and, if the floor is that of the noise, its spectrum.
    fn model(&self) -> Result<ArModel, ct_signals::Error> {
        if self.level > self.innovation {
            ArModel::from_coefficients(&self.coefficients, self.innovation)
        } else {
            Ok(ArModel::white(self.level))
        }
    }
}

/// The noise floors of all outputs.
#[derive(Debug, Clone)]
pub(crate) struct Floors(pub Vec<NoiseFloor>);
impl Floors {
    /// Noise model for residual tests.
    pub fn noise(&self) -> Result<Noise, ct_signals::Error> {
        let models: Result<_, _> = self.0.iter().map(NoiseFloor::model).collect();
        Ok(Noise::of(models?))
    }

    /// Limits the noise floors by the errors of the fitted models: a model's error contains the noise.
    pub fn at_most(mut self, rmse: &[f64]) -> Self {
        for (floor, rmse) in self.0.iter_mut().zip(rmse) {
            floor.level = floor.level.min(*rmse);
            floor.innovation = floor.innovation.min(*rmse);
        }
        self
    }

    /// The noise floors if the residual is not noise alone: the residual contains the model error too, but its innovations hardly do.
    pub fn of_what_is_new(mut self) -> Self {
        for floor in &mut self.0 {
            floor.level = floor.innovation;
            floor.source = format!(
                "innovation of {}: the part that its past does not predict",
                floor.source
            );
        }
        self
    }
}
