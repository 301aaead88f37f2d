//! What each single effect of the catalogue does to the believed model, and what the data would show of it.

use ct_signals::ArModel;
use greybox::Noise;
use rayon::prelude::*;

use crate::{Score, node::Node, step, step::of_one};

/// Shown at 1 % false alarm with 90 % power, in standard errors.
const VISIBLE: f64 = 2.576 + 1.282;
/// An effect whose signature is left with less than this part by the fitted parameters is not visible at all.
const ABSORBED: f64 = 1e-6;

/// The scores, in the order of `single`; `noise` is the metric in which both were fitted, `floors` the standard
/// deviations of the outputs' noise \[output unit\].
pub(crate) fn scores(base: &Node, single: &[Node], noise: &Noise, floors: &[f64]) -> Vec<Score> {
    single
        .par_iter()
        .filter_map(|node| {
            let placed = *node.added.last()?;
            let (_, at) = node.size_of(placed)?;
            let parameters = step::parameters(&node.setup, &node.fit, &node.fit.std_errors());
            let projected = signature(base, node, noise);
            Some(Score {
                effect: placed.effect.id.to_string(),
                place: step::place_name(node, placed),
                bic_gain: node.gain_over(base),
                rmse: of_one(&node.fit.rmse),
                weighted_rmse: node
                    .setup
                    .weighted_rms(&node.setup.residuals(&node.fit.x).ok()?, floors),
                visibility: projected.map_or(f64::NAN, |(p, j)| if j > 0.0 { p / j } else { 0.0 }),
                size: parameters.get(at).cloned(),
                smallest_visible: projected
                    .filter(|(p, j)| *p > ABSORBED * j)
                    .map(|(p, _)| VISIBLE * node.fit.variance().sqrt() / p),
            })
        })
        .collect()
}

/// How many times larger an effect has to be to be seen in this noise than in white noise of the same size: the median
/// over the effects that have a signature where they are absent. `None` where the noise is white.
pub(crate) fn price_of_colour(base: &Node, single: &[Node], noise: &Noise) -> Option<f64> {
    if noise.order() == 0 {
        return None;
    }
    let white = base.setup.white_noise();
    // Innovations over the noise itself, in the mean of outputs.
    let ratio = |model: &ArModel| (model.sigma() / model.stationary_std()).ln();
    let colour = (noise.iter().map(ratio).sum::<f64>() / noise.outputs() as f64).exp();
    let mut ratios: Vec<f64> = single
        .par_iter()
        .filter_map(|node| {
            let (own, whole) = signature(base, node, noise)?;
            let (in_white, _) = signature(base, node, &white)?;
            (own > ABSORBED * whole).then(|| in_white / own * colour)
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

/// The length of the signature of an effect at its absent value, beside what the base's own parameters can imitate and as
/// a whole; `None` where it has no derivative there.
fn signature(base: &Node, node: &Node, noise: &Noise) -> Option<(f64, f64)> {
    let (leading, at) = node.size_of(*node.added.last()?)?;
    if !leading.absent.is_finite() {
        return None;
    }
    let mut x = node.fit.x.clone();
    for (name, value) in node.setup.names().iter().zip(&mut x) {
        if let Some(known) = base.setup.names().iter().position(|known| known == name) {
            *value = base.fit.x[known];
        }
    }
    x[at] = leading.absent;
    let triangle = node.setup.linearise(&x, noise)?;
    let column = node.setup.free().iter().position(|&i| i == at)?;
    let mut order: Vec<usize> = (0..node.setup.free().len())
        .filter(|&j| {
            j != column
                && base
                    .setup
                    .names()
                    .contains(&node.setup.names()[node.setup.free()[j]])
        })
        .collect();
    order.push(column);
    let chosen = triangle.select(&order);
    let last = order.len() - 1;
    Some((chosen.at(last, last).abs(), chosen.column_norm(last)))
}
