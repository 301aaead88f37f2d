//! The unexplained error: the missing term, if the catalogue does not explain it.
//!
//! 1. The missing term as a path in time with its band, at each place of the chain (`smooth.rs`); the likelihood picks the
//!    place.
//! 2. What it depends on (`shape.rs`): the share that a polyline in each variable predicts on data that it has not seen.
//! 3. The simple shape that comes nearest (`primitive.rs`), and the effects that leave such a shape.

mod knots;
mod primitive;
mod shape;
mod smooth;
#[cfg(test)]
mod smooth_tests;

use plants::{Fitted, Place, Structure, Term, Variable};
use rayon::prelude::*;

use self::{
    primitive::nearest,
    shape::{Shape, shape},
    smooth::{Smoothed, Spot, smooth},
};
use crate::{Error, PlaceLikelihood, Share, Unknown, Window, fit::node::Node};

/// Half-width of a 95 % band in standard errors.
const BAND: f64 = 1.96;
/// A path is shown if its log-likelihood exceeds that of a constant by this.
const MOVES: f64 = 5.0;
/// Places of the missing term with restricted log-likelihoods within this distance of the best are not distinguished.
pub const PLACE_MARGIN: f64 = 10.0;
/// A variable is named if it predicts clearly more than this share of the missing term on unseen data: a function of this variable alone is
/// predicted nearly in full, and in a record with few values of the command each value belongs to a certain time ...
const NAMED: f64 = 0.8;
/// ... by this number of standard errors.
const CLEARLY: f64 = 1.64;

/// The name of a place in files.
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

/// Step that is left out if the time limit has passed.
pub(crate) const PART: &str = "the shape of the unexplained error";

/// The missing term for a fitted model; `None` if no path is significant, or if the time limit passes, because partial results contain no
/// information about the other places and variables.
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
    // A function of the level is not a random walk, so the likelihood of a random walk is weaker evidence for a place than a curve that
    // predicts unseen data: every place is tried.
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
    // If the likelihood does not distinguish the pump and the first vessel, the vessel is reported.
    let equal = |s: &&Smoothed| most - s.log_likelihood < PLACE_MARGIN;
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

/// Report of the estimates.
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

/// Intervals in which the band excludes zero, the strongest first.
fn windows(begin: f64, time: &[f64], value: &[f64], error: &[f64]) -> Vec<Window> {
    let mut windows: Vec<(f64, Window)> = Vec::new();
    let clear = |i: usize| value[i].abs() > BAND * error[i];
    let mut i = 0;
    while i < time.len() {
        let from = i;
        while i < time.len() && clear(i) && (value[i] > 0.0) == (value[from] > 0.0) {
            i += 1;
        }
        // A single instant is significant by chance in one of twenty cases.
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
