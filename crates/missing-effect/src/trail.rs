//! The trail: the believed model, then one effect after the other, so that the error can be watched falling.

use ct_signals::ArModel;
use greybox::starts_around;

use crate::{
    Error,
    search::{Node, place, refine},
};

/// Further starts of every step: its minimum must not hang on where the search came from.
const STARTS_AROUND: usize = 11;
/// Rounds of further starts where the last model's minimum was found once only.
const MORE_ROUNDS: u64 = 3;

/// The believed model, then one effect after the other, in the order in which the search added them.
pub(crate) fn trail<'a>(
    base: &Node<'a>,
    last: &Node<'a>,
    noise: &ArModel,
) -> Result<Vec<Node<'a>>, Error> {
    let mut trail = vec![refine(base, noise, &[])?];
    trail[0].fit = trail[0].fit.clone().continuing(&base.fit);
    for (k, &placed) in last.added.iter().enumerate() {
        let Some(node) = place(&trail[k], placed, last, noise) else {
            break;
        };
        let mut node = around(&node, noise, k as u64)?;
        // The model that names the effects is held to the same as the believed one: its minimum is found twice.
        let mut rounds = 0;
        while k + 1 == last.added.len() && node.fit.agree < 2 && rounds < MORE_ROUNDS {
            rounds += 1;
            node = around(&node, noise, 100 + rounds)?;
        }
        trail.push(node);
    }
    Ok(trail)
}

/// The node's minimum against those that starts around it reach.
fn around<'a>(node: &Node<'a>, noise: &ArModel, seed: u64) -> Result<Node<'a>, Error> {
    refine(
        node,
        noise,
        &starts_around(&node.setup, &node.fit.x, STARTS_AROUND, seed),
    )
}
