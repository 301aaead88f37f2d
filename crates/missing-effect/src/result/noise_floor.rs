//! The noise floor of each output.

use ct_signals::ArModel;
use greybox::Noise;
use serde::{Deserialize, Serialize};

/// The model whose residual a noise floor was estimated from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// The believed model, without effects.
    BelievedModel,
    /// The final model, with all accepted effects.
    FinalModel,
    /// The model with the most effects of those that were tried.
    RichestModel,
    /// The last model of a diagnosis of a user's own model.
    LastModel,
    /// The only model: a user's own one that is compared.
    OnlyModel,
}

/// The noise floor of an output and how it was obtained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    /// Name of the output.
    pub output: String,
    /// Standard deviation of the noise, in the output's unit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub level: f64,
    /// Standard deviation of what cannot be predicted from its own past, in the output's unit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub innovation: f64,
    /// Autoregressive coefficients of the noise: `v[k] = sum a_i v[k-i] + e[k]`; empty for white noise.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub coefficients: Vec<f64>,
    /// The model whose residual it was estimated from.
    pub source: NoiseSource,
    /// Whether `level` is the standard deviation of the innovation, because the residual is more than noise.
    pub of_innovation: bool,
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
            floor.of_innovation = true;
        }
        self
    }
}
