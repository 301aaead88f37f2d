//! Effects at the actuator with many starts: a plain simulation and a regression of each show which starts are linearised.
//!
//! The reading is linear in the pump's gain `K`, `y = K f(p) + ...`, `p` the command after the effect. What the effect changes in a
//! simulation with the gain `K0` is `D = K0 f(p) - K0 f(u)`, so the column of the gain at a start is `df/dK + D/K0`, with `df/dK` that of
//! the model without the effect: a start costs one simulation in plain numbers and a regression on this one column. Of plants that are not
//! linear this holds to first order.

use estimation::{Noise, costs_more, within};
use plants::{Outlet, Place, Placed};
use rayon::prelude::*;

use crate::Setup;

/// Effects that keep much of the command from the plant, and so affect its apparent speed.
const STICKS: &str = "stiction_backlash";
const SATURATES: &str = "pump_saturation";
/// Time constants of linear plants, in samples, for further starts in addition to the time constant of the model without the effect, ...
const TIME_CONSTANTS: [f64; 3] = [1.0, 12.0, 150.0];
/// ... and one in multiples of the record's length: an integrating plant.
const INTEGRATES: f64 = 10.0;
/// For tanks: ratios to the speed of the model without the effect.
const QUICKER: [f64; 3] = [0.3, 3.0, 9.0];

/// Plants that are quicker or slower than one, in front of which something sticks or saturates; none for other effects.
///
/// A model without the effect responds to commands that do not move the real actuator. Its fit compensates for this by a small gain and
/// another time constant, a much longer one or none at all. For tanks the gain and the outflows are scaled together, so that the levels do
/// not change.
#[must_use]
pub fn with_other_speeds(setup: &Setup, placed: Placed, x: &[f64]) -> Vec<Vec<f64>> {
    let plant = setup.structure.plant;
    let effect = placed.effect.id;
    if plant.outlet() == Outlet::Linear && (effect == STICKS || effect == SATURATES) {
        let lags = time_constants(setup);
        let scales = &setup.structure.scales;
        let sampled = TIME_CONSTANTS.map(|samples| samples * scales.sample_interval);
        let with = |time_constant: f64| {
            let mut x = x.to_vec();
            for &lag in &lags {
                x[lag] = time_constant;
            }
            x
        };
        let all = sampled.into_iter().chain([INTEGRATES * scales.duration]);
        return all.filter(|_| !lags.is_empty()).map(with).collect();
    }
    // With valve stiction there are already many starts.
    let own = plant.parameters(&setup.structure.scales).len();
    let all_free = (0..own).all(|at| setup.free().contains(&at));
    if plant.joined() || effect != SATURATES || !all_free {
        return Vec::new();
    }
    let with = |factor: f64| {
        let mut x = x.to_vec();
        for (value, &bounds) in x.iter_mut().zip(setup.bounds()).take(own) {
            *value = within(factor * *value, bounds);
        }
        x
    };
    QUICKER.map(with).to_vec()
}

/// Positions of the fitted time constants of a plant in the parameter vector.
fn time_constants(setup: &Setup) -> Vec<usize> {
    let lags = ["tau", "tau1", "tau2"];
    let free = setup.free().iter().copied();
    free.filter(|&at| lags.contains(&setup.names()[at].as_str()))
        .collect()
}

/// Step that is left out if the time limit has passed.
const STARTS: &str = "further starts of effects at the actuator";
/// Damping of the step in the other parameters, for directions that the data do not determine.
const DAMPING: f64 = 1e-9;
/// With more starts than this, an effect at the actuator is simulated from all of them, without derivatives, before it is linearised ...
const MANY: usize = 20;
/// ... at this number of the best ones.
const LINEARISED: usize = 12;

/// Of many starts of an effect at the actuator keeps those whose simulations fit best, once the gain of the pump and, to first order,
/// the other parameters but time constants are fitted to each; they begin with that gain. Few starts stay as they are. Those that the
/// time limit of the setup leaves no time for count as the worst.
pub fn keep_best_simulated(
    setup: &Setup,
    placed: Placed,
    starts: &mut Vec<Vec<f64>>,
    noise: &Noise,
) {
    if starts.len() <= MANY || placed.effect.place != Place::Actuator {
        return;
    }
    let Some(scores) = scores_of_simulations(setup, placed, starts, noise) else {
        return;
    };
    let mut ranked: Vec<(Simulated, Vec<f64>)> = scores.into_iter().zip(starts.drain(..)).collect();
    ranked.sort_by(|a, b| a.0.left.total_cmp(&b.0.left));
    ranked.truncate(LINEARISED);
    let apart = apart(setup, placed);
    let linear: Vec<usize> = (0..setup.free().len())
        .filter(|&j| !apart.contains(&setup.free()[j]))
        .collect();
    let best = ranked.into_par_iter().map(|(simulated, mut start)| {
        // With the wrong sign of the gain, the derivatives with respect to time constants would have the wrong sign too.
        if let Some(gain) = simulated.gain {
            start[placed.vessel] = within(gain, setup.bounds()[placed.vessel]);
        }
        settled(setup, start, &linear, noise)
    });
    starts.par_extend(best);
}

/// A start with the other parameters fitted in one step, with derivatives for the given free ones, if the cost falls.
fn settled(setup: &Setup, start: Vec<f64>, linear: &[usize], noise: &Noise) -> Vec<f64> {
    let triangle = (!setup.leaves_out(STARTS)).then(|| setup.linearise(&start, noise));
    let Some(triangle) = triangle.flatten() else {
        return start;
    };
    let scale: Vec<f64> = (0..setup.free().len())
        .map(|j| triangle.column_norm(j).max(f64::MIN_POSITIVE))
        .collect();
    let step = triangle.solve(linear, &scale, DAMPING);
    let mut moved = start.clone();
    for (d, &i) in step.iter().zip(setup.free()) {
        moved[i] = within(moved[i] + d, setup.bounds()[i]);
    }
    if costs_more(setup, &moved, noise, triangle.cost()) {
        start
    } else {
        moved
    }
}

/// Positions of the effect's own parameters in the vector, and of time constants, which are not fitted at a start.
fn apart(setup: &Setup, placed: Placed) -> Vec<usize> {
    let own = format!("{}.", placed.effect.id);
    let named = setup.names()[..setup.parameter_count()].iter().enumerate();
    let mut apart: Vec<usize> = named
        .filter(|(_, name)| name.starts_with(&own))
        .map(|(at, _)| at)
        .collect();
    apart.extend(time_constants(setup));
    apart
}

/// Result of the simulation from a start.
#[derive(Clone, Copy)]
struct Simulated {
    /// Sum of squares after the linear fit.
    left: f64,
    /// The pump's gain, if it is fitted.
    gain: Option<f64>,
}

/// Scores of the simulations from all starts.
fn scores_of_simulations(
    setup: &Setup,
    placed: Placed,
    starts: &[Vec<f64>],
    noise: &Noise,
) -> Option<Vec<Simulated>> {
    let parameters = setup.structure.effect_parameters(placed);
    let own: Vec<(usize, f64)> = parameters
        .iter()
        .filter_map(|info| {
            let name = format!("{}.{}", placed.effect.id, info.name);
            let at = setup.names().iter().position(|known| *known == name)?;
            Some((at, info.absent))
        })
        .collect();
    // Starts that differ in more than the effect have separate models without the effect.
    let without = |start: &Vec<f64>| {
        let mut without = start.clone();
        for &(at, absent) in &own {
            without[at] = if absent.is_finite() { absent } else { 0.0 };
        }
        without
    };
    let mut models: Vec<Vec<f64>> = Vec::new();
    for start in starts {
        let without = without(start);
        if !models.contains(&without) {
            models.push(without);
        }
    }
    // Outputs have the weights of the first model in all comparisons.
    let weights = match setup.outputs() {
        1 => vec![1.0],
        _ => models
            .iter()
            .find_map(|x| estimation::squares(setup, x, noise))?
            .weights(),
    };
    // The effect's own columns are not used; those of time constants only where the model fits best without the effect, because elsewhere
    // the time constants are far from their final values.
    let simulated = |x: &Vec<f64>| {
        let left = (!setup.leaves_out(STARTS)).then(|| whitened(setup, x, noise, &weights));
        left.flatten()
    };
    let squares = |x: &Vec<f64>| simulated(x).map_or(f64::INFINITY, |left| dot(&left, &left));
    let best = models
        .par_iter()
        .map(|x| (squares(x), x))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, x)| x.clone());
    let own: Vec<usize> = own.iter().map(|(at, _)| *at).collect();
    let apart = apart(setup, placed);
    let models: Vec<WithoutEffect> = models
        .into_par_iter()
        .filter_map(|x| {
            if setup.leaves_out(STARTS) {
                return None;
            }
            let apart = if Some(&x) == best.as_ref() {
                &own
            } else {
                &apart
            };
            WithoutEffect::at(x, apart, placed.vessel, setup, (noise, &weights))
        })
        .collect();
    let scores = starts.par_iter().map(|start| {
        let without = without(start);
        let model = models.iter().find(|model| model.x == without)?;
        let simulated = model.with(simulated(start)?);
        Some(simulated).filter(|simulated| simulated.left.is_finite())
    });
    let none = Simulated {
        left: f64::INFINITY,
        gain: None,
    };
    Some(scores.map(|score| score.unwrap_or(none)).collect())
}

/// Residuals of a model on the records, whitened and weighted.
fn whitened(setup: &Setup, x: &[f64], noise: &Noise, weights: &[f64]) -> Option<Vec<f64>> {
    let series = noise.whiten(&setup.disturbance(x).ok()?);
    let weighted = series.iter().zip(weights.iter().cycle());
    let all = weighted.flat_map(|(series, weight)| series.iter().map(move |v| v * weight));
    // Rows of missing samples are left out, as in the columns.
    Some(all.filter(|value| !value.is_nan()).collect())
}

/// The model without an effect at the actuator, whitened.
struct WithoutEffect {
    x: Vec<f64>,
    /// The pump's gain.
    gain: f64,
    residual: Vec<f64>,
    /// The column of the pump's gain, times the gain; for a known gain, only the simulation itself.
    by_gain: Option<Vec<f64>>,
    /// The residual and that column, both without the part that the other parameters explain.
    wanted: Vec<f64>,
    /// The other parameters' columns, orthonormal.
    basis: Vec<Vec<f64>>,
}

impl WithoutEffect {
    /// `apart`: positions of parameters that do not take part; `gain`: position of the pump's gain.
    fn at(
        x: Vec<f64>,
        apart: &[usize],
        gain: usize,
        setup: &Setup,
        (noise, weights): (&Noise, &[f64]),
    ) -> Option<Self> {
        let rows = setup.rows(&x)?;
        let mut columns = vec![Vec::with_capacity(setup.samples()); rows.columns];
        let all: Vec<usize> = (0..rows.columns).collect();
        rows.each_whitened(&all, noise, weights, |row| {
            for (column, value) in columns.iter_mut().zip(row) {
                column.push(*value);
            }
        });
        let residual = columns.pop()?;
        let mut by_gain = None;
        let mut basis: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        for (mut column, &at) in columns.into_iter().zip(setup.free()) {
            if at == gain {
                column.iter_mut().for_each(|value| *value *= x[gain]);
                by_gain = Some(column);
            } else if !apart.contains(&at) && orthogonalise(&mut column, &basis).is_some() {
                basis.push(column);
            }
        }
        let mut wanted = residual.clone();
        for (wanted, own) in wanted.iter_mut().zip(by_gain.iter().flatten()) {
            *wanted += own;
        }
        project(&mut wanted, &basis);
        Some(Self {
            gain: x[gain],
            x,
            residual,
            by_gain,
            wanted,
            basis,
        })
    }

    /// The model with the effect, with the residual sum of squares `left` after a fit of the gain and the other parameters.
    fn with(&self, mut left: Vec<f64>) -> Simulated {
        let Some(by_gain) = &self.by_gain else {
            project(&mut left, &self.basis);
            return Simulated {
                left: dot(&left, &left),
                gain: None,
            };
        };
        // The column of the gain, times the gain.
        let before = self.residual.iter().zip(by_gain);
        for (left, (residual, by_gain)) in left.iter_mut().zip(before) {
            *left = by_gain + residual - *left;
        }
        let mut simulated = Simulated {
            left: dot(&self.wanted, &self.wanted),
            gain: None,
        };
        if let Some(length) = orthogonalise(&mut left, &self.basis) {
            let along = dot(&left, &self.wanted);
            simulated.left -= along.powi(2);
            simulated.gain = Some(self.gain * along / length);
        }
        simulated
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Subtracts the projection of a column on an orthonormal basis.
fn project(column: &mut [f64], basis: &[Vec<f64>]) {
    for unit in basis {
        let along = dot(column, unit);
        for (value, unit) in column.iter_mut().zip(unit) {
            *value -= along * unit;
        }
    }
}

/// Orthonormalises a column to a basis, and returns its length before normalisation; `None` if it is in the span of the basis, up to
/// rounding.
fn orthogonalise(column: &mut [f64], basis: &[Vec<f64>]) -> Option<f64> {
    const ROUNDING: f64 = 1e-7;
    let before = dot(column, column).sqrt();
    project(column, basis);
    project(column, basis);
    let left = dot(column, column).sqrt();
    if left.is_nan() || left <= ROUNDING * before {
        return None;
    }
    column.iter_mut().for_each(|value| *value /= left);
    Some(left)
}
