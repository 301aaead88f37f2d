//! Joint scores of all pairs of candidates: the fall of the cost that both predict together, from one linearisation of each.
//!
//! A candidate's columns are its derivatives at its best start and, where it is not absent there, the change of the outputs. All columns
//! are whitened and projected off those of the believed model; a pair then costs one solution of a small system.

use estimation::{Noise, Rows, rows};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::node::{Context, Node};
use crate::search::score::Trial;

/// Number of values in all columns above which rows are thinned out.
const MOST_VALUES: usize = 20_000_000;
/// Columns are left out whose projection residual is below this share of their norm, and changes below this share of the residual's norm.
const DEPENDENT: f64 = 1e-6;
/// Ridge of the small systems, as a share of the squared length.
const RIDGE: f64 = 1e-9;

/// Pairs of positions in `trials`, the best first, with a larger prediction than their members.
pub(crate) fn joint_scores(
    context: &Context,
    base: &Node,
    trials: &[Trial],
    noise: &Noise,
    most: usize,
) -> Vec<(usize, usize)> {
    let Ok(setup) = context.setup(&base.model) else {
        return Vec::new();
    };
    let Some(own) = rows(&setup, &base.fit.x) else {
        return Vec::new();
    };
    let weights = &base.fit.weights;
    let every = every_nth(context, 3 * trials.len());
    // A parameter at a bound stays there.
    let mut chosen = base.fit.interior().to_vec();
    chosen.push(own.columns - 1);
    let Some(samples) = whitened(&own, chosen.clone(), noise, weights, every) else {
        return Vec::new();
    };
    let p = samples.ncols() - 1;
    // A prior holds its parameter: what only that parameter could imitate is not lost.
    let mut priors = Vec::new();
    let sigma = base.fit.prior_weight() / (every as f64).sqrt();
    own.each_prior(&chosen, sigma, |row| priors.extend_from_slice(row));
    let priors = DMatrix::from_row_slice(priors.len() / (p + 1), p + 1, &priors);
    let all = samples.nrows() + priors.nrows();
    let measured = samples.column(p).into_owned();
    let mut believed = samples.resize_vertically(all, 0.0);
    believed
        .rows_mut(all - priors.nrows(), priors.nrows())
        .copy_from(&priors);
    let basis = basis_of(&believed.columns(0, p).into_owned());
    let residual = believed.column(p).into_owned();
    let mut left = residual.clone();
    project(&basis, &mut left);
    let columns: Vec<Vec<DVector<f64>>> = trials
        .par_iter()
        .map(|trial| {
            let columns = columns_of(context, base, trial, noise, weights, every, &measured);
            let columns = columns.unwrap_or_default().into_iter();
            let mut columns: Vec<_> = columns
                .map(|column| column.resize_vertically(all, 0.0))
                .collect();
            columns.retain_mut(|column| {
                let before = column.norm();
                project(&basis, column);
                project(&basis, column);
                let after = column.norm();
                if after > DEPENDENT * before && after.is_finite() && after > 0.0 {
                    *column /= after;
                    true
                } else {
                    false
                }
            });
            columns
        })
        .collect();
    let explained = |chosen: &[&DVector<f64>]| -> f64 {
        let n = chosen.len();
        if n == 0 {
            return 0.0;
        }
        let gram = DMatrix::from_fn(n, n, |i, j| {
            chosen[i].dot(chosen[j]) + if i == j { RIDGE } else { 0.0 }
        });
        let moment = DVector::from_fn(n, |i, _| chosen[i].dot(&left));
        gram.cholesky()
            .map_or(0.0, |factor| moment.dot(&factor.solve(&moment)))
    };
    let single: Vec<f64> = columns
        .par_iter()
        .map(|columns| explained(&columns.iter().collect::<Vec<_>>()))
        .collect();
    let total = left.norm_squared();
    let rows = measured.len() as f64;
    let mut pairs: Vec<(f64, usize, usize)> = (0..trials.len())
        .into_par_iter()
        .flat_map_iter(|a| (0..a).map(move |b| (a, b)))
        .map(|(a, b)| {
            let chosen: Vec<&DVector<f64>> = columns[a].iter().chain(&columns[b]).collect();
            let both = explained(&chosen);
            // The criterion of the pair: fall of the deviance less the penalty of its columns.
            let fall = rows * (total / (total - both).max(1e-12 * total)).ln();
            (fall - chosen.len() as f64 * rows.ln(), a, b)
        })
        .filter(|&(_, a, b)| {
            let tied = context.is_tied_to_one_of(trials[a].candidate, &[trials[b].candidate]);
            !tied && !columns[a].is_empty() && !columns[b].is_empty() && single[a].is_finite()
        })
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs
        .into_iter()
        .take(most)
        .map(|(_, a, b)| (a, b))
        .collect()
}

/// The columns of a candidate, whitened.
fn columns_of(
    context: &Context,
    base: &Node,
    trial: &Trial,
    noise: &Noise,
    weights: &[f64],
    every: usize,
    residual: &DVector<f64>,
) -> Option<Vec<DVector<f64>>> {
    let setup = context.setup(&trial.model).ok()?;
    let x = trial.starts.first()?;
    let all = rows(&setup, x)?;
    let known = base.spec();
    let shared = |name: &str| known.parameters.iter().any(|p| p.about.name == name);
    let own: Vec<usize> = setup
        .free()
        .iter()
        .enumerate()
        .filter(|(_, at)| **at < setup.parameter_count() && !shared(&setup.names()[**at]))
        .map(|(column, _)| column)
        .collect();
    let mut chosen = own;
    chosen.push(all.columns - 1);
    let matrix = whitened(&all, chosen, noise, weights, every)?;
    let last = matrix.ncols() - 1;
    let mut columns: Vec<DVector<f64>> = (0..last).map(|j| matrix.column(j).into_owned()).collect();
    // Residual of the believed model minus the residual of this start: the response to the effect.
    let change = residual - matrix.column(last);
    if change.norm() > DEPENDENT * residual.norm() {
        columns.push(change);
    }
    Some(columns)
}

/// Stride of the rows that keeps this number of columns below [`MOST_VALUES`] in all.
pub(crate) fn every_nth(context: &Context, columns: usize) -> usize {
    let values = context.samples() as usize * columns;
    values.div_ceil(MOST_VALUES).max(1)
}

/// The part of a column that is orthogonal to orthonormal columns.
pub(crate) fn project(basis: &DMatrix<f64>, column: &mut DVector<f64>) {
    for unit in basis.column_iter() {
        let along = unit.dot(column);
        column.axpy(-along, &unit, 1.0);
    }
}

/// Selected columns of all present rows, whitened and weighted, every n-th column entry.
pub(crate) fn whitened(
    all: &Rows,
    chosen: Vec<usize>,
    noise: &Noise,
    weights: &[f64],
    every: usize,
) -> Option<DMatrix<f64>> {
    let mut values = Vec::new();
    let mut count = 0;
    all.each_whitened(&chosen, noise, weights, |row| {
        if count % every == 0 {
            values.extend_from_slice(row);
        }
        count += 1;
    });
    let rows = values.len() / chosen.len();
    (rows > 0 && values.iter().all(|v| v.is_finite()))
        .then(|| DMatrix::from_row_slice(rows, chosen.len(), &values))
}

/// Orthonormal columns that span those of a matrix.
pub(crate) fn basis_of(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut units: Vec<DVector<f64>> = Vec::new();
    for column in matrix.column_iter() {
        let mut column = column.into_owned();
        let before = column.norm();
        for _ in 0..2 {
            for unit in &units {
                let along = unit.dot(&column);
                column.axpy(-along, unit, 1.0);
            }
        }
        let after = column.norm();
        if after > 1e-9 * before && after > 0.0 {
            units.push(column / after);
        }
    }
    if units.is_empty() {
        return DMatrix::zeros(matrix.nrows(), 0);
    }
    DMatrix::from_columns(&units)
}
