//! A set without one of its effects.
//!
//! Near an unstable equilibrium, or over many turns of a shaft, the least change of a torque moves the simulation far away: without even a
//! small effect, a fit that begins at the other estimates may end in another minimum, and the effect seems necessary. To first order the rise
//! of the deviance is the Wald statistic of the effect's sizes. Where it is far more, the sizes become smaller step by step, and the
//! parameters of the model and of the other effects follow.

use ct_model::effects::Role;
use estimation::{Noise, Residuals, fit_from, linearise, within};
use rayon::prelude::*;

use crate::Error;
use crate::fit::node::{Context, FINE, Node, ROUGH};
use crate::search::score::step_within;

/// Shares of the sizes from which they go to zero.
const SHARES: [f64; 4] = [0.5, 0.2, 0.05, 0.01];
/// Weight of the row that sets the step of a size, as a multiple of the length of its column.
const HELD: f64 = 1e6;
/// Rise of the deviance over the Wald statistic and the penalty of the sizes that shows another minimum.
const OTHER_MINIMUM: f64 = 10.0;

impl Context<'_> {
    /// The set without each of the effects that the search added.
    pub fn each_lacking(&self, node: &Node, base: &Node, noise: &Noise) -> Vec<Node> {
        (base.added.len()..node.added.len())
            .into_par_iter()
            .filter_map(|position| self.lacking(node, position, noise).ok())
            .collect()
    }

    /// The set without one of its effects.
    pub fn lacking(&self, node: &Node, position: usize, noise: &Noise) -> Result<Node, Error> {
        let direct = self.without(node, position, noise, FINE)?;
        let Some((statistic, sizes)) = self.wald(node, position) else {
            return Ok(direct);
        };
        let expected = statistic + sizes as f64 * self.samples().ln();
        let rise = direct.fit.deviance - node.fit.deviance;
        if rise <= OTHER_MINIMUM * expected || self.limit.passed() {
            return Ok(direct);
        }
        let reduced = self.with_small_sizes(node, position, noise);
        let other = reduced.and_then(|reduced| self.without(&reduced, position, noise, FINE));
        Ok(match other {
            Ok(other) if other.fit.cost < direct.fit.cost => other,
            _ => direct,
        })
    }

    /// The Wald statistic of the sizes of a set's effect, as if these were uncorrelated, and their number: `None` without a size, without a
    /// standard error of one, and for an effect with a threshold, which acts without them.
    pub fn wald(&self, node: &Node, position: usize) -> Option<(f64, usize)> {
        let mut own = self.candidates[node.added[position]].parameters.iter();
        if own.any(|parameter| parameter.role == Role::Threshold) {
            return None;
        }
        let errors = node.fit.std_errors();
        let sizes = self.sizes_of(node, position);
        let squares = sizes.iter().map(|&(at, absent)| {
            let distance = node.fit.x[at] - absent;
            Some((distance / errors[at]?).powi(2))
        });
        let squares = squares.collect::<Option<Vec<f64>>>()?;
        (!squares.is_empty()).then(|| (squares.iter().sum(), squares.len()))
    }

    /// The entries of the sizes of a set's effect, and their values without it.
    fn sizes_of(&self, node: &Node, position: usize) -> Vec<(usize, f64)> {
        let own = self.candidates[node.added[position]].parameters.iter();
        let sizes = own.filter(|parameter| parameter.role == Role::Size);
        let place = |name: &str| {
            let mut all = node.spec().parameters.iter();
            all.position(|parameter| parameter.about.name == name)
        };
        sizes
            .filter_map(|size| Some((place(&size.name)?, size.absent)))
            .collect()
    }

    /// A set whose other parameters have followed the sizes of an effect to nearly zero.
    fn with_small_sizes(&self, node: &Node, position: usize, noise: &Noise) -> Result<Node, Error> {
        let setup = self.setup(&node.model)?;
        let own = &self.candidates[node.added[position]].parameters;
        let is_own = |at: usize| {
            let name = &setup.names()[at];
            own.iter().any(|parameter| parameter.name == *name)
        };
        let free = setup.free();
        let others: Vec<usize> = free.iter().copied().filter(|&at| !is_own(at)).collect();
        let fitted = setup.with_free(&others);
        let sizes = self.sizes_of(node, position);
        let mut x = node.fit.x.clone();
        for share in SHARES {
            let to = |at: usize, absent: f64| absent + share * (node.fit.x[at] - absent);
            // To first order, where the others are then: the other parameters of the effect stay.
            if let Some(triangle) = linearise(&setup, &x, noise) {
                // Its outputs keep their weights: the additional rows belong to none.
                let mut triangle = triangle.damped(&vec![1.0; free.len()], 0.0);
                for &(at, absent) in &sizes {
                    let Some(column) = free.iter().position(|&free| free == at) else {
                        continue;
                    };
                    let weight = HELD * triangle.column_norm(column);
                    let mut row = vec![0.0; triangle.columns()];
                    row[column] = weight;
                    row[free.len()] = weight * (to(at, absent) - x[at]);
                    triangle.push(&row);
                }
                triangle.finish();
                let moves = |at: usize| !is_own(at) || sizes.iter().any(|size| size.0 == at);
                let columns = (0..free.len()).filter(|&column| moves(free[column]));
                let columns: Vec<usize> = columns.collect();
                let step = step_within(&triangle, (&setup, &x), &columns);
                for (step, &at) in step.iter().zip(free) {
                    x[at] = within(x[at] + step, setup.bounds()[at]);
                }
            }
            for &(at, absent) in &sizes {
                x[at] = to(at, absent);
            }
            x = fit_from(&fitted, vec![x.into()], noise, ROUGH)?.x;
        }
        let mut reduced = node.clone();
        reduced.fit.x = x;
        Ok(reduced)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use ct_model::ModelSpec;
    use ct_model::effects::{OwnCandidate, OwnParameter};
    use ct_signals::{Channel, Record, noise};
    use estimation::Noise;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::base::problem::{Limit, Options, Problem};
    use crate::fit::believed::begin;
    use crate::fit::node::FINE;

    const OSCILLATION: &str = "model Oscillation
      parameter Real p = 1;
      input Real u;
      output Real y = sin(phase) + 0*u;
      output Real z = cos(phase);
      Real phase = p*time;
    end Oscillation;";

    /// The frequency of an oscillation has many minima. Without an effect that is a part of it, the fit has to go far.
    #[test]
    fn the_other_parameters_follow_an_effect_to_its_absence() {
        let time: Vec<f64> = (0..500).map(|k| 0.05 * f64::from(k)).collect();
        let u: Vec<f64> = (0..500).map(|k| f64::from(k / 20 * 7 % 13)).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut noise = || noise::ar1(500, 0.1, 0.0, &mut rng);
        let phases = time.iter().zip(&u);
        let phases = phases.map(|(t, u)| (1.0 + 0.9 * (1.0 + 1e-4 * u)) * t);
        let y = phases
            .clone()
            .zip(noise())
            .map(|(phase, e)| phase.sin() + e);
        let z = phases.zip(noise()).map(|(phase, e)| phase.cos() + e);
        let record = Record {
            name: "record".to_string(),
            outputs: vec![
                Channel::new("y", "", y.collect()),
                Channel::new("z", "", z.collect()),
            ],
            inputs: vec![Channel::new("u", "", u)],
            time,
            ..Record::default()
        };
        let spec = ModelSpec::parse(OSCILLATION).unwrap();
        let mut problem = Problem::builder(spec, [record]).build().unwrap();
        let size = OwnParameter {
            start: 0.9,
            ..OwnParameter::default()
        };
        let candidate = OwnCandidate {
            parameters: BTreeMap::from([("e".to_string(), size)]),
            terms: BTreeMap::from([("phase".to_string(), "e*(1 + 1e-4*u)*time".to_string())]),
            ..OwnCandidate::default()
        };
        problem.candidates.insert("more".to_string(), candidate);
        let options = Options::default();
        let (context, _) = begin(&problem, &options, Limit::new(&options)).unwrap();
        let added = context.candidates.iter().position(|c| c.id == "more");
        let model = Arc::new(context.model(&[added.unwrap()]).unwrap());
        let white = Noise::white(2);
        let starts = vec![vec![1.0, 0.9]];
        let set = context.fitted(vec![added.unwrap()], model, starts, &white, FINE);
        let set = set.unwrap();
        let near = |value: f64| (0.08..0.12).contains(&value);
        assert!(near(set.fit.rmse[0]), "{:?}", set.fit.rmse);
        let direct = context.without(&set, 0, &white, FINE).unwrap();
        assert!(direct.fit.rmse[0] > 0.5, "{:?}", direct.fit.rmse);
        let lacking = context.lacking(&set, 0, &white).unwrap();
        assert!(near(lacking.fit.rmse[0]), "{:?}", lacking.fit.rmse);
        assert!((lacking.fit.x[0] - 1.9).abs() < 0.01, "{:?}", lacking.fit.x);
    }
}
