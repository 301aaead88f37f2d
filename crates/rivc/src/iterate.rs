//! The iteration: filter, instruments and models of the noise estimated again until nothing changes.

use std::sync::Arc;

use ct_signals::ArModel;

use crate::Error;
use crate::equations::Equations;
use crate::model::Model;
use crate::prepared::Prepared;
use crate::problem::{Delayed, HALVINGS, Problem};

/// The estimates have converged where none would move by more than this share of its standard error, or of itself, and the output error by
/// no more than this share: standard errors alone say nothing where they are very large.
const SHARE_OF_ERROR: f64 = 1e-3;
const SHARE_OF_ITSELF: f64 = 1e-9;
const SHARE_OF_SQUARE: f64 = 1e-5;
/// A delay is known where steps forth and back leave less than this share of its standard error between them: where a whole number of
/// samples fits best the criterion has a kink, and no step is small.
const SHARE_OF_DELAY: f64 = 0.02;
/// Largest relative increase of the output error over the least one among the iterates, in open loop and in a loop: with coloured noise,
/// the solution of the equations is not exactly the minimum of the output error, in particular with feedback.
const GROWTH: [f64; 2] = [0.02, 1.0];
/// The models of the noise are estimated again while an estimate moves by more than this share of its standard error, or a standard
/// deviation of the noise by more than the second share, at most [`NOISE_UPDATES`] times.
const SHARE_FOR_NOISE: f64 = 0.1;
const SHARE_OF_SIGMA: f64 = 1e-3;
const NOISE_UPDATES: usize = 12;

/// The end of an iteration.
#[derive(Clone)]
pub(crate) struct Refined {
    pub(crate) model: Model,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    /// Noise models of the records, if there are any.
    pub(crate) noise: Option<Vec<ArModel>>,
    /// Mean square of the output error on the measured inputs; whitened where there are models of the noise.
    pub(crate) mean_square: f64,
    /// The equations at the model, and the delayed inputs that they were taken from.
    pub(crate) equations: Arc<Equations>,
    pub(crate) delayed: Arc<Delayed>,
    /// Places of the delays that are at a limit: their columns are left out.
    pub(crate) at_limit: Vec<usize>,
}

/// Equations at a model.
struct Asked {
    next: Model,
    /// Whether no estimate would change by more than this share of its standard error.
    within: [bool; 2],
    at_limit: Vec<usize>,
}

/// Largest change of each delay: smaller after the direction of its change has reversed.
struct Reach {
    most: Vec<f64>,
    last: Vec<f64>,
}

impl Problem<'_> {
    /// Largest ratio of an output error to the least one for which the model is still preferred.
    pub(crate) fn growth(&self) -> f64 {
        1.0 + GROWTH[usize::from(self.records.iter().any(Prepared::is_in_loop))]
    }

    /// The place of the first estimated delay in the equations.
    fn first_delay(&self) -> usize {
        let structure = self.structure;
        structure.n - structure.lowest() + structure.numerators()
    }

    /// Solves the equations at a model. A delay whose change exceeds its limit is set to the limit, and the others are solved for with this
    /// value.
    fn ask(
        &self,
        model: &Model,
        equations: &Equations,
        with_delays: bool,
        reach: &mut Reach,
    ) -> Result<Asked, Error> {
        let structure = self.structure;
        let mut x = equations.solve()?;
        let (mut fixed, mut values, mut at_limit) = (Vec::new(), Vec::new(), Vec::new());
        let mut free = vec![true; x.len()];
        let mut bracketed = vec![false; x.len()];
        if with_delays {
            for (i, (j, most)) in structure.estimated_delays().enumerate() {
                let place = self.first_delay() + i;
                let now = model.delays[j];
                let asked = x[place];
                if asked * reach.last[i] < 0.0 {
                    reach.most[i] *= 0.5;
                }
                reach.last[i] = asked;
                let limited = asked.clamp(-now, most - now);
                let step = limited.clamp(-reach.most[i], reach.most[i]);
                if step != asked {
                    fixed.push(place);
                    values.push(step);
                    free[place] = false;
                    if limited == 0.0 {
                        at_limit.push(place);
                    }
                    bracketed[place] = true;
                }
            }
            if !fixed.is_empty() {
                let rest = equations.with_fixed(&fixed, &values).solve()?;
                let mut rest = rest.into_iter();
                for (place, x) in x.iter_mut().enumerate() {
                    if let Some(i) = fixed.iter().position(|fixed| *fixed == place) {
                        *x = values[i];
                    } else if let Some(value) = rest.next() {
                        *x = value;
                    }
                }
            }
        }
        let next = self.model(&x, &model.delays, with_delays);
        let zeros = vec![0.0; at_limit.len()];
        let covariance = equations.with_fixed(&at_limit, &zeros).covariance(None)?;
        let errors = expanded(&covariance, &at_limit, x.len());
        let (old, new) = (model.core(structure), next.core(structure));
        let within = [SHARE_OF_ERROR, SHARE_FOR_NOISE].map(|share| {
            let mut pairs = old.iter().zip(&new).enumerate();
            pairs.all(|(i, (old, new))| {
                let change = (new - old).abs();
                if at_limit.contains(&i) {
                    return true;
                }
                if bracketed[i] {
                    return reach.most[i - self.first_delay()] <= SHARE_OF_DELAY * errors[i];
                }
                change <= share * errors[i] || change <= SHARE_OF_ITSELF * old.abs()
            })
        });
        Ok(Asked {
            next,
            within,
            at_limit,
        })
    }

    /// Iterates filter, instruments and, if used, noise models of at most the given order until convergence. `reach` limits the change of a
    /// delay in one iteration. Without convergence the iterate with the least output error is returned.
    pub(crate) fn refine(
        &self,
        start: Model,
        noise: Option<(usize, Vec<ArModel>)>,
        reach: f64,
        most: usize,
    ) -> Result<Refined, Error> {
        let structure = self.structure;
        let estimated = structure.estimated_delays().count();
        let with_delays = estimated > 0;
        let mut largest = start.delays.iter().copied().fold(0.0, f64::max);
        let mut delayed = Arc::new(self.delayed(&start.delays, largest));
        let (noise_order, mut noise) = noise.unzip();
        let mut updates = 0;
        let growth = self.growth();
        let mut reach = Reach {
            most: vec![reach; estimated],
            last: vec![0.0; estimated],
        };
        let mut model = start;
        // Shared with the best so far: both are as long as the records.
        let mut equations =
            Arc::new(self.equations(&delayed, &model, noise.as_deref(), with_delays)?);
        let mut best: Option<Refined> = None;
        for iterations in 0.. {
            let asked = self.ask(&model, &equations, with_delays, &mut reach);
            let now = Refined {
                mean_square: equations.mean_square(),
                model: model.clone(),
                iterations,
                converged: false,
                noise: noise.clone(),
                equations: equations.clone(),
                delayed: delayed.clone(),
                at_limit: asked
                    .as_ref()
                    .map_or(Vec::new(), |asked| asked.at_limit.clone()),
            };
            let is_best = |best: &Refined| now.mean_square <= best.mean_square;
            let least = best.as_ref().map_or(f64::INFINITY, |best| best.mean_square);
            if best.as_ref().is_none_or(is_best) {
                best = Some(now.clone());
            }
            let asked = match asked {
                Ok(asked) if iterations < most => asked,
                Ok(_) => break,
                // The first equations show the actual error; later ones show only that the iteration diverged.
                Err(error) if iterations == 0 => return Err(error),
                Err(_) => break,
            };
            if let Some(order) = noise_order
                && updates < NOISE_UPDATES
            {
                let renewed = equations.residual_noise(order)?;
                let pairs = renewed.iter().zip(noise.iter().flatten());
                let same = pairs.into_iter().all(|(new, old)| {
                    (new.sigma() - old.sigma()).abs() <= SHARE_OF_SIGMA * old.sigma()
                });
                if !(same && asked.within[1]) {
                    updates += 1;
                    noise = Some(renewed);
                    // Other models of the noise: output errors before are not comparable.
                    best = None;
                }
            }
            let mut next = asked.next;
            let mut taken = None;
            for _ in 0..HALVINGS {
                if next.is_stable(structure) {
                    if with_delays {
                        // A first sample that changes with a delay would prevent convergence.
                        largest = next.delays.iter().copied().fold(largest, f64::max);
                        delayed = Arc::new(self.delayed(&next.delays, largest));
                    }
                    let there = self.equations(&delayed, &next, noise.as_deref(), with_delays)?;
                    let limit = best.as_ref().map_or(f64::INFINITY, |best| best.mean_square);
                    if there.mean_square() <= limit * growth {
                        taken = Some(Arc::new(there));
                        break;
                    }
                }
                next = next.half_way_from(&model);
            }
            let Some(there) = taken else {
                break;
            };
            let change = (there.mean_square() - now.mean_square).abs();
            if asked.within[0] && change <= SHARE_OF_SQUARE * now.mean_square && best.is_some() {
                if now.mean_square <= least * growth {
                    return Ok(Refined {
                        converged: true,
                        ..now
                    });
                }
                break;
            }
            model = next;
            equations = there;
        }
        let tried = self.structure.parameters();
        best.ok_or(Error::NotDetermined {
            parameters: tried,
            samples: equations.samples,
        })
    }
}

/// Roots of the diagonal of a covariance, with 0 in the places that it leaves out.
pub(crate) fn expanded(
    covariance: &nalgebra::DMatrix<f64>,
    left_out: &[usize],
    unknowns: usize,
) -> Vec<f64> {
    let mut errors = covariance
        .diagonal()
        .iter()
        .map(|v| v.sqrt())
        .collect::<Vec<_>>()
        .into_iter();
    (0..unknowns)
        .map(|place| match left_out.contains(&place) {
            true => 0.0,
            false => errors.next().unwrap_or(f64::NAN),
        })
        .collect()
}
