//! Partial explanation: the largest part of the error that effects explain, if no set explains all of it.
//!
//! Measured records often hold several causes, and noise that is nearly integrated. That no set of effects leaves noise does not mean
//! that nothing was found: a set is a partial answer where
//! - it explains [`PART`](crate::accept::acceptance::PART) of the excess error, the mean squared simulation error above the noise floor; one
//!   with an effect that follows time alone, which imitates any slow disturbance, [`WHOLE`](crate::accept::acceptance::WHOLE) of it, alone and
//!   beyond what a random walk explains;
//! - of several effects: they are significant if each model has a noise model of its own, of limited memory;
//! - it predicts the next sample as well as the model without it does, each with its own noise model;
//! - what is fitted to one half of the record predicts the other (two-fold cross-validation);
//! - sizes are inside their bounds, and states are physical;
//! - a single level shift of the reading does not explain more.
//!
//! A larger set is taken where it explains half of what each smaller one of its effects leaves.

use greybox::{fit_from, fit_initial_levels};
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error, Rejection,
    accept::{
        acceptance::{PART, WHOLE, explained},
        level_shift::level_shift,
        random_walk::{Walk, beyond_random_walk},
        sticking::sticks,
    },
    diagnostics::held_out::held_out_rmse,
    fit::{
        criterion::BIC_MARGIN,
        node::{FINE, Node, ROUGH, STICTION, refine, without_clock},
        noise_model::in_own_noise,
    },
    search::find::Found,
};

/// Number of sets of one size that are refitted, those with the least simulation error.
const REFITTED: usize = 6;
/// Largest size of a set, except for the confirmed one.
const MOST: usize = 3;
/// A larger set leaves at most this share of the excess error of the smaller set.
const LEFT: f64 = 0.5;

/// Least share of the mean squared error that a set explains on a half of the record that was not fitted.
const CARRIED_OVER: f64 = 0.3;

/// Largest ratio of the innovations' standard deviation with a set to that of the base model: a set that describes a slow error by fast
/// changes has larger innovations.
const ROUGHER: f64 = 1.05;

/// Least difference between the logarithms of the mean square for a level shift and for a set.
const SHIFT_CLEARLY: f64 = 0.1;

/// Stiction that the shape of the record confirms is a partial explanation from this share on.
const PART_BY_SHAPE: f64 = 0.15;

/// A tested set with its result.
pub(crate) struct Tested<'a> {
    /// The set, fitted to the simulation error.
    pub node: Node<'a>,
    /// The share of the excess error that it explains.
    pub share: f64,
    /// Fall of the criterion, each model with a separate noise model.
    pub bic_fall: f64,
    /// The record has the signature of valve stiction, and the set is stiction.
    pub shape: bool,
    /// Conditions that the set does not meet; empty if it is accepted.
    pub rejections: Vec<Rejection>,
}

/// The set that explains the largest part of the excess error: an accepted one or, if there is none, the best rejected one.
///
/// `floor`: standard deviation of each output's noise \[output unit\]; `in_loop`: the records come from a loop that is not simulated.
pub(crate) fn largest_part<'a>(
    base: &Node<'a>,
    found: &Found<'a>,
    singles: &[Node<'a>],
    floor: &[f64],
    in_loop: bool,
) -> Result<Option<Tested<'a>>, Error> {
    let white = base.setup.white_noise();
    let own_base = in_own_noise(base)?;
    let shift_bic = level_shift(base, &white)?.map_or(f64::INFINITY, |shift| shift.bic);
    let sticks = in_loop && sticks(base.setup.records);
    let mut best: Option<Tested<'a>> = None;
    let mut smaller: Vec<(Vec<Placed>, f64)> = Vec::new();
    for size in 1..=MOST.max(found.confirmed.added.len()) {
        if size > 1 && base.setup.out_of_time() {
            break;
        }
        let of_size = |nodes: &[Node<'a>]| -> Vec<Node<'a>> {
            let mut nodes: Vec<Node> = nodes
                .iter()
                .filter(|node| node.added.len() == size && node.plausible())
                .cloned()
                .collect();
            nodes.sort_by(|a, b| a.fit.mean_rmse().total_cmp(&b.fit.mean_rmse()));
            nodes.truncate(REFITTED);
            nodes
        };
        let grown = found.grown.sizes.get(size).filter(|_| size <= MOST);
        let mut sets = of_size(grown.map_or(&[], Vec::as_slice));
        if size == 1 {
            sets.extend(of_size(singles));
            let sticking = |node: &&Node| {
                sticks && node.added.iter().any(|placed| placed.effect.id == STICTION)
            };
            sets.extend(singles.iter().filter(sticking).cloned());
        }
        sets.extend(of_size(std::slice::from_ref(&found.confirmed)));
        if size <= MOST {
            sets.extend(of_size(std::slice::from_ref(&found.richest)));
        }
        let tested = sets
            .into_par_iter()
            .filter_map(|set| refine(&set, &white, &[]).ok())
            .map(|node| {
                let mut tested = test(base, &own_base, node, floor, shift_bic)?;
                if in_loop && tested.node.narrow_stiction().is_some() {
                    tested.rejections.push(Rejection::NarrowBand);
                }
                // The characteristic shape is stronger evidence than the limited fall of the error.
                let alone = tested
                    .node
                    .added
                    .iter()
                    .all(|placed| placed.effect.id == STICTION);
                tested.shape = sticks && alone && tested.share >= PART_BY_SHAPE;
                if tested.shape {
                    tested.rejections.clear();
                }
                Ok::<_, Error>(tested)
            })
            // A set that cannot be fitted with a separate noise model, or to a half of the record, is not accepted.
            .filter(|tested| {
                !matches!(
                    tested,
                    Err(Error::Fit(greybox::Error::Estimation(
                        greybox::NoFit::NoFiniteStart { .. }
                    )))
                )
            })
            .collect::<Result<Vec<_>, _>>()?;
        let more: Vec<Tested> = tested
            .into_iter()
            .filter(|one| says_more(one, &smaller))
            .collect();
        smaller.extend(more.iter().map(|one| (one.node.added.clone(), one.share)));
        let accepted = more.into_iter().max_by(|a, b| {
            key(a)
                .partial_cmp(&key(b))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        best = match (best, accepted) {
            (None, found) => found,
            (Some(best), Some(larger))
                if (key(&larger).0, key(&larger).1) > (key(&best).0, key(&best).1)
                    || (larger.rejections.is_empty()
                        && !best.shape
                        && 1.0 - larger.share <= LEFT * (1.0 - best.share)) =>
            {
                Some(larger)
            }
            (best, _) => best,
        };
    }
    Ok(best)
}

/// The part of the mean squared error that a set explains on one half of a record after a fit to the other half, both ways (two-fold
/// cross-validation); initial states as on held-out records. Negative if the error rises; of several records the longest is used.
///
/// A nearly integrated noise model uses changes from sample to sample only, and treats any slow effect as noise. A true effect
/// reduces the error on data that were not fitted; an effect that only fits a slow disturbance does not.
fn carried_over<'a>(base: &Node<'a>, node: &Node<'a>) -> Result<f64, Error> {
    let white = base.setup.white_noise();
    let records = base.setup.records.iter();
    let Some(record) = records.max_by_key(|record| record.len()) else {
        return Ok(0.0);
    };
    let half = record.len() / 2;
    let halves = [record.rows(0..half), record.rows(half..record.len())];
    let error = |node: &Node, fitted: usize| -> Result<Vec<f64>, Error> {
        let own = node
            .setup
            .with_records(std::slice::from_ref(&halves[fitted]))?
            .with_priors(&node.setup.prior_values())?;
        let begun = fit_initial_levels(&own, &node.fit.x[..own.parameter_count()], ROUGH)?;
        let fit = fit_from(&own, &[begun], &white, FINE)?;
        let half = Node {
            setup: own,
            fit,
            added: node.added.clone(),
        };
        let other = std::slice::from_ref(&halves[1 - fitted]);
        held_out_rmse(&half, other)
    };
    // Outputs are weighted by the residuals of the base.
    let both = |node: &Node| Ok::<_, Error>((error(node, 0)?, error(node, 1)?));
    let (of_base, of_node) = (both(base)?, both(node)?);
    let scales: Vec<f64> = of_base
        .0
        .iter()
        .zip(&of_base.1)
        .map(|(a, b)| a.hypot(*b))
        .collect();
    let mean = |half: &[f64]| -> f64 {
        let outputs = half.iter().zip(&scales);
        // An output without readings in one half is left out.
        let outputs = outputs.filter(|(_, scale)| **scale > 0.0);
        outputs.map(|(rms, scale)| (rms / scale).powi(2)).sum()
    };
    let of_both = |(first, second): &(Vec<f64>, Vec<f64>)| mean(first) + mean(second);
    Ok(1.0 - of_both(&of_node) / of_both(&of_base))
}

/// Whether a set leaves at most [`LEFT`] of the residual of each of its subsets, accepted or rejected.
fn says_more(one: &Tested, smaller: &[(Vec<Placed>, f64)]) -> bool {
    let added = &one.node.added;
    smaller.iter().all(|(subset, share)| {
        let within =
            subset.len() < added.len() && subset.iter().all(|placed| added.contains(placed));
        !within || 1.0 - one.share <= LEFT * (1.0 - share)
    })
}

/// Sort key: accepted sets before rejected ones, those with the characteristic shape before others, then by the explained part.
fn key(tested: &Tested) -> (bool, bool, f64) {
    (tested.rejections.is_empty(), tested.shape, tested.share)
}

fn test<'a>(
    base: &Node<'a>,
    own_base: &Node<'a>,
    node: Node<'a>,
    floor: &[f64],
    shift_bic: f64,
) -> Result<Tested<'a>, Error> {
    let share = explained(base, &node, floor)?;
    let required = if node.added.iter().any(|placed| placed.effect.by_clock) {
        WHOLE
    } else {
        PART
    };
    let mut rejections = Vec::new();
    let mut bic_fall = node.gain_over(base);
    if share < required {
        rejections.push(Rejection::Share {
            share,
            required,
            of_time: required > PART,
        });
    } else {
        let own = in_own_noise(&node)?;
        bic_fall = own.gain_over(own_base);
        if node.added.len() > 1 && bic_fall <= BIC_MARGIN {
            rejections.push(Rejection::NotSignificant);
        }
        let outputs = own.fit.noise.iter().zip(own_base.fit.noise.iter());
        let mut rougher = outputs.map(|(own, base)| own.sigma() > ROUGHER * base.sigma());
        if rougher.any(|rougher| rougher) {
            rejections.push(Rejection::Innovations);
        }
        // A share that is NaN counts as zero.
        if carried_over(base, &node)?.max(0.0) < CARRIED_OVER {
            rejections.push(Rejection::NotPredictive);
        }
    }
    let timeless = without_clock(&node, &node.setup.white_noise())?;
    if required > PART && node.added.len() > 1 {
        rejections.push(Rejection::FunctionOfTime);
    }
    if required > PART && !beyond_random_walk(&node, &timeless, Walk::ANY)? {
        rejections.push(Rejection::RandomWalk);
    }
    if !node.plausible() {
        rejections.push(Rejection::NotPhysical);
    }
    // If set points change in steps, a level shift at a fitted instant explains much: it leads to a rejection only if it explains clearly
    // more than the set.
    let clearly = SHIFT_CLEARLY * node.setup.samples() as f64;
    if shift_bic + clearly < node.fit.bic() {
        rejections.push(Rejection::LevelShift);
    }
    Ok(Tested {
        node,
        share,
        bic_fall,
        shape: false,
        rejections,
    })
}
