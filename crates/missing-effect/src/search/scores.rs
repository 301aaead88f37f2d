//! Results of adding each single effect of the catalogue to the believed model, and minimum detectable sizes.

use ct_signals::ArModel;
use greybox::{Noise, Signature};
use rayon::prelude::*;

use crate::{
    Score,
    diagnostics::step::{self, of_one},
    fit::node::Node,
};

/// An effect is not detectable if less than this share of its signature is independent of the fitted parameters.
const ABSORBED: f64 = 1e-6;

/// The scores, in the order of `single`; `noise` is the weighting of both fits, `floors` the standard deviations of the outputs' noise
/// \[output unit\].
pub(crate) fn scores(base: &Node, single: &[Node], noise: &Noise, floors: &[f64]) -> Vec<Score> {
    single
        .par_iter()
        .filter_map(|node| {
            let placed = *node.added.last()?;
            let (_, at) = node.size_of(placed)?;
            let parameters = step::parameters(&node.setup, &node.fit, &node.fit.std_errors());
            let signature = signature(base, node, noise, &node.fit.scales());
            Some(Score {
                effect: placed.effect.id.to_string(),
                place: step::place_name(node, placed),
                bic_gain: node.gain_over(base),
                rmse: of_one(&node.fit.rmse),
                weighted_rmse: node
                    .setup
                    .weighted_rms(&node.setup.residuals(&node.fit.x).ok()?, floors),
                visibility: signature.map_or(f64::NAN, Signature::visibility),
                size: parameters.get(at).cloned(),
                smallest_visible: signature.and_then(|one| one.smallest_detectable(ABSORBED)),
            })
        })
        .collect()
}

/// Ratio of the minimum detectable sizes in this noise and in white noise of the same variance: the median over the effects that have a
/// signature at their absent value. `None` for white noise.
pub(crate) fn detectable_size_ratio(base: &Node, single: &[Node], noise: &Noise) -> Option<f64> {
    if noise.order() == 0 {
        return None;
    }
    let white = base.setup.white_noise();
    let innovations = noise.sigmas();
    let whole: Vec<f64> = noise.iter().map(ArModel::stationary_std).collect();
    let mut ratios: Vec<f64> = single
        .par_iter()
        .filter_map(|node| {
            let own = signature(base, node, noise, &innovations)?;
            let in_white = signature(base, node, &white, &whole)?;
            (own.visibility() > ABSORBED).then(|| in_white.own / own.own)
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

/// Signature of an effect at its absent value, orthogonal to the derivatives by the base's own parameters, in standard deviations of the
/// innovations (`scales`, of each output); `None` if there is no derivative.
///
/// The scales are those of the fit: at the absent value the residuals hold the effect, and would make an output that it acts on count less.
fn signature(base: &Node, node: &Node, noise: &Noise, scales: &[f64]) -> Option<Signature> {
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
    let mut setup = node.setup.clone();
    setup.known_scales = Some(scales.to_vec());
    let triangle = setup.linearise(&x, noise)?;
    let column = node.setup.free().iter().position(|&i| i == at)?;
    let others: Vec<usize> = (0..node.setup.free().len())
        .filter(|&j| {
            j != column
                && base
                    .setup
                    .names()
                    .contains(&node.setup.names()[node.setup.free()[j]])
        })
        .collect();
    // Outputs are weighted relative to the first one's noise.
    Some(triangle.signature(column, &others, scales[0]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use plants::{EffectInfo, Placed};

    use super::*;
    use crate::{
        Options,
        base::believed::base,
        fit::{node::FINE, proposal::place},
        simulated::{self, INTERVAL},
    };

    #[test]
    fn what_is_visible_hangs_on_the_noise_and_not_on_the_effect() {
        // Both levels of two linear tanks; the lower sensor drifts by ten times the noise, so the residual of a model without the drift
        // contains it.
        let mut problem = simulated::two_levels(5);
        for (k, y) in problem.records[0].outputs[1].values.iter_mut().enumerate() {
            *y += 0.0005 * INTERVAL * k as f64;
        }
        let (base, _) = base(&problem, &Options::default(), 1.0).unwrap();
        let white = base.setup.white_noise();
        let drift = Placed {
            effect: EffectInfo::find("sensor_drift").unwrap(),
            vessel: 1,
        };
        let node = place(&base, drift, &base, &white, FINE).unwrap();
        let scored = scores(&base, std::slice::from_ref(&node), &white, &[1.0, 1.0]);
        // The reading is linear in the drift, so its standard error is that of the signature.
        let error = scored[0].size.as_ref().unwrap().std_error.unwrap();
        let visible = scored[0].smallest_visible.unwrap();
        assert!(
            (visible / (3.858 * error) - 1.0).abs() < 0.15,
            "{visible} beside {}",
            3.858 * error
        );
    }
}
