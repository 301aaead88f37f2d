//! Variable of the missing term: a polyline in each variable, fitted with the plant's parameters, and its share of explained variance on
//! data that were not fitted.
//!
//! A flexible curve fits anything, and a level that drifts makes every function of time one of the level. So the share is
//! counted on parts of the record that the curve has not seen: a function of the level holds there too, a function of
//! time cannot. What no variable predicts is left a function of time.

use std::ops::Range;

use ct_signals::ArModel;
use greybox::{PriorValue, Setup};
use nalgebra::{DMatrix, DVector};
use plants::{Fitted, Term, Variable};

use super::{
    PART,
    knots::{knots, visited},
    smooth::{Smoothed, Spot},
};
use crate::{
    Error,
    fit::{
        node::{Node, in_time},
        noise_model::slowness_of,
    },
};

/// Parts of the data that are left out in turn, each without a gap.
const PARTS: usize = 10;
/// Directions of the ordinates with less than this share of the information are explained by the plant's parameters.
const DETERMINED: f64 = 1e-4;
/// Prior of an ordinate: equal to its neighbour within the smoothed term's root mean square, and zero within this multiple of it ...
const SIZES: f64 = 3.0;
/// ... and a parameter of the plant is known to within this share of its value.
const LOOSE: f64 = 0.5;
/// Largest number of steps of the fit, and least fall of its cost for another step.
const ROUNDS: usize = 30;
const ENOUGH: f64 = 1e-6;

/// A polyline in one variable.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub spot: Spot,
    pub variable: Variable,
    pub knots: Vec<f64>,
    /// Ordinates without the part that the plant's own parameters explain.
    pub ordinates: Vec<f64>,
    /// The inverse of the ordinates' covariance; singular in directions that the plant's parameters explain.
    pub information: DMatrix<f64>,
    pub covariance: DMatrix<f64>,
    /// Share of the missing term that the polyline predicts on unseen data, with its standard error.
    pub share: f64,
    pub share_error: f64,
}

/// The polyline in a variable at the place of a smoothed forcing; `None` if the variable hardly changes or the fit fails. `possible`: the
/// residual with the most likely forcing.
pub(super) fn shape(
    node: &Node,
    smoothed: &Smoothed,
    variable: Variable,
    possible: &[f64],
) -> Result<Option<Shape>, Error> {
    let sorted = visited(node, smoothed, variable)?;
    if sorted.is_empty() || sorted.iter().any(|v| !v.is_finite()) {
        return Ok(None);
    }
    let knots = knots(&sorted);
    let k = knots.len();
    if k < 3 {
        return Ok(None);
    }
    let spot = smoothed.spot;
    let term = Term {
        name: "unknown".to_string(),
        place: spot.place,
        vessel: spot.vessel,
        variable,
        ordinates: vec![0.0; k],
        knots,
        fitted: Fitted::Ordinates,
    };
    let knots = term.knots.clone();
    let own = node.setup.parameter_count();
    let setup = node
        .setup
        .with_structure(node.setup.structure.with_term(term)?)?;
    let mut start = node.fit.x.clone();
    start.splice(own..own, vec![0.0; k]);
    // An ordinate has about the size of the smoothed term.
    let (mut sum, mut count) = (0.0, 0.0);
    for value in smoothed.paths.iter().flat_map(|path| &path.value) {
        sum += value * value;
        count += 1.0;
    }
    let size = SIZES * f64::sqrt(sum / count);
    let weights = &node.fit.weights;
    let Some(fitted) = fit(&setup, start, own..own + k, size, weights) else {
        return Ok(None);
    };
    let Fit { x, j, residual, .. } = &fitted;
    let columns = j.ncols();
    let states = setup
        .free()
        .iter()
        .filter(|&&i| i < setup.parameter_count())
        .count();
    // The ordinates' columns, and the other columns.
    let (mut at, mut others) = (Vec::new(), Vec::new());
    for (column, &position) in setup.free().iter().enumerate() {
        if (own..own + k).contains(&position) {
            at.push(column);
        } else {
            others.push(column);
        }
    }
    let values = DVector::from_iterator(k, (own..own + k).map(|i| x[i]));
    let (mine, theirs) = (j.select_columns(&at), j.select_columns(&others));
    let freedom = residual.len().saturating_sub(columns).max(1) as f64;
    let series: Vec<f64> = residual.iter().copied().collect();
    let inflation = slowness_of(&ArModel::fit(
        &[&series],
        crate::fit::noise_model::NOISE_ORDER,
    )?);
    let variance = inflation * residual.norm_squared() / freedom;
    let mut information = mine.tr_mul(&mine);
    let mut nuisance = theirs.tr_mul(&theirs);
    for (column, prior) in priors(&setup) {
        if let Some(i) = others.iter().position(|&other| other == column) {
            nuisance[(i, i)] += variance / prior.std_error.powi(2);
        }
    }
    if let Some(factor) = regularised(nuisance).cholesky() {
        let cross = theirs.tr_mul(&mine);
        information -= cross.tr_mul(&factor.solve(&cross));
    }
    let eigen = (information.clone() / variance).symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let (mut covariance, mut projection) = (DMatrix::zeros(k, k), DMatrix::zeros(k, k));
    let mut determined = DMatrix::zeros(k, k);
    for (i, value) in eigen.eigenvalues.iter().enumerate() {
        if *value > DETERMINED * most {
            let v = eigen.eigenvectors.column(i);
            let outer = v * v.transpose();
            covariance += &outer / *value;
            determined += &outer * *value;
            projection += outer;
        }
    }
    let ordinates = (projection * &values).iter().copied().collect();
    let (share, share_error) = unseen(node, possible, &fitted, &x_free(&setup, x), states)?;
    Ok(Some(Shape {
        spot,
        variable,
        knots,
        ordinates,
        information: determined,
        covariance,
        share,
        share_error,
    }))
}

/// A matrix that is singular up to rounding.
fn regularised(mut normal: DMatrix<f64>) -> DMatrix<f64> {
    for i in 0..normal.nrows() {
        normal[(i, i)] *= 1.0 + 1e-9;
        normal[(i, i)] += f64::MIN_POSITIVE;
    }
    normal
}

/// The free entries of a vector.
fn x_free(setup: &Setup, x: &[f64]) -> DVector<f64> {
    DVector::from_iterator(setup.free().len(), setup.free().iter().map(|&i| x[i]))
}

/// Priors of the free entries, each with its column.
fn priors(setup: &Setup) -> Vec<(usize, PriorValue)> {
    let known = setup.prior_values();
    let column = |(column, &entry): (usize, &usize)| {
        let prior = known.get(&setup.names()[entry])?;
        Some((column, *prior))
    };
    setup.free().iter().enumerate().filter_map(column).collect()
}

/// A fit with its derivatives.
pub(super) struct Fit {
    pub x: Vec<f64>,
    j: DMatrix<f64>,
    residual: DVector<f64>,
    /// Mean and weights of the priors of the free entries: an ordinate is near zero and nearer to its neighbours, a parameter of the plant
    /// near the believed model's fit, and near its side measurement if there is one.
    prior: (DVector<f64>, DMatrix<f64>),
}

/// Least squares with a prior, by the Levenberg-Marquardt method. Without a prior the plant's parameters and the ordinates would diverge
/// together, because they are collinear. `None` also if the time limit passes.
pub(super) fn fit(
    setup: &Setup,
    start: Vec<f64>,
    ordinates: Range<usize>,
    size: f64,
    weights: &[f64],
) -> Option<Fit> {
    let mut mean = x_free(setup, &start);
    let of_outputs = weights;
    let rows = |x: &[f64]| {
        let rows = setup.rows(x)?;
        let values = rows.in_time(of_outputs);
        let samples = values.len() / rows.columns;
        let j = DMatrix::from_row_slice(samples, rows.columns, &values);
        let residual = j.column(rows.columns - 1).into_owned();
        Some((j.remove_column(rows.columns - 1), residual))
    };
    let mut x = start;
    let (mut j, mut residual) = rows(&x)?;
    let mut damping = 1e-2;
    // Prior weights on the squared deviations, in units of the residual's variance.
    let known = {
        let count = setup.parameter_count();
        let mut known = DMatrix::zeros(mean.len(), mean.len());
        let inverse = |spread: f64| if spread > 0.0 { spread.powi(-2) } else { 0.0 };
        let mut neighbour = None;
        for (column, &position) in setup.free().iter().enumerate() {
            if ordinates.contains(&position) {
                known[(column, column)] += inverse(SIZES * size);
                if let Some(before) = neighbour.replace(column) {
                    let weight = inverse(size);
                    known[(column, column)] += weight;
                    known[(before, before)] += weight;
                    known[(column, before)] -= weight;
                    known[(before, column)] -= weight;
                }
            } else if position < count {
                known[(column, column)] += inverse(LOOSE * mean[column].abs());
            }
        }
        // Two Gaussian measurements of an entry are equivalent to one at their weighted mean.
        for (column, prior) in priors(setup) {
            let (loose, weight) = (known[(column, column)], inverse(prior.std_error));
            mean[column] = (loose * mean[column] + weight * prior.value) / (loose + weight);
            known[(column, column)] = loose + weight;
        }
        known
    };
    let mut weights = known.clone();
    for _ in 0..ROUNDS {
        if setup.leaves_out(PART) {
            return None;
        }
        let variance = residual.norm_squared() / residual.len() as f64;
        weights = &known * variance;
        let free = x_free(setup, &x);
        let cost = |residual: &DVector<f64>, free: &DVector<f64>| {
            let away = free - &mean;
            residual.norm_squared() + away.dot(&(&weights * &away))
        };
        let now = cost(&residual, &free);
        let normal = j.tr_mul(&j) + &weights;
        let right = j.tr_mul(&residual) - &weights * (&free - &mean);
        let mut fallen = None;
        while damping < 1e8 {
            let mut damped = normal.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&right);
            let mut next = x.clone();
            for (d, &position) in step.iter().zip(setup.free()) {
                let (low, high) = setup.bounds()[position];
                next[position] = (x[position] + d).clamp(low, high);
            }
            if let Some((next_j, next_residual)) = rows(&next) {
                let after = cost(&next_residual, &x_free(setup, &next));
                if after < now {
                    (x, j, residual) = (next, next_j, next_residual);
                    fallen = Some((now - after) / now);
                    damping *= 0.1;
                    break;
                }
            }
            damping *= 10.0;
        }
        if fallen.is_none_or(|fall| fall < ENOUGH) {
            break;
        }
    }
    Some(Fit {
        x,
        j,
        residual,
        prior: (mean, weights),
    })
}

/// The predicted share of the missing term on parts that are left out in turn, and its standard error.
///
/// The model is linear about its fit. An ordinate that only the left-out part has visited is near its neighbours'; initial
/// states stay. A part counts as zero at worst: values that no other part has visited are no evidence against a variable.
/// `possible`: the residual with the most likely forcing; `states`: from which column on there are initial states.
fn unseen(
    node: &Node,
    possible: &[f64],
    Fit {
        j,
        residual,
        prior: (mean, weights),
        ..
    }: &Fit,
    free: &DVector<f64>,
    states: usize,
) -> Result<(f64, f64), Error> {
    let before = node.setup.residuals(&node.fit.x)?;
    let before = in_time(&node.setup, &before, &node.fit.weights);
    let j = j.columns(0, states);
    let weights = weights.view((0, 0), (states, states)).into_owned();
    let target = residual + j * (free - mean).rows(0, states);
    let n = target.len();
    let whole = j.tr_mul(&j) + weights;
    let right = j.tr_mul(&target);
    let (mut fallen, mut most) = (Vec::new(), Vec::new());
    for part in 0..PARTS {
        let (from, to) = (n * part / PARTS, n * (part + 1) / PARTS);
        let (rows, wanted) = (j.rows(from, to - from), target.rows(from, to - from));
        // The neighbourhood of the part is left out too: the process has memory, and a command that is held is a single observation,
        // however many samples it lasts.
        let margin = (to - from) / 2;
        let (first, last) = (from.saturating_sub(margin), (to + margin).min(n));
        let (hidden, unknown) = (
            j.rows(first, last - first),
            target.rows(first, last - first),
        );
        let Some(factor) = regularised(&whole - hidden.tr_mul(&hidden)).cholesky() else {
            return Ok((0.0, f64::INFINITY));
        };
        let solved = factor.solve(&(&right - hidden.tr_mul(&unknown)));
        let left = (wanted - rows * solved).norm_squared();
        let sum = |series: &[f64]| series[from..to].iter().map(|e| e * e).sum::<f64>();
        let room = (sum(&before) - sum(possible)).max(0.0);
        fallen.push((sum(&before) - left).clamp(0.0, room));
        most.push(room);
    }
    let total: f64 = most.iter().sum();
    if total <= 0.0 {
        return Ok((0.0, f64::INFINITY));
    }
    let share = fallen.iter().sum::<f64>() / total;
    let scatter: f64 = fallen
        .iter()
        .zip(&most)
        .map(|(f, p)| (f - share * p).powi(2))
        .sum();
    let parts = PARTS as f64;
    Ok((share, (scatter * parts / (parts - 1.0)).sqrt() / total))
}
