//! Readings that a converter has rounded with their noise.
//!
//! The readings themselves are the evidence: nearly all are multiples of one number `D`, which needs no fit and no criterion. By the
//! criterion rounding is hardly to be seen: the noise that is rounded with the level blurs the stairs (dither), and rounding is a further
//! noise of variance `D^2/12`.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use ct_signals::ArModel;
use greybox::{fit_from, reading_grid};
use plants::{EffectInfo, Placed};

use crate::{
    Error,
    groups::Group,
    hidden_step::EFFECT,
    node::{FINE, Node, position_of, transfer},
};

/// Rounding is named where it makes this part of the mean squared error that is left, and not more than all of it, nearly: where the
/// error is less, the level rests or the record is no rounded one.
const SHARE: f64 = 1.0 / 3.0;
const WHOLE: f64 = 1.1;

/// What rounding is, and how much of the error.
pub(crate) struct Rounded<'a> {
    /// The model with rounding.
    pub node: Node<'a>,
    /// What is named with it.
    pub group: Group,
    /// The number that readings are multiples of \[output unit\].
    pub step: f64,
    /// What rounding alone makes of the mean squared error that the model without it leaves.
    pub share: f64,
}

/// The model with rounding, where the readings are multiples of a number and rounding makes a good part
/// of the error; `None` where it has it already.
pub(crate) fn rounded<'a>(node: &Node<'a>) -> Result<Option<Rounded<'a>>, Error> {
    let Some(effect) = EffectInfo::find(EFFECT) else {
        return Ok(None);
    };
    let placed = Placed { effect, vessel: 0 };
    let grid = reading_grid(node.setup.records).filter(|grid| grid.is_coarse() && grid.has_zero());
    let Some(step) = grid.map(|grid| grid.step) else {
        return Ok(None);
    };
    let structure = &node.setup.structure;
    let error = node.fit.rmse.powi(2);
    let known = structure.effects().iter().any(|on| on.effect.id == EFFECT);
    let rounding = step.powi(2) / 12.0;
    if known || !(SHARE * error..=WHOLE * error).contains(&rounding) {
        return Ok(None);
    }
    let mut setup = node.setup.with_structure(structure.with(placed)?)?;
    // The readings tell the step to all their digits, and the level tells nothing more.
    setup.fixed.insert(format!("{EFFECT}.step"), step);
    let setup = setup.with_structure(setup.structure.clone())?;
    let begun = transfer(node, &setup);
    let noise = (error - rounding).max(0.0).sqrt();
    let starts = [0.0, noise, 0.5 * step].map(|noise| {
        let mut start = begun.clone();
        if let Some(at) = position_of(&setup, placed, "noise") {
            start[at] = noise;
        }
        start
    });
    let fit = fit_from(&setup, &starts, &ArModel::white(1.0), FINE)?.continuing(&node.fit);
    let mut added = node.added.clone();
    added.push(placed);
    let group = Group {
        members: vec![EFFECT.to_string()],
        places: Vec::new(),
    };
    Ok(Some(Rounded {
        node: Node { setup, fit, added },
        group,
        step,
        share: rounding / error,
    }))
}
