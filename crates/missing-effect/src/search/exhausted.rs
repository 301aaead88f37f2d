//! Whether the residual of a set is noise: then larger sets need no search.

use greybox::{Setup, coloured};

use crate::{
    Error,
    diagnostics::remains::remains,
    fit::{
        criterion::BIC_MARGIN,
        node::{Node, STOPPING},
        noise_model::NOISE_ORDER,
        proposal::any_promise,
    },
};

/// Structure of the residual of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rest {
    /// More than noise, or a further effect has a predicted reduction above its penalty.
    Structure,
    /// Coloured noise; the noise model may have absorbed an effect.
    Coloured,
    /// Noise that hides no effect: it is white, or this noise model was already used for a search.
    Noise,
}

/// Residual of a set: noise, if no further effect has a predicted reduction above its penalty, with the noise model of the set's own
/// residual.
///
/// The colour is that of the set's own residual, so that a coloured noise does not keep the search going. A set beside this
/// one, which leaves as little, is found where this one's effects are exchanged.
pub(crate) fn rest(node: &Node) -> Result<Rest, Error> {
    if node.setup.out_of_time() {
        return Ok(Rest::Structure);
    }
    let own = coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?;
    if remains(node, &own)?.is_some() {
        return Ok(Rest::Structure);
    }
    let noise = own.noise.clone();
    let node = Node {
        fit: own,
        ..node.clone()
    };
    let (n, cost) = (node.setup.samples() as f64, node.fit.cost);
    let pays = |setup: &Setup, promise: f64| {
        n * (cost / promise).ln() - (setup.price(0) - node.setup.price(0)) > BIC_MARGIN
    };
    Ok(if any_promise(&node, &noise, pays) {
        Rest::Structure
    } else if noise.order() > 0 {
        Rest::Coloured
    } else {
        Rest::Noise
    })
}
