//! The noise of several outputs: an autoregressive process each, independent of each other.

use ct_signals::{ArModel, Whitener};
use serde::{Deserialize, Serialize};

use crate::Error;

/// Noise model of each output. Its scales are the standard deviations of the innovations, in the outputs' units. A fit estimates the scales
/// itself and uses only the AR coefficients of the given noise model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Reflections>", into = "Vec<Reflections>")]
pub struct Noise {
    outputs: Vec<ArModel>,
}

/// Saved form of a process: its partial correlations and the standard deviation of its innovations, from which it is restored exactly.
type Reflections = (Vec<f64>, f64);

impl From<Noise> for Vec<Reflections> {
    fn from(noise: Noise) -> Self {
        let of = |model: &ArModel| (model.reflections().to_vec(), model.sigma());
        noise.outputs.iter().map(of).collect()
    }
}

impl TryFrom<Vec<Reflections>> for Noise {
    type Error = ct_signals::Error;

    fn try_from(all: Vec<Reflections>) -> Result<Self, Self::Error> {
        let of = |(reflections, sigma): Reflections| ArModel::from_reflections(&reflections, sigma);
        Ok(Self {
            outputs: all.into_iter().map(of).collect::<Result<_, _>>()?,
        })
    }
}

impl Noise {
    /// Standard deviation of the innovations of each output \[its unit\].
    #[must_use]
    pub fn sigmas(&self) -> Vec<f64> {
        self.outputs.iter().map(ArModel::sigma).collect()
    }

    /// White noise of unit variance at this number of outputs.
    #[must_use]
    pub fn white(outputs: usize) -> Self {
        Self {
            outputs: vec![ArModel::white(1.0); outputs],
        }
    }

    /// The noise of outputs, at least one, in order.
    #[must_use]
    pub fn of(outputs: Vec<ArModel>) -> Self {
        Self { outputs }
    }

    /// The noise model of each output from its series, of order zero to `most`. Series follow each other by record and, within one, by
    /// output.
    ///
    /// # Errors
    /// Where a series is not finite, or an output has no sample.
    pub fn fit(series: &[Vec<f64>], outputs: usize, most: usize) -> Result<Self, Error> {
        let of_output = |o: usize| {
            let own: Vec<&[f64]> = series
                .iter()
                .skip(o)
                .step_by(outputs)
                .map(Vec::as_slice)
                .collect();
            Ok(ArModel::fit(&own, most)?)
        };
        Ok(Self {
            outputs: (0..outputs).map(of_output).collect::<Result<_, Error>>()?,
        })
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// The model of an output, counted from zero.
    #[must_use]
    pub fn output(&self, output: usize) -> &ArModel {
        &self.outputs[output]
    }

    /// The model of a series, where these follow each other by record and, within one, by output.
    #[must_use]
    pub fn of_series(&self, series: usize) -> &ArModel {
        &self.outputs[series % self.outputs.len()]
    }

    /// The models in order.
    pub fn iter(&self) -> impl Iterator<Item = &ArModel> {
        self.outputs.iter()
    }

    /// Coefficients of all outputs together; zero where all are white.
    #[must_use]
    pub fn order(&self) -> usize {
        self.outputs.iter().map(ArModel::order).sum()
    }

    /// Whether the AR coefficients are equal: the scales may differ.
    #[must_use]
    pub fn same_colour(&self, other: &Self) -> bool {
        self.outputs.len() == other.outputs.len()
            && self
                .outputs
                .iter()
                .zip(&other.outputs)
                .all(|(own, other)| own.coefficients() == other.coefficients())
    }

    /// The largest difference between two models' coefficients; infinite where their orders differ.
    #[must_use]
    pub fn difference(&self, other: &Self) -> f64 {
        let pairs = self.outputs.iter().zip(&other.outputs);
        pairs.fold(0.0, |most, (a, b)| {
            if a.order() != b.order() {
                return f64::INFINITY;
            }
            let each = a.coefficients().iter().zip(b.coefficients());
            each.map(|(a, b)| (a - b).abs()).fold(most, f64::max)
        })
    }

    /// The noise model with the memory of each output limited to this number of samples ([`ArModel::with_memory_at_most`]).
    #[must_use]
    pub fn with_memory_at_most(&self, samples: f64) -> Self {
        Self {
            outputs: self
                .outputs
                .iter()
                .map(|model| model.with_memory_at_most(samples))
                .collect(),
        }
    }

    /// Every series whitened, each by the model of its output; innovations have the scale of the noise, not one.
    #[must_use]
    pub fn whiten(&self, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let whitened = series.iter().enumerate();
        whitened
            .map(|(i, series)| self.of_series(i).whiten(series))
            .collect()
    }

    /// A filter for each output that whitens rows of `lanes` values.
    #[must_use]
    pub fn whiteners(&self, lanes: usize) -> Vec<Whitener> {
        let outputs = self.outputs.iter();
        outputs.map(|model| model.whitener(lanes)).collect()
    }

    /// Noise model with scales relative to that of the first output, and the square of the first scale. With one output the relative scale
    /// is one.
    pub(crate) fn relative(&self) -> (Self, f64) {
        let first = self.outputs[0].sigma();
        let relative = |model: &ArModel| {
            let scale = model.sigma().max(f64::MIN_POSITIVE) / first.max(f64::MIN_POSITIVE);
            model.with_sigma(scale)
        };
        let outputs = self.outputs.iter().map(relative).collect();
        (Self { outputs }, first * first)
    }

    /// Inverse scale of each output.
    pub(crate) fn inverse_scales(&self) -> Vec<f64> {
        let outputs = self.outputs.iter();
        outputs.map(|model| 1.0 / model.sigma()).collect()
    }
}
