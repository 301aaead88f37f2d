//! Whether the residual of a set is noise: then larger sets need no search.

use greybox::{Setup, coloured};

use crate::{
    Error,
    diagnostics::residual_tests::not_noise,
    fit::{
        criterion::BIC_MARGIN,
        node::{Node, STOPPING},
        noise_model::NOISE_ORDER,
        proposal::any_worthwhile,
    },
};

/// Structure of the residual of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ResidualKind {
    /// More than noise, or a further effect has a predicted reduction above its penalty.
    Structure,
    /// Coloured noise; the noise model may have absorbed an effect.
    Coloured,
    /// Noise that hides no effect: it is white, or this noise model was already used for a search.
    Noise,
}

/// Kind of the residual of a set of effects: noise if no residual test rejects this and no further effect has a predicted reduction above its
/// penalty; structure if the time limit is reached.
///
/// The noise model is that of the set's own residual, so that autocorrelated noise does not prolong the search. Other sets with the same
/// error are found later, by swap steps.
pub(crate) fn residual_kind(node: &Node) -> Result<ResidualKind, Error> {
    if node.setup.out_of_time() {
        return Ok(ResidualKind::Structure);
    }
    let own = coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?;
    if not_noise(node, &own)?.is_some() {
        return Ok(ResidualKind::Structure);
    }
    let noise = own.noise.clone();
    let node = Node {
        fit: own,
        ..node.clone()
    };
    let (n, cost) = (node.setup.samples() as f64, node.fit.cost);
    let pays = |setup: &Setup, predicted: f64| {
        n * (cost / predicted).ln() - (setup.bic_penalty(0) - node.setup.bic_penalty(0))
            > BIC_MARGIN
    };
    Ok(if any_worthwhile(&node, &noise, pays) {
        ResidualKind::Structure
    } else if noise.order() > 0 {
        ResidualKind::Coloured
    } else {
        ResidualKind::Noise
    })
}
