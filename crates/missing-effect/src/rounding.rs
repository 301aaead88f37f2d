//! Readings that a converter has rounded with their noise.
//!
//! The readings themselves are the evidence: nearly all are multiples of one number `D`, which needs no fit and no criterion. The criterion
//! hardly falls: the noise that is rounded with the level (dither) makes the mean reading nearly linear in the level, and rounding acts as a
//! further noise of variance `D^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use std::ops::RangeInclusive;

use greybox::{exact_reading_step, fit_from};
use plants::{EffectInfo, Placed};

use crate::{
    Error,
    groups::Group,
    hidden_step::EFFECT,
    node::{FINE, Node, position_of, transfer},
};

/// Rounding is named where its variance is this part of the mean squared error that is left. Where it is clearly more than that error, the
/// level rests, or the grid is not that of a converter.
const SHARE: RangeInclusive<f64> = 1.0 / 3.0..=1.1;

/// A model with rounding, and what rounding makes of the error.
pub(crate) struct Rounded<'a> {
    /// The model with rounding.
    pub node: Node<'a>,
    /// What is named with it.
    pub group: Group,
    /// The output whose readings are rounded.
    pub output: usize,
    /// The number that readings are multiples of \[output unit\].
    pub step: f64,
    /// Share of rounding alone in the mean squared error of the model without it.
    pub share: f64,
}

/// The model with rounding, where the readings are multiples of a number and rounding makes a good part
/// of the error; `None` where it has it already.
pub(crate) fn rounded<'a>(node: &Node<'a>) -> Result<Option<Rounded<'a>>, Error> {
    let Some(effect) = EffectInfo::find(EFFECT) else {
        return Ok(None);
    };
    let structure = &node.setup.structure;
    if structure.effects().iter().any(|on| on.effect.id == EFFECT) {
        return Ok(None);
    }
    let rounds = |output: usize| {
        let step = exact_reading_step(node.setup.records, output)?;
        let share = step.powi(2) / 12.0 / node.fit.rmse[output].powi(2);
        SHARE.contains(&share).then_some((output, step, share))
    };
    let Some((output, step, share)) = (0..node.setup.outputs()).find_map(rounds) else {
        return Ok(None);
    };
    let placed = Placed {
        effect,
        vessel: output,
    };
    let error = node.fit.rmse[output].powi(2);
    let rounding = step.powi(2) / 12.0;
    // The readings give the step to all their digits; a fit adds nothing.
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
        output,
        step,
        share,
    }))
}
