//! The shape of the unknown: what is missing where the catalogue does not explain it.
//!
//! 1. The missing term as a path in time with its band, at each place of the chain (`smooth.rs`); the likelihood picks the
//!    place.
//! 2. What it depends on (`shape.rs`): the share that a polyline in each variable predicts on data that it has not seen.
//! 3. The simple shape that comes nearest (`primitive.rs`), and the effects that leave such a shape.

mod primitive;
mod sentence;
mod shape;
mod smooth;
#[cfg(test)]
mod smooth_tests;

use plants::{Fitted, Place, Structure, Term, Variable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use self::primitive::Primitive;
pub(crate) use self::sentence::of_unknown;
use self::{
    primitive::nearest,
    shape::{Shape, shape},
    smooth::{Smoothed, Spot, smooth},
};
use crate::{Error, node::Node};

/// Half-width of a 95 % band in standard errors.
const BAND: f64 = 1.96;
/// A path is shown where its log-likelihood exceeds that of none that moves by this.
const MOVES: f64 = 5.0;
/// Places whose log-likelihood lies within this of the best are not told apart by it.
pub(crate) const SAME_PLACE: f64 = 10.0;
/// A variable is named where it predicts clearly more than this share of the missing term on unseen data: what depends on it
/// alone is predicted nearly in full, and a record that holds few values of the command ties each of them to a time ...
const NAMED: f64 = 0.8;
/// ... by so many standard errors.
const CLEARLY: f64 = 1.64;

/// A name that the program has: of a type of its own, as serde would borrow a plain reference from what is read.
type Name = &'static str;

/// How likely the missing term acts at a place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceLikelihood {
    /// `actuator`, `vessel` (`upper` or `lower` of two) or `sensor` (`sensor upper` of several).
    pub place: String,
    /// Restricted log-likelihood below that of the best place.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub below_best: f64,
}

/// How much of the missing term a variable predicts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The place.
    pub place: String,
    /// `level`, `rate` or `input`.
    #[serde(deserialize_with = "variable_name")]
    pub variable: Name,
    /// Share of the fall of the squared error that is reached on parts of the data that were not fitted; one is all of it.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub share: f64,
    /// Its standard error, from the scatter between the parts.
    #[serde(deserialize_with = "crate::diagnosis::number")]
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

/// A stretch of time in which the missing term is clearly not zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Its beginning, in the record's time \[s\].
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub from: f64,
    /// Its end \[s\].
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub to: f64,
    /// Mean of the missing term in it, in the term's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub mean: f64,
}

/// What is missing where the catalogue does not explain it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    /// Where it acts: `actuator`, `vessel` (of several by its name, `upper` or `T1`) or `sensor`.
    pub place: String,
    /// Unit of the term: of the command, of a flow, or of the reading.
    pub unit: String,
    /// Every place, the most likely first.
    pub places: Vec<PlaceLikelihood>,
    /// The first record's time, in its own count \[s\].
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub time: Vec<f64>,
    /// The missing term beside the fitted model.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub value: Vec<f64>,
    /// Its standard error.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub std_error: Vec<f64>,
    /// The random walk's standard deviation after one second, in the term's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub intensity: f64,
    /// Standard deviation of the measurement noise beside it, in the output's unit; of several outputs relative to the weighted mean.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub noise: f64,
    /// Where it is clearly not zero, the strongest first.
    pub windows: Vec<Window>,
    /// Root mean square of the residual that it leaves, in the output's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub rmse: f64,
    /// Every variable, the best first.
    pub shares: Vec<Share>,
    /// What it depends on: `level`, `rate`, `input`, or `time` where none of them predicts it.
    #[serde(deserialize_with = "variable_name")]
    pub variable: Name,
    /// Unit of the variable.
    pub variable_unit: String,
    /// Knots of the shape, in the variable's unit; time since the record began.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub knots: Vec<f64>,
    /// The shape at the knots, without what the plant's own parameters imitate.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub ordinates: Vec<f64>,
    /// Standard errors of the ordinates.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub ordinate_errors: Vec<f64>,
    /// The nearest simple shape, where one comes near.
    pub primitive: Option<Primitive>,
}

/// The name of a place, as files have it.
fn place_name(structure: &Structure, spot: Spot) -> String {
    let plant = structure.plant;
    match spot.place {
        Place::Vessel => plant.vessel_name(spot.vessel).unwrap_or("vessel").into(),
        Place::Sensor => match structure.known.output_name(plant, spot.vessel) {
            Some(read) => format!("sensor {read}"),
            None => Place::Sensor.name().into(),
        },
        Place::Actuator => Place::Actuator.name().into(),
    }
}

/// What is left out where the time limit has passed.
pub(crate) const PART: &str = "the shape of what is not explained";

/// The missing term beside a fitted node; `None` where nothing moves, and where the time limit of its setup passes: what was looked at by
/// then says nothing of the other places and variables.
pub(crate) fn unknown(node: &Node) -> Result<Option<Unknown>, Error> {
    let structure = &node.setup.structure;
    let mut spots = vec![Spot {
        place: Place::Actuator,
        vessel: 0,
    }];
    spots.extend((0..structure.plant.vessels()).map(|vessel| Spot {
        place: Place::Vessel,
        vessel,
    }));
    spots.extend((0..node.setup.outputs()).map(|output| Spot {
        place: Place::Sensor,
        vessel: output,
    }));
    let mut smoothed: Vec<Smoothed> = spots
        .into_par_iter()
        .map(|spot| smooth(node, spot))
        .collect::<Result<Vec<_>, Error>>()?
        .into_iter()
        .flatten()
        .collect();
    smoothed.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    let Some(most) = smoothed.first().map(|s| s.log_likelihood) else {
        return Ok(None);
    };
    let places = smoothed
        .iter()
        .map(|s| PlaceLikelihood {
            place: place_name(structure, s.spot),
            below_best: most - s.log_likelihood,
        })
        .collect();
    if smoothed[0].gain < MOVES {
        return Ok(None);
    }
    let possible: Vec<f64> = smoothed[0]
        .paths
        .iter()
        .flat_map(|path| path.residual.iter().copied())
        .collect();
    // A function of the level does not move as a random walk does, so the likelihood of one is weak evidence of the place
    // against a curve that predicts unseen data: every place is tried.
    let candidates: Vec<(&Smoothed, Variable)> = smoothed
        .iter()
        .flat_map(|s| Variable::at(s.spot.place).iter().map(move |v| (s, *v)))
        .filter(|(_, variable)| *variable != Variable::Time)
        .collect();
    let mut shapes: Vec<Shape> = candidates
        .into_par_iter()
        .map(|(smoothed, variable)| shape(node, smoothed, variable, &possible))
        .collect::<Result<Vec<_>, Error>>()?
        .into_iter()
        .flatten()
        .collect();
    if node.setup.leaves_out(PART) {
        return Ok(None);
    }
    shapes.sort_by(|a, b| b.share.total_cmp(&a.share));
    let shares = shapes
        .iter()
        .map(|s| Share {
            place: place_name(structure, s.spot),
            variable: s.variable.name(),
            share: s.share,
            std_error: s.share_error,
        })
        .collect();
    let named = shapes
        .into_iter()
        .next()
        .filter(|s| s.share - CLEARLY * s.share_error > NAMED);
    // The pump and the first vessel are one balance, as far as the likelihood goes: then it is said to be the vessel's.
    let equal = |s: &&Smoothed| most - s.log_likelihood < SAME_PLACE;
    let Some(chosen) = (match &named {
        Some(shape) => smoothed.iter().find(|s| s.spot == shape.spot),
        None => smoothed
            .iter()
            .filter(equal)
            .find(|s| s.spot.place == Place::Vessel)
            .or(smoothed.first()),
    }) else {
        return Ok(None);
    };
    Ok(Some(report(node, places, shares, chosen, named)))
}

/// From the estimates to what is reported.
fn report(
    node: &Node,
    places: Vec<PlaceLikelihood>,
    shares: Vec<Share>,
    chosen: &Smoothed,
    named: Option<Shape>,
) -> Unknown {
    let structure = &node.setup.structure;
    let record = &node.setup.records[0];
    let path = &chosen.paths[0];
    let begin = record.time[0];
    let errors = |covariance: &nalgebra::DMatrix<f64>| -> Vec<f64> {
        covariance
            .diagonal()
            .iter()
            .map(|v| v.max(0.0).sqrt())
            .collect()
    };
    let std_error = errors(&path.covariance);
    let spot = chosen.spot;
    let shape = named.unwrap_or_else(|| Shape {
        spot,
        variable: Variable::Time,
        knots: path.time.clone(),
        ordinates: path.value.clone(),
        information: path
            .covariance
            .clone()
            .pseudo_inverse(1e-12 * path.covariance.amax())
            .unwrap_or_else(|_| nalgebra::DMatrix::identity(path.time.len(), path.time.len())),
        covariance: path.covariance.clone(),
        share: 1.0,
        share_error: 0.0,
    });
    let label = |unit: plants::Unit| {
        let area_known = structure.plant.outlet() == plants::Outlet::Torricelli
            && structure.known.area[0].is_some();
        unit.label(&record.outputs[0].unit, &record.inputs[0].unit, area_known)
    };
    let term = Term {
        name: "unknown".to_string(),
        place: spot.place,
        vessel: spot.vessel,
        variable: shape.variable,
        knots: shape.knots,
        ordinates: shape.ordinates,
        fitted: Fitted::Scale,
    };
    let squares: f64 = chosen
        .paths
        .iter()
        .flat_map(|p| &p.residual)
        .map(|e| e * e)
        .sum();
    Unknown {
        place: place_name(structure, spot),
        unit: label(term.unit()),
        places,
        time: path.time.iter().map(|t| begin + t).collect(),
        windows: windows(begin, &path.time, &path.value, &std_error),
        value: path.value.clone(),
        std_error,
        intensity: (chosen.variance / chosen.lambda).sqrt(),
        noise: chosen.variance.sqrt(),
        rmse: (squares / node.setup.samples() as f64).sqrt(),
        shares,
        variable: shape.variable.name(),
        variable_unit: label(shape.variable.unit()),
        primitive: nearest(
            structure.domain,
            (spot.place, shape.variable),
            &term.knots,
            &term.ordinates,
            &shape.information,
        ),
        ordinate_errors: errors(&shape.covariance),
        knots: term.knots,
        ordinates: term.ordinates,
    }
}

/// Stretches in which the band does not hold zero, the strongest first.
fn windows(begin: f64, time: &[f64], value: &[f64], error: &[f64]) -> Vec<Window> {
    let mut windows: Vec<(f64, Window)> = Vec::new();
    let clear = |i: usize| value[i].abs() > BAND * error[i];
    let mut i = 0;
    while i < time.len() {
        let from = i;
        while i < time.len() && clear(i) && (value[i] > 0.0) == (value[from] > 0.0) {
            i += 1;
        }
        // A single instant is one in twenty by chance.
        if i > from + 1 {
            let sum: f64 = value[from..i].iter().sum();
            let mean = sum / (i - from) as f64;
            let window = Window {
                from: begin + time[from],
                to: begin + time[i - 1],
                mean,
            };
            windows.push((sum.abs(), window));
        }
        i = i.max(from + 1);
    }
    windows.sort_by(|a, b| b.0.total_cmp(&a.0));
    windows.into_iter().map(|(_, window)| window).collect()
}
