//! The unexplained error as a function: place, variable and shape.
//!
//! At every port a smooth function ([`ct_model::effects::shapes_keeping`]) of every state and input is added to the model and fitted with
//! all other parameters. A smooth function can fit any error, so ports and variables are compared by cross-validation: the error on quarters
//! of the records to which the function was not fitted, against the error of the model without it on the records to which it was fitted. If
//! no function lowers this error, functions of time are tried too, and BIC selects.

use std::collections::BTreeMap;

use ct_model::effects::{Candidate, Port, bells};
use ct_model::{ModelSpec, Variable};
use estimation::Noise;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::accept::partial::{explained, fall};
use crate::fit::estimate::{Estimate, sizes};
use crate::fit::node::{Context, FINE, Node, ROUGH};
use crate::search::grow::best_first;

/// A smooth function at a port.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PortScore {
    /// Identifier of the function: `shape(T,u)`, `course(T)`.
    pub effect: String,
    /// Fall of the criterion against the last model, with white noise.
    pub bic_gain: f64,
    /// Fall of the squared error on parts of the records that the function was not fitted to, of several outputs that of their geometric
    /// mean; negative for a rise, `None` if it was not computed.
    pub share_left_out: Option<f64>,
}

/// A missing term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    /// Smooth function that describes the unexplained error; `ctid add` accepts it like an effect.
    pub effect: String,
    /// Variable of the function: a state or an input, or `time`.
    pub variable: String,
    /// Unit of the variable.
    pub variable_unit: String,
    /// Unit of the term.
    pub unit: String,
    /// Share of the mean squared error above the noise that the function explains in addition to the last model.
    pub share: f64,
    /// As [`PortScore::share_left_out`].
    pub share_left_out: Option<f64>,
    /// Simulation error with it, by output \[unit of the output\].
    pub rmse_per_output: BTreeMap<String, f64>,
    /// Arguments of the function, over the visited range \[unit of the variable\].
    pub at: Vec<f64>,
    /// Value of the function: an added term or, at a parameter, its relative change \[unit\].
    pub value: Vec<f64>,
    /// Standard errors; `None` if not determined.
    pub std_error: Vec<Option<f64>>,
    /// The values are differences from their mean, for which the parameters of the model compensate.
    #[serde(default)]
    pub is_centred: bool,
    /// Heights of the Gaussian basis functions, as `ctid add NAME --from` keeps them.
    pub parameters: Vec<Estimate>,
    /// Ports and variables, the best first.
    pub places: Vec<PortScore>,
}

impl Context<'_> {
    /// The missing term for a set; `None` if no function lowers the criterion.
    pub fn unknown(&self, node: &Node, floors: &[f64]) -> Result<Option<Unknown>, Error> {
        let (with_shapes, of) = self.with_shapes();
        with_shapes.unknown_among(node, &of, floors)
    }

    /// The search with the smooth functions appended to its candidates, and their positions.
    pub fn with_shapes(&self) -> (Self, Vec<usize>) {
        let mut with_shapes = self.clone();
        with_shapes.candidates.extend(self.shapes.iter().cloned());
        let of = (self.candidates.len()..with_shapes.candidates.len()).collect();
        (with_shapes, of)
    }

    fn unknown_among(
        &self,
        node: &Node,
        of: &[usize],
        floors: &[f64],
    ) -> Result<Option<Unknown>, Error> {
        let white = Noise::white(node.spec().outputs.len());
        let base = self.refitted(node, &white, FINE)?;
        let (courses, shapes): (Vec<usize>, Vec<usize>) =
            of.iter().partition(|&&i| self.candidates[i].follows_time());
        let mut fitted = Vec::new();
        for kind in [&shapes, &courses] {
            let mut trials = self.trials_among(&base, kind, &white);
            trials.truncate(self.thresholds.shape_refits);
            fitted.extend(self.refits(&base, &trials, &white));
        }
        let fitted: Vec<Node> = best_first(fitted)
            .into_iter()
            .filter(|set| set.gain_over(&base) > 0.0)
            .collect();
        let is_course = |set: &Node| self.last_of(set).is_some_and(Candidate::follows_time);
        let (courses, shapes): (Vec<Node>, Vec<Node>) =
            fitted.into_iter().partition(|set| is_course(set));
        // Of the same residuals as those of the parts that are left out: in a loop these are not those on the measured inputs.
        let Some(residuals) = estimation::residuals(&self.setup(&base.model)?, &base.fit.x) else {
            return Ok(None);
        };
        let mut before = vec![0.0; base.fit.rmse.len()];
        for (i, series) in residuals.iter().enumerate() {
            let present = series.iter().filter(|e| !e.is_nan());
            before[i % base.fit.rmse.len()] += present.map(|e| e * e).sum::<f64>();
        }
        let tested: Vec<Option<f64>> = shapes
            .par_iter()
            .take(self.thresholds.shape_left_out)
            .map(|set| {
                let squares = self.left_out_squares(set).ok().flatten()?;
                Some(fall(&before, &squares))
            })
            .collect();
        let tested = tested.into_iter().chain(std::iter::repeat(None));
        let mut all: Vec<(Node, Option<f64>)> = shapes.into_iter().zip(tested).collect();
        all.sort_by(|a, b| {
            let share = |share: Option<f64>| share.unwrap_or(f64::NEG_INFINITY);
            share(b.1).total_cmp(&share(a.1))
        });
        let carries = all.first().and_then(|(_, share)| *share);
        let carries = carries.is_some_and(|share| share >= self.thresholds.shape_least_share);
        let untested = all.iter().all(|(_, share)| share.is_none());
        all.extend(courses.into_iter().map(|set| (set, None)));
        if !carries && !untested {
            // One that raises the error where it was not fitted comes last.
            let raises = |share: Option<f64>| share.is_some_and(|share| share < 0.0);
            all.sort_by(|a, b| {
                let by_gain = b.0.gain_over(&base).total_cmp(&a.0.gain_over(&base));
                raises(a.1).cmp(&raises(b.1)).then(by_gain)
            });
        }
        let Some((best, share_left_out)) = all.first().cloned() else {
            return Ok(None);
        };
        let best = self.refitted(&best, &white, ROUGH).unwrap_or(best);
        let Some(candidate) = self.last_of(&best) else {
            return Ok(None);
        };
        let names = node.spec().about_outputs().map(|y| y.name.clone());
        let places = all.iter().map(|(set, share)| PortScore {
            effect: self.last_of(set).map_or_else(String::new, |c| c.id.clone()),
            bic_gain: set.gain_over(&base),
            share_left_out: *share,
        });
        let curve = curve(&best, candidate, self.thresholds.shape_points);
        let (variable, variable_unit) = self.variable_of(candidate);
        Ok(Some(Unknown {
            effect: candidate.id.clone(),
            variable,
            variable_unit,
            unit: candidate
                .parameters
                .first()
                .map_or_else(String::new, |p| p.unit.clone()),
            share: explained(&base.fit, &best.fit, floors),
            share_left_out,
            rmse_per_output: names.zip(best.fit.rmse.iter().copied()).collect(),
            at: curve.at,
            value: curve.value,
            std_error: curve.std_error,
            is_centred: curve.is_centred,
            parameters: sizes(&best, candidate),
            places: places.collect(),
        }))
    }

    fn last_of(&self, set: &Node) -> Option<&Candidate> {
        Some(&self.candidates[*set.added.last()?])
    }

    /// Variable of a function, and its unit.
    pub fn variable_of(&self, candidate: &Candidate) -> (String, String) {
        let spec: &ModelSpec = &self.problem.spec;
        let variable = match candidate.port {
            _ if candidate.follows_time() => None,
            Port::Input(u) => Some(Variable::Input(u)),
            Port::Output(y) => Some(spec.outputs[y].variable),
            Port::Dependence(_, x) | Port::BalanceAnd(_, x) => Some(x),
            _ => None,
        };
        match variable {
            Some(variable) => {
                let about = spec.about(variable);
                (about.name.clone(), about.unit.clone())
            }
            None => ("time".to_string(), self.problem.time_unit_name.clone()),
        }
    }
}

/// A fitted function over the range that it is written in.
struct Curve {
    at: Vec<f64>,
    value: Vec<f64>,
    std_error: Vec<Option<f64>>,
    /// Whether the values are differences from their mean.
    is_centred: bool,
}

/// The function over its range, with standard errors. Its mean is removed where the parameters of the model compensate for it: for a function at
/// a parameter, because the value of that parameter does; else if the mean is not significant, and less certain than the function changes.
fn curve(set: &Node, candidate: &Candidate, points: usize) -> Curve {
    let numbers = &candidate.record_numbers;
    let number = |name: &str, other: f64| numbers.get(name).copied().unwrap_or(other);
    let (from, width) = if candidate.follows_time() {
        (number("begin", 0.0), number("duration", 1.0))
    } else {
        (number("low", 0.0), number("width", 1.0))
    };
    let parameters = &set.spec().parameters;
    let positions: Vec<usize> = candidate
        .parameters
        .iter()
        .filter_map(|own| parameters.iter().position(|p| p.about.name == own.name))
        .collect();
    let heights: Vec<f64> = positions.iter().map(|&i| set.fit.x[i]).collect();
    let errors = set.fit.std_errors();
    let correlations = set.fit.correlations();
    // A weighted sum of the heights, and its standard error.
    let value = |weights: &[f64]| {
        weights
            .iter()
            .zip(&heights)
            .map(|(a, b)| a * b)
            .sum::<f64>()
    };
    let std_error = |weights: &[f64]| {
        let parts: Option<Vec<f64>> = weights
            .iter()
            .zip(&positions)
            .map(|(weight, &at)| Some(weight * errors[at]?))
            .collect();
        let (parts, (entries, matrix)) = parts.zip(correlations.as_ref())?;
        let row = |j: usize| entries.iter().position(|i| *i == positions[j]);
        let mut variance = 0.0;
        for (a, part) in parts.iter().enumerate() {
            for (b, other) in parts.iter().enumerate() {
                variance += part * other * matrix[row(a)?][row(b)?];
            }
        }
        Some(variance.max(0.0).sqrt())
    };
    let share = |k: usize| k as f64 / points.saturating_sub(1).max(1) as f64;
    let bell = |j: usize, k: usize| {
        let mut unit = vec![0.0; heights.len()];
        unit[j] = 1.0;
        bells(&unit, share(k))
    };
    let means: Vec<f64> = (0..heights.len())
        .map(|j| (0..points).map(|k| bell(j, k)).sum::<f64>() / points as f64)
        .collect();
    let rows: Vec<Vec<f64>> = (0..points)
        .map(|k| (0..heights.len()).map(|j| bell(j, k)).collect())
        .collect();
    let centred: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| row.iter().zip(&means).map(|(a, mean)| a - mean).collect())
        .collect();
    let squares = centred.iter().map(|row| value(row).powi(2));
    let change = (squares.sum::<f64>() / points as f64).sqrt();
    let of_parameter = matches!(candidate.port, Port::Value(_) | Port::Dependence(..));
    let mean = value(&means).abs();
    let is_open = std_error(&means).is_some_and(|error| error > change && mean < 2.0 * error);
    let is_centred = of_parameter || is_open;
    let rows = if is_centred { centred } else { rows };
    Curve {
        at: (0..points).map(|k| from + share(k) * width).collect(),
        value: rows.iter().map(|row| value(row)).collect(),
        std_error: rows.iter().map(|row| std_error(row)).collect(),
        is_centred,
    }
}
