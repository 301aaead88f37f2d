//! Level shift: the simplest function of time that no effect describes. From one sample to the next the reading changes by a constant.
//!
//! Causes are a recalibration, a sensor that was moved, a cable that was changed. An outlet that opens at that instant explains a part of
//! the level shift, and a wide hysteresis of the sensor or a leak the rest: down to the noise, with three or four sizes instead of one. So
//! a set of effects has to be better than a level shift.

use ct_signals::Record;
use greybox::{Noise, fit_from};
use plants::{Fitted, Place, Term, Variable};
use rayon::prelude::*;

use crate::{
    Error, NotNoise,
    fit::{
        node::{FINE, Node},
        noise_model::residual_noise,
    },
};

/// Number of instants that are tried, those with the largest whitened residual.
const INSTANTS: usize = 4;
/// The first size of the level shift is the difference of the residual's means over this number of samples before and after.
const AROUND: usize = 8;
/// A level shift has a size and an instant; the fit counts the size.
const INSTANT: f64 = 1.0;

/// A fitted model with a level shift of the reading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelShift {
    /// Criterion of the model with the level shift.
    pub bic: f64,
    /// The last sample before the level shift.
    before: usize,
    /// The output with the level shift.
    output: usize,
}

impl LevelShift {
    /// Description of the level shift as unexplained structure of the record.
    pub fn left(self, record: &Record) -> NotNoise {
        let at = record.time[self.before + 1];
        NotNoise::Instant {
            output: record.outputs[self.output].name.clone(),
            record: record.name.clone(),
            from: at,
            to: at,
        }
    }
}

/// A model with a level shift of the reading at the best instant, weighted by a noise model; `None` if the record is too short, no fit
/// succeeds, or there are several records.
pub(crate) fn level_shift(node: &Node, noise: &Noise) -> Result<Option<LevelShift>, Error> {
    let [record] = node.setup.records else {
        return Ok(None);
    };
    let residuals = node.setup.disturbance(&node.fit.x)?;
    // In the presence of other model errors, an instant is abrupt only if the residual's own noise model does not predict it.
    let noise_of_residual = residual_noise(&node.setup, &residuals)?;
    let whitened = noise_of_residual.whiten(&residuals);
    let mut instants: Vec<(f64, usize, usize)> = Vec::new();
    for (output, whitened) in whitened.iter().enumerate() {
        let sigma = noise_of_residual.output(output).sigma();
        let within = AROUND..whitened.len().saturating_sub(AROUND);
        let present = within.filter(|k| !whitened[*k].is_nan());
        instants.extend(present.map(|k| (whitened[k].abs() / sigma, k, output)));
    }
    instants.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fitted = |k: usize, output: usize| -> Result<f64, Error> {
        let residual = &residuals[output];
        let size = mean(&residual[k..k + AROUND]) - mean(&residual[k - AROUND..k]);
        let time = &record.time;
        let structure = node.setup.structure.with_term(Term {
            name: "level_shift_of_the_reading".to_string(),
            place: Place::Sensor,
            vessel: output,
            variable: Variable::Time,
            knots: vec![time[k - 1] - time[0], time[k] - time[0]],
            ordinates: vec![0.0, size],
            fitted: Fitted::Scale,
        })?;
        let setup = node.setup.with_structure(structure)?;
        let mut start = node.fit.x.clone();
        start.insert(node.setup.parameter_count(), 1.0);
        let fit = fit_from(&setup, &[start], noise, FINE)?;
        Ok(fit.bic() + INSTANT * (setup.samples() as f64).ln())
    };
    Ok(instants
        .into_par_iter()
        .take(INSTANTS)
        .filter_map(|(_, k, output)| {
            Some(LevelShift {
                bic: fitted(k, output).ok()?,
                before: k - 1,
                output,
            })
        })
        .min_by(|a, b| a.bic.total_cmp(&b.bic)))
}

/// The mean of the present samples; zero if there is none.
fn mean(series: &[f64]) -> f64 {
    let present = || series.iter().filter(|value| !value.is_nan());
    present().sum::<f64>() / present().count().max(1) as f64
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use plants::{Known, Plant, Scales, Structure};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{
        Options, Problem,
        base::believed::base,
        simulated::{self, INTERVAL},
    };

    const SAMPLES: usize = 600;
    const AT: usize = 320;
    /// The records do not begin at zero \[s\].
    const BEGIN: f64 = 100.0;

    /// A linear tank whose reading is shifted from a sample on.
    fn problem(by: f64, records: usize, seed: u64) -> Problem {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let plant = Plant::SingleTankLinear;
        let scales = Scales::from_ranges((3.0, 5.0), (5.0, 20.0), INTERVAL, 1200.0);
        let structure = Structure::new(plant, Known::default(), scales);
        let records = (0..records).map(|_| {
            let theta = [4.0, 90.0, 0.0];
            let mut record = simulated::record(&structure, &theta, (3.0, 5.0), SAMPLES, &mut rng);
            record.time.iter_mut().for_each(|t| *t += BEGIN);
            record.outputs[0].values[AT..]
                .iter_mut()
                .for_each(|y| *y += by);
            record
        });
        simulated::problem(plant, Known::default(), records.collect())
    }

    #[test]
    fn a_level_shift_is_found_where_it_is_and_is_significant_only_there() {
        let noise = Noise::white(1);
        for by in [0.3, -0.3, 3.0] {
            let problem = problem(by, 1, 1);
            let (node, _) = base(&problem, &Options::default(), 1.0).unwrap();
            let found = level_shift(&node, &noise).unwrap().unwrap();
            assert!(found.bic < node.fit.bic() - 100.0);
            let at = BEGIN + INTERVAL * AT as f64;
            let left = found.left(&problem.records[0]);
            assert!(
                matches!(left, NotNoise::Instant { from, to, .. } if from == at && to == at),
                "{left:?}"
            );
        }
        // Without a level shift, the best of several instants lowers the criterion by less than the penalty of its two parameters.
        let worth = (1..=10).filter(|seed| {
            let problem = problem(0.0, 1, *seed);
            let (node, _) = base(&problem, &Options::default(), 1.0).unwrap();
            let found = level_shift(&node, &noise).unwrap().unwrap();
            found.bic < node.fit.bic()
        });
        assert_eq!(worth.count(), 0);
    }

    #[test]
    fn of_several_records_none_is_sought() {
        let noise = Noise::white(1);
        let several = problem(0.3, 2, 1);
        let (node, _) = base(&several, &Options::default(), 1.0).unwrap();
        assert!(level_shift(&node, &noise).unwrap().is_none());
    }
}
