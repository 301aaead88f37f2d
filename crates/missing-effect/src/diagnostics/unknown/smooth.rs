//! The forcing that a fitted model lacks, as a path in time: a random walk added at one place of the chain.
//!
//! **Model** `y = model(theta^, x0, w) + e`, `e` white of variance `sigma^2`, `w` a random walk of intensity `q`:
//! `w(t_i) - w(t_(i-1)) ~ N(0, q (t_i - t_(i-1)))`, straight between instants `t_i` that lie closer than the process is
//! slow. The parameters stay at their fit; `w(t_0)` and the initial states are free.
//!
//! **Estimate** This is the extended Kalman filter with the Rauch-Tung-Striebel smoother, written for the whole record at
//! once: the smoothed states of a linear system with Gaussian noise are the solution of one least squares problem, and the filter is a way
//! to solve it. Here it is solved by Cholesky, linearised again about each solution. So dead times, lags and hystereses keep their memory,
//! for which a filter of the levels alone has no state, and the derivatives are those of the simulation. `lambda = sigma^2/q` maximises the
//! restricted likelihood, `sigma` in closed form.
//!
//! **Cost** `O(N M)` for the sensitivities and `O(N M^2)` for the normal matrix, `M` instants.
//!
//! **References** N. R. Kristensen, H. Madsen, S. B. Jorgensen, Parameter estimation in stochastic grey-box models,
//! Automatica 40 (2004) 225-237; G. Hooker, Forcing function diagnostics for nonlinear dynamics, Biometrics 65 (2009)
//! 928-936; H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use plants::{Fitted, Place, Term, Variable};

use super::PART;
use crate::{
    Error,
    fit::node::{Node, in_time},
};

/// Largest number of instants of a path, and least number of samples for each.
const INSTANTS: usize = 96;
const SAMPLES_PER_INSTANT: usize = 4;
/// Number of linearisations of the model about the path.
const ROUNDS: usize = 3;
/// Number of decades of lambda in either direction of the likelihood search.
const DECADES: i32 = 8;

/// A place of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Spot {
    pub place: Place,
    pub vessel: usize,
}

/// The path of one record.
#[derive(Debug, Clone)]
pub(super) struct Path {
    /// Instants since the record began \[s\].
    pub time: Vec<f64>,
    pub value: Vec<f64>,
    pub covariance: DMatrix<f64>,
    /// Initial states with the path.
    pub states: Vec<f64>,
    /// Measured minus model with the path: present samples in the order of time, times the weight of their output.
    pub residual: Vec<f64>,
}

/// The smoothed forcing at one place, a path for each record.
#[derive(Debug, Clone)]
pub(super) struct Smoothed {
    pub spot: Spot,
    pub paths: Vec<Path>,
    /// `sigma^2/q` at the largest likelihood.
    pub lambda: f64,
    /// `sigma^2`.
    pub variance: f64,
    /// Restricted log-likelihood at its largest.
    pub log_likelihood: f64,
    /// Excess over the likelihood of a constant forcing.
    pub gain: f64,
}

/// The time term that carries a path.
pub(super) fn carrier(spot: Spot, time: &[f64], value: &[f64]) -> Term {
    Term {
        name: "unknown".to_string(),
        place: spot.place,
        vessel: spot.vessel,
        variable: Variable::Time,
        knots: time.to_vec(),
        ordinates: value.to_vec(),
        fitted: Fitted::Ordinates,
    }
}

/// A record's normal equations for the steps of the path and the initial states.
struct Block {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    squares: f64,
    samples: usize,
    /// Instants, and the time between them.
    time: Vec<f64>,
}

impl Block {
    /// The steps of the path with a prior variance: all but the first.
    fn steps(&self) -> std::ops::Range<usize> {
        1..self.time.len()
    }
}

/// The solution at one lambda.
struct Solution {
    deviance: f64,
    variance: f64,
    factors: Vec<Cholesky<f64, Dyn>>,
}

/// Smooths the forcing at a place; `None` where the simulation or the data do not allow it.
pub(super) fn smooth(node: &Node, spot: Spot) -> Result<Option<Smoothed>, Error> {
    let setup = &node.setup;
    let count = setup.parameter_count();
    let fixed: BTreeMap<String, f64> = setup.names()[..count]
        .iter()
        .cloned()
        .zip(node.fit.x[..count].iter().copied())
        .collect();
    // Per record: the setup with the path, and the vector.
    let mut runs = Vec::with_capacity(setup.records.len());
    for (r, record) in setup.records.iter().enumerate() {
        let m = (record.len() / SAMPLES_PER_INSTANT).clamp(2, INSTANTS);
        let time: Vec<f64> = (0..m)
            .map(|i| record.duration() * i as f64 / (m - 1) as f64)
            .collect();
        let term = carrier(spot, &time, &vec![0.0; m]);
        let structure = setup.structure.with_term(term)?;
        let mut with = greybox::Setup::new(structure, std::slice::from_ref(record), fixed.clone())?;
        with.substeps = setup.substeps;
        let mut x = node.fit.x[..count].to_vec();
        x.extend(std::iter::repeat_n(0.0, m));
        // The path is estimated on the measured command, which needs no controller.
        x.extend(&node.fit.x[setup.plant_states_of(r)]);
        runs.push((with, x, time));
    }
    // The noise is as large as for the node, output by output.
    let weights = &node.fit.weights;
    let mut best = None;
    for _ in 0..ROUNDS {
        if best.is_some() && node.setup.leaves_out(PART) {
            break;
        }
        let Some(blocks) = runs
            .iter()
            .map(|(setup, x, time)| block(setup, x, count, time, weights))
            .collect::<Option<Vec<Block>>>()
        else {
            break;
        };
        let Some((lambda, solution)) = most_likely(&blocks) else {
            break;
        };
        let still = at(&blocks, lambda * 1e12).map_or(f64::NAN, |s| s.deviance);
        let mut paths = Vec::with_capacity(blocks.len());
        for ((block, factor), (setup, x, time)) in
            blocks.iter().zip(&solution.factors).zip(&mut runs)
        {
            let m = time.len();
            let solved = factor.solve(&block.right);
            let mut value = Vec::with_capacity(m);
            let mut sum = 0.0;
            for i in 0..m {
                sum += solved[i];
                value.push(sum);
            }
            let mut covariance = factor.inverse() * solution.variance;
            covariance = covariance.view((0, 0), (m, m)).into_owned();
            for i in 1..m {
                let above = covariance.row(i - 1).into_owned();
                covariance.row_mut(i).zip_apply(&above, |a, b| *a += b);
            }
            for i in 1..m {
                let before = covariance.column(i - 1).into_owned();
                covariance.column_mut(i).zip_apply(&before, |a, b| *a += b);
            }
            x[count..count + m].copy_from_slice(&value);
            for (k, position) in (count + m..x.len()).enumerate() {
                let (low, high) = setup.bounds()[position];
                x[position] = solved[m + k].clamp(low, high);
            }
            let residual = in_time(setup, &setup.residuals(x)?, weights);
            paths.push(Path {
                time: time.clone(),
                value,
                covariance,
                states: x[count + m..].to_vec(),
                residual,
            });
        }
        if paths
            .iter()
            .flat_map(|p| &p.residual)
            .any(|e| !e.is_finite())
        {
            break;
        }
        best = Some(Smoothed {
            spot,
            paths,
            lambda,
            variance: solution.variance,
            log_likelihood: -0.5 * solution.deviance,
            gain: 0.5 * (still - solution.deviance),
        });
    }
    Ok(best)
}

/// The normal equations about `x`, for steps of the path and for values (not changes) of the states.
fn block(
    setup: &greybox::Setup,
    x: &[f64],
    count: usize,
    time: &[f64],
    weights: &[f64],
) -> Option<Block> {
    let rows = setup.rows(x)?;
    let values = rows.in_time(weights);
    let m = time.len();
    let columns = rows.columns - 1;
    let samples = values.len() / rows.columns;
    let free: Vec<f64> = setup.free().iter().map(|&i| x[i]).collect();
    debug_assert_eq!(setup.free().first(), Some(&count));
    let mut j = DMatrix::from_row_slice(samples, rows.columns, &values);
    let mut target = j.column(columns).into_owned();
    j = j.remove_column(columns);
    target += &j * DVector::from_vec(free);
    // A step changes the path from its instant on.
    for i in (0..m - 1).rev() {
        let after = j.column(i + 1).into_owned();
        j.column_mut(i).zip_apply(&after, |a, b| *a += b);
    }
    Some(Block {
        normal: j.tr_mul(&j),
        right: j.tr_mul(&target),
        squares: target.norm_squared(),
        samples,
        time: time.to_vec(),
    })
}

/// Minus twice the restricted log-likelihood at a lambda, up to constants, and the factors of the normal equations.
fn at(blocks: &[Block], lambda: f64) -> Option<Solution> {
    let (mut determinant, mut squares, mut freedom) = (0.0, 0.0, 0.0);
    let mut factors = Vec::with_capacity(blocks.len());
    for block in blocks {
        let mut normal = block.normal.clone();
        for i in block.steps() {
            let weight = lambda / (block.time[i] - block.time[i - 1]);
            normal[(i, i)] += weight;
            determinant -= weight.ln();
        }
        // A column that nothing determines is independent only by rounding.
        let trace = block.normal.diagonal().max();
        for i in 0..normal.nrows() {
            normal[(i, i)] += 1e-13 * trace;
        }
        let factor = normal.cholesky()?;
        determinant += 2.0
            * factor
                .l_dirty()
                .diagonal()
                .iter()
                .map(|d| d.ln())
                .sum::<f64>();
        squares += block.squares - block.right.dot(&factor.solve(&block.right));
        freedom += (block.samples - (block.normal.nrows() - block.steps().len())) as f64;
        factors.push(factor);
    }
    let variance = squares / freedom;
    (variance > 0.0 && variance.is_finite()).then(|| Solution {
        deviance: freedom * (variance.ln() + 1.0) + determinant,
        variance,
        factors,
    })
}

/// The lambda of the largest likelihood: first over the decades, then by golden section.
fn most_likely(blocks: &[Block]) -> Option<(f64, Solution)> {
    let scale: f64 = blocks
        .iter()
        .map(|b| b.normal.diagonal().mean() * (b.time[1] - b.time[0]))
        .sum::<f64>()
        / blocks.len() as f64;
    if scale <= 0.0 || !scale.is_finite() {
        return None;
    }
    let deviance = |log: f64| {
        at(blocks, scale * 10_f64.powf(log)).map_or(f64::INFINITY, |solution| solution.deviance)
    };
    let coarse = (-DECADES..=DECADES)
        .map(f64::from)
        .min_by(|a, b| deviance(*a).total_cmp(&deviance(*b)))?;
    let (mut low, mut high) = (coarse - 1.0, coarse + 1.0);
    let share = 0.5 * (5_f64.sqrt() - 1.0);
    for _ in 0..14 {
        let (a, b) = (high - share * (high - low), low + share * (high - low));
        if deviance(a) < deviance(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let lambda = scale * 10_f64.powf(0.5 * (low + high));
    Some((lambda, at(blocks, lambda)?))
}
