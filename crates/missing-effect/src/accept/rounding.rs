//! Readings that a converter has rounded together with their noise.
//!
//! The readings themselves are the evidence: nearly all are multiples of one number `D`, which needs no fit and no criterion. The criterion
//! hardly falls, because the noise acts as dither and makes the mean reading nearly linear in the level, and rounding acts as a further
//! noise of variance `D^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use std::ops::RangeInclusive;

use greybox::{exact_reading_step, fit_from};
use plants::{EffectInfo, Placed};

use crate::{
    Error,
    accept::groups::Group,
    fit::{
        hidden_step::EFFECT,
        node::{FINE, Node, position_of, transfer},
    },
};

/// Rounding is named if its variance is within this range, as a share of the mean squared residual. A larger variance means that the level is
/// constant, or that the grid is not that of a converter.
const SHARE: RangeInclusive<f64> = 1.0 / 3.0..=1.1;

/// A model with quantisation, and the share of quantisation in the error.
pub(crate) struct Rounded<'a> {
    /// The model with rounding at the first of the outputs.
    pub node: Node<'a>,
    /// Group of the rounding effect.
    pub group: Group,
    /// The outputs with rounded readings, at least one: first the one with the largest share of rounding in its error.
    pub outputs: Vec<RoundedOutput>,
}

/// An output whose readings are rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RoundedOutput {
    /// The output.
    pub output: usize,
    /// The quantisation step of the readings \[output unit\].
    pub step: f64,
    /// Share of quantisation alone in the mean squared error of the model without it.
    pub share: f64,
}

/// The model with quantisation, if the readings are multiples of a number and quantisation causes a large part of the error; `None` if the
/// model already has it.
pub(crate) fn rounded<'a>(node: &Node<'a>) -> Result<Option<Rounded<'a>>, Error> {
    let Some(effect) = EffectInfo::find(EFFECT) else {
        return Ok(None);
    };
    let structure = &node.setup.structure;
    if structure.effects().iter().any(|on| on.effect.id == EFFECT) {
        return Ok(None);
    }
    let outputs = rounded_outputs(node);
    let Some(&RoundedOutput { output, step, .. }) = outputs.first() else {
        return Ok(None);
    };
    let placed = Placed {
        effect,
        vessel: output,
    };
    let error = node.fit.rmse[output].powi(2);
    let rounding = step.powi(2) / 12.0;
    // The readings determine the step exactly; a fit would not improve it.
    let mut setup = node.setup.clone();
    setup.fixed.insert(format!("{EFFECT}.step"), step);
    let setup = setup.with_structure(structure.with(placed)?)?;
    let begun = transfer(node, &setup);
    let noise = (error - rounding).max(0.0).sqrt();
    let starts = [0.0, noise, 0.5 * step].map(|noise| {
        let mut start = begun.clone();
        if let Some(at) = position_of(&setup, placed, "noise") {
            start[at] = noise;
        }
        start
    });
    let fit = fit_from(&setup, &starts, &setup.white_noise(), FINE)?.continuing(&node.fit);
    let mut added = node.added.clone();
    added.push(placed);
    let group = Group {
        members: vec![EFFECT.to_string()],
        places: Vec::new(),
    };
    Ok(Some(Rounded {
        node: Node { setup, fit, added },
        group,
        outputs,
    }))
}

/// The outputs with rounded readings, first the one with the largest share of rounding in its error.
fn rounded_outputs(node: &Node) -> Vec<RoundedOutput> {
    let rounds = |output: usize| {
        let step = exact_reading_step(node.setup.records, output)?;
        let share = step.powi(2) / 12.0 / node.fit.rmse[output].powi(2);
        SHARE.contains(&share).then_some(RoundedOutput {
            output,
            step,
            share,
        })
    };
    let mut outputs: Vec<RoundedOutput> = (0..node.setup.outputs()).filter_map(rounds).collect();
    outputs.sort_by(|a, b| b.share.total_cmp(&a.share));
    outputs
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{Options, base::believed::base, simulated};

    #[test]
    fn every_rounded_output_is_found() {
        let mut problem = simulated::two_levels(4);
        for (output, step) in problem.records[0].outputs.iter_mut().zip([0.8, 0.3]) {
            for y in &mut output.values {
                *y = (*y / step).round() * step;
            }
        }
        let (node, _) = base(&problem, &Options::default(), 1.0).unwrap();
        let found = rounded(&node).unwrap().unwrap();
        let steps: Vec<(usize, f64)> = found.outputs.iter().map(|o| (o.output, o.step)).collect();
        // The output with less noise first: rounding is a larger part of its error.
        assert!(
            steps[0].0 == 1 && (steps[0].1 - 0.3).abs() < 1e-9,
            "{steps:?}"
        );
        assert!(
            steps[1].0 == 0 && (steps[1].1 - 0.8).abs() < 1e-9,
            "{steps:?}"
        );
        assert_eq!(found.node.added.last().unwrap().vessel, 1);
    }
}
