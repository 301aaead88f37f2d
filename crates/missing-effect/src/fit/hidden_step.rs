//! The quantisation step of a coarse sensor with noise: the residual is a sawtooth function of the reading.
//!
//! `D round(y/D) - y` turns once from one multiple of `D` to the next. A fit follows a step only while the highest reading
//! is as many steps as it really is: one more or less is the minimum of another sawtooth. So the steps are looked
//! through one by one.

use ct_signals::ArModel;
use greybox::Setup;
use plants::Picked;
use rayon::prelude::*;

use crate::{
    Error,
    fit::{node::Node, noise_model::NOISE_ORDER},
};

/// The effect with this step.
pub(crate) const EFFECT: &str = "coarse_quantisation";
const STEP: &str = "coarse_quantisation.step";

/// The phase of the highest reading changes by this share from one tested step to the next.
const TURN: f64 = 0.25;
/// Number of finer steps between two, around the best.
const FINER: usize = 16;
/// The fewest and the most steps between the lowest and the highest reading.
const STEPS: (f64, f64) = (2.0, 300.0);
/// Largest number of tested steps times samples. Readings far from zero pass many periods from one step to the next, and long records take
/// long: then only coarse steps are tested.
const LOOKED_AT: f64 = 3e8;

/// Position of a sensor's quantisation step in the parameter vector.
pub(crate) fn step_of(setup: &Setup) -> Option<usize> {
    setup.names().iter().position(|name| name == STEP)
}

/// The quantisation step of an output that explains most of a model's residual, with the model simulated on the measured command, where the
/// level is most accurate.
pub(crate) fn hidden_step(node: &Node, output: usize) -> Result<Option<Picked>, Error> {
    let outputs = node.setup.outputs();
    let of_output = |series: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        series.into_iter().skip(output).step_by(outputs).collect()
    };
    let models = of_output(node.setup.simulate(&node.fit.x)?.output);
    let residuals = of_output(node.setup.residuals(&node.fit.x)?);
    let segments: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let noise = ArModel::fit(&segments, NOISE_ORDER)?;
    let samples = node.setup.samples_per_output()[output];
    let (low, high) = ct_signals::range_of(models.iter().flatten());
    let (span, reach) = (high - low, low.abs().max(high.abs()));
    let grid = TURN / reach;
    let affordable = STEPS.0 + LOOKED_AT / samples as f64 * grid * span;
    // A quantisation step below the noise acts as noise.
    let most = (span / noise.sigma()).min(STEPS.1).min(affordable);
    if !(span > 0.0 && reach.is_finite() && most > STEPS.0) {
        return Ok(None);
    }
    let left = |turns: f64| -> f64 {
        let one = |(model, residual): (&Vec<f64>, &Vec<f64>)| {
            innovations(&without_sawtooth(model, residual, turns), &noise)
        };
        models.iter().zip(&residuals).map(one).sum()
    };
    let looks = ((most - STEPS.0) / span / grid) as usize + 1;
    let best_of = |from: f64, grid: f64, count: usize| {
        (0..count)
            .into_par_iter()
            .map(|k| from + grid * k as f64)
            .map(|turns| (left(turns), turns))
            .min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let Some((_, near)) = best_of(STEPS.0 / span, grid, looks) else {
        return Ok(None);
    };
    let finer = grid / FINER as f64;
    let best = best_of(near - grid, finer, 2 * FINER + 1);
    // The grid is no coarser than a fit needs: the selected start is identified by its value (`Structure::alternatives`).
    let structure = &node.setup.structure;
    let visited = structure.scales.level[structure.scales.outputs[output].vessel];
    let coarsest = 0.5 * (visited.1 - visited.0);
    Ok(best.map(|(_, turns)| Picked {
        value: (1.0 / turns).min(coarsest),
        alternatives: looks as f64,
    }))
}

/// Residual without the sawtooth error of a quantisation step, with this number of periods per unit of the level.
fn without_sawtooth(model: &[f64], residual: &[f64], turns: f64) -> Vec<f64> {
    // Adding and subtracting this number rounds to the nearest integer; `f64::round` would be a call for every sample.
    const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
    let step = 1.0 / turns;
    model
        .iter()
        .zip(residual)
        .map(|(y, r)| r - (((y * turns + WHOLE) - WHOLE) * step - y))
        .collect()
}

/// Sum of squares of the innovations of a noise, from the row with a complete past.
fn innovations(series: &[f64], noise: &ArModel) -> f64 {
    if series.iter().any(|value| value.is_nan()) {
        let whitened = noise.whiten(series);
        let present = whitened.iter().filter(|value| !value.is_nan());
        return present.map(|value| value * value).sum();
    }
    let mut new = series.to_vec();
    for (lag, coefficient) in (1..).zip(noise.coefficients()) {
        for (new, past) in new.iter_mut().skip(lag).zip(series) {
            *new -= coefficient * past;
        }
    }
    new.iter().skip(noise.order()).map(|e| e * e).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use plants::{EffectInfo, Placed};

    use super::*;
    use crate::{
        Options, Problem,
        base::believed::base,
        fit::proposal::{Parent, singles},
        simulated::{self, NOISE},
    };

    fn problem(step: f64, colour: f64, seed: u64) -> Problem {
        let read = |_, level: f64| (level / step).round() * step;
        simulated::tank(|u| u, read, colour, seed)
    }

    #[test]
    fn a_step_is_found_under_noise_of_its_own_size() {
        // Structural errors of 0.5, 1 and 3 times the noise.
        for (seed, (part, colour)) in [(1.73, 0.0), (3.46, 0.0), (3.46, 0.8), (10.4, 0.8)]
            .into_iter()
            .enumerate()
        {
            let step = part * NOISE;
            let problem = problem(step, colour, seed as u64);
            let (node, _) = base(&problem, &Options::default(), 1.0).unwrap();
            let found = hidden_step(&node, 0).unwrap().unwrap();
            // Over the range of the readings, at most 8, the number of steps is exact to less than one. Smaller ranges are not detected:
            // with noise of half a step the number may be wrong by one.
            let counted = |step: f64| 8.0 / step;
            assert!(
                (counted(found.value) - counted(step)).abs() < 0.75,
                "{} for {step}",
                found.value
            );
            // A fit needs this frequency to name the step.
            let noise = node.setup.white_noise();
            assert_eq!(singles(&node, &noise)[0].added[0].effect.id, EFFECT);
        }
    }

    #[test]
    fn the_steps_that_were_looked_at_are_paid_for() {
        let problem = simulated::tank(|u| u, |_, level| level, 0.0, 7);
        let (node, _) = base(&problem, &Options::default(), 1.0).unwrap();
        let found = hidden_step(&node, 0).unwrap().unwrap();
        // From two steps to as many as the noise permits, over the range of the readings.
        assert!(found.alternatives > 100.0);
        let placed = Placed {
            effect: EffectInfo::find(EFFECT).unwrap(),
            vessel: 0,
        };
        let setup = Parent::new(&node).with(placed).unwrap();
        // Two starts of the effect, with and without noise before the quantisation, and all steps that were compared.
        assert_eq!(
            setup.structure.alternatives(placed),
            2.0 + found.alternatives
        );
    }
}
