//! What the missing term depends on: a polyline in each variable, fitted with the plant's parameters, and the share of the
//! missing term that it predicts where it has not been fitted.
//!
//! A flexible curve fits anything, and a level that drifts makes every function of time one of the level. So the share is
//! counted on parts of the record that the curve has not seen: a function of the level holds there too, a function of
//! time cannot. What no variable predicts is left a function of time.

use ct_signals::{ArModel, Hold, Record};
use greybox::{Stopping, fit_from};
use nalgebra::{DMatrix, DVector};
use plants::{Command, Fitted, Simulator, Term, Variable};

use super::smooth::{Smoothed, Spot, carrier};
use crate::{Error, noise_floor::slowness, search::Node};

/// Knots of a polyline.
const KNOTS: usize = 9;
/// Parts of the data that are left out in turn, each without a gap.
const PARTS: usize = 6;
/// Directions of the ordinates that hold less of the information than this share are the plant's own.
const DETERMINED: f64 = 1e-4;
const STOPPING: Stopping = Stopping {
    evaluations: 40,
    cost: 1e-7,
};

/// A polyline in one variable.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub spot: Spot,
    pub variable: Variable,
    pub knots: Vec<f64>,
    /// Without what the plant's own parameters imitate.
    pub ordinates: Vec<f64>,
    /// The inverse of the ordinates' covariance; singular where the plant's parameters imitate them.
    pub information: DMatrix<f64>,
    pub covariance: DMatrix<f64>,
    /// Share of the missing term that it predicts on unseen data, with its standard error.
    pub share: f64,
    pub share_error: f64,
}

/// The values that a variable takes along the smoothed path, over all records, in rising order.
fn visited(node: &Node, smoothed: &Smoothed, variable: Variable) -> Result<Vec<f64>, Error> {
    let setup = &node.setup;
    let spot = smoothed.spot;
    let mut values = Vec::with_capacity(setup.samples());
    for (record, path) in setup.records.iter().zip(&smoothed.paths) {
        if variable == Variable::Input {
            values.extend(&record.input.values);
            continue;
        }
        let structure = setup
            .structure
            .with_term(carrier(spot, &path.time, &path.value))?;
        let mut theta = node.fit.x[..setup.parameter_count()].to_vec();
        theta.extend(&path.value);
        let mut simulator =
            Simulator::<f64>::new(&structure, &theta, &path.states, record.input.values[0])?;
        simulator.set_substeps(setup.substeps);
        let vessel = match spot.place {
            plants::Place::Sensor => setup.structure.plant.vessels() - 1,
            _ => spot.vessel,
        };
        let area = setup.structure.scales.area[vessel];
        let mut before: Option<(f64, f64)> = None;
        for k in 0..record.len() {
            let (t, level) = (record.time[k], simulator.levels()[vessel]);
            match (variable, before) {
                (Variable::Level, _) => values.push(level),
                // The net inflow, as the mean over the sampling interval.
                (_, Some((t0, level0))) => values.push(area * (level - level0) / (t - t0)),
                _ => {}
            }
            before = Some((t, level));
            if k + 1 < record.len() {
                simulator.advance(command(record, k), record.time[k + 1] - t);
            }
        }
    }
    values.sort_unstable_by(f64::total_cmp);
    Ok(values)
}

fn command(record: &Record, k: usize) -> Command {
    let u = &record.input.values;
    match record.hold {
        Hold::Zero => Command::held(u[k]),
        Hold::First => Command::ramp(u[k], u[k + 1]),
    }
}

/// Knots over the range that is visited: half way between evenly over the range and evenly over the samples.
fn knots(sorted: &[f64]) -> Vec<f64> {
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    let (low, high) = (at(0.002), at(0.998));
    let room = 0.02 * (high - low);
    let mut knots: Vec<f64> = Vec::with_capacity(KNOTS);
    for i in 0..KNOTS {
        let share = i as f64 / (KNOTS - 1) as f64;
        let knot = 0.5 * (low + share * (high - low)) + 0.5 * at(0.002 + 0.996 * share);
        if knots.last().is_none_or(|last| knot - last > room) {
            knots.push(knot);
        }
    }
    knots
}

/// The polyline in a variable at the place of a smoothed forcing; `None` where the variable hardly moves or the fit fails.
pub(super) fn shape(
    node: &Node,
    smoothed: &Smoothed,
    variable: Variable,
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
    let Ok(fit) = fit_from(&setup, &[start], &ArModel::white(1.0), STOPPING) else {
        return Ok(None);
    };
    let Some(rows) = setup.rows(&fit.x) else {
        return Ok(None);
    };
    let columns = rows.columns - 1;
    let mut j = DMatrix::from_row_slice(rows.values.len() / rows.columns, rows.columns, &rows.values);
    let residual = j.column(columns).into_owned();
    j = j.remove_column(columns);
    // The ordinates' columns, and those of everything else.
    let (mut at, mut others) = (Vec::new(), Vec::new());
    for (column, &position) in setup.free().iter().enumerate() {
        if (own..own + k).contains(&position) {
            at.push(column);
        } else {
            others.push(column);
        }
    }
    let values = DVector::from_iterator(k, (own..own + k).map(|i| fit.x[i]));
    let (mine, theirs) = (j.select_columns(&at), j.select_columns(&others));
    let freedom = (residual.len() - columns.min(residual.len() - 1)) as f64;
    let series: Vec<f64> = residual.iter().copied().collect();
    let inflation = slowness(&ArModel::fit(&[&series], crate::noise_floor::NOISE_ORDER)?);
    let variance = inflation * residual.norm_squared() / freedom;
    let mut information = mine.tr_mul(&mine);
    if let Some(factor) = regularised(theirs.tr_mul(&theirs)).cholesky() {
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
    let (share, share_error) = unseen(node, smoothed, &j, &residual, &at, &values)?;
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

/// A matrix that rounding alone would leave singular.
fn regularised(mut normal: DMatrix<f64>) -> DMatrix<f64> {
    for i in 0..normal.nrows() {
        normal[(i, i)] *= 1.0 + 1e-9;
        normal[(i, i)] += f64::MIN_POSITIVE;
    }
    normal
}

/// The share of the missing term that is predicted on parts that are left out in turn, and its standard error.
///
/// The model is linear about its fit; an ordinate that only the left-out part has visited is taken to be zero there.
fn unseen(
    node: &Node,
    smoothed: &Smoothed,
    j: &DMatrix<f64>,
    residual: &DVector<f64>,
    at: &[usize],
    values: &DVector<f64>,
) -> Result<(f64, f64), Error> {
    let mut target = residual.clone();
    for (column, value) in at.iter().zip(values.iter()) {
        target += j.column(*column) * *value;
    }
    let before: Vec<f64> = node.setup.residuals(&node.fit.x)?.concat();
    let with_path: Vec<f64> = smoothed
        .paths
        .iter()
        .flat_map(|path| path.residual.iter().copied())
        .collect();
    let n = target.len();
    let whole = j.tr_mul(j);
    let right = j.tr_mul(&target);
    let (mut fallen, mut possible) = (Vec::new(), Vec::new());
    for part in 0..PARTS {
        let (from, to) = (n * part / PARTS, n * (part + 1) / PARTS);
        let (rows, wanted) = (j.rows(from, to - from), target.rows(from, to - from));
        let mut normal = &whole - rows.tr_mul(&rows);
        // What the other parts say nothing of stays: a parameter at its fit, an ordinate at zero.
        for column in 0..whole.nrows() {
            normal[(column, column)] += 1e-6 * whole[(column, column)] + f64::MIN_POSITIVE;
        }
        let Some(factor) = normal.cholesky() else {
            return Ok((0.0, f64::INFINITY));
        };
        let solved = factor.solve(&(&right - rows.tr_mul(&wanted)));
        let left = (wanted - rows * solved).norm_squared();
        let sum = |series: &[f64]| series[from..to].iter().map(|e| e * e).sum::<f64>();
        fallen.push(sum(&before) - left);
        possible.push(sum(&before) - sum(&with_path));
    }
    let total: f64 = possible.iter().sum();
    let share = fallen.iter().sum::<f64>() / total;
    let scatter: f64 = fallen
        .iter()
        .zip(&possible)
        .map(|(f, p)| (f - share * p).powi(2))
        .sum();
    let parts = PARTS as f64;
    let error = (scatter * parts / (parts - 1.0)).sqrt() / total;
    Ok(if total > 0.0 {
        (share, error)
    } else {
        (0.0, f64::INFINITY)
    })
}
