//! The unexplained error, if the catalogue does not explain it.

use plants::{EffectInfo, Variable};
use serde::{Deserialize, Serialize};

/// A name in the program: a separate type, because serde would borrow a plain reference from the input.
pub(crate) type Name = &'static str;

/// The names of simple shapes.
pub(crate) const SHAPES: [Name; 8] = [
    "constant",
    "line",
    "square root",
    "parabola",
    "threshold",
    "end of a range",
    "step",
    "swing",
];

/// Likelihood of a place of the missing term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceLikelihood {
    /// `actuator`, `vessel` (`upper` or `lower` of two) or `sensor` (`sensor upper` of several).
    pub place: String,
    /// Restricted log-likelihood below that of the best place.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub below_best: f64,
}

/// Share of the missing term that a variable predicts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The place.
    pub place: String,
    /// `level`, `rate` or `input`.
    #[serde(deserialize_with = "variable_name")]
    pub variable: Name,
    /// Share of the fall of the squared error that is reached on parts of the data that were not fitted; 1 means all of it.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub share: f64,
    /// Standard error of the share, from its variation between the parts.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub std_error: f64,
}

/// Reads the name of a variable.
fn variable_name<'de, D: serde::Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    let name = String::deserialize(from)?;
    let all = [
        Variable::Level,
        Variable::Rate,
        Variable::Input,
        Variable::Time,
    ];
    let known = all
        .iter()
        .map(|variable| variable.name())
        .find(|known| *known == name);
    known.ok_or_else(|| serde::de::Error::custom(format_args!("no variable is called `{name}`")))
}

/// An interval in which the missing term differs clearly from zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Begin in the record's time \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub from: f64,
    /// End \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub to: f64,
    /// Mean of the missing term in it, in the term's unit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub mean: f64,
}

/// The unexplained error, if the catalogue does not explain it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    /// Place of the term: `actuator`, `vessel` (of several by its name, `upper` or `T1`) or `sensor`.
    pub place: String,
    /// Unit of the term: of the command, of a flow, or of the reading.
    pub unit: String,
    /// Every place, the most likely first.
    pub places: Vec<PlaceLikelihood>,
    /// The first record's time, by its own clock \[s\].
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub time: Vec<f64>,
    /// The missing term in addition to the fitted model.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub value: Vec<f64>,
    /// Standard errors.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub std_error: Vec<f64>,
    /// The random walk's standard deviation after one second, in the term's unit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub intensity: f64,
    /// Standard deviation of the measurement noise, in the output's unit; with several outputs relative to the weighted mean.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub noise: f64,
    /// Windows in which the term differs clearly from zero, the strongest first.
    pub windows: Vec<Window>,
    /// Root mean square of the residual after subtraction of the term, in the output's unit.
    #[serde(deserialize_with = "effect_search::not_finite::number")]
    pub rmse: f64,
    /// Every variable, the best first.
    pub shares: Vec<Share>,
    /// Variable of the term: `level`, `rate`, `input`, or `time` if none of these predicts it.
    #[serde(deserialize_with = "variable_name")]
    pub variable: Name,
    /// Unit of the variable.
    pub variable_unit: String,
    /// Knots of the shape, in the variable's unit; time since the record began.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub knots: Vec<f64>,
    /// The function at the knots, without the part that the plant's own parameters explain.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub ordinates: Vec<f64>,
    /// Standard errors of the ordinates.
    #[serde(deserialize_with = "effect_search::not_finite::numbers")]
    pub ordinate_errors: Vec<f64>,
    /// The closest simple function, if one is close.
    pub primitive: Option<Primitive>,
}

/// A simple shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Primitive {
    /// `constant`, `line`, `square root`, `parabola`, `threshold`, `end of a range`, `step` or `swing`.
    #[serde(deserialize_with = "family_name")]
    pub name: Name,
    /// Location of a threshold or a step, or the period of an oscillation, in the variable's unit.
    pub at: Option<f64>,
    /// Effects of the catalogue with such a shape.
    #[serde(deserialize_with = "effect_names")]
    pub effects: Vec<&'static str>,
}

/// Reads the name of a shape.
fn family_name<'de, D: serde::Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    let name = String::deserialize(from)?;
    let known = SHAPES.iter().find(|shape| **shape == name);
    known
        .copied()
        .ok_or_else(|| serde::de::Error::custom(format_args!("no shape is called `{name}`")))
}

/// Reads identifiers of effects.
fn effect_names<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Vec<&'static str>, D::Error> {
    let names = Vec::<String>::deserialize(from)?;
    let known = names.iter().map(|name| {
        let known = EffectInfo::find(name).map(|effect| effect.id);
        known.ok_or_else(|| serde::de::Error::custom(format_args!("no effect is called `{name}`")))
    });
    known.collect()
}
