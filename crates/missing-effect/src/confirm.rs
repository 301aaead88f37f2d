//! Confirmation: which effects of a set stay when the noise may explain what they explain.

use ct_signals::ArModel;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{
    Error,
    search::{Node, without},
};

/// An effect is accepted where its criterion falls by more than this ...
pub(crate) const BIC_MARGIN: f64 = 6.0;
/// ... and where chance would let so large a fall happen less often than this, counted over all candidates.
const FALSE_CLAIM: f64 = 0.001;

/// Whether a fall of the deviance is more than the best of all candidates would bring where there is nothing:
/// chi-square, corrected (Bonferroni) for every start of every candidate of the `lacking` model.
pub(crate) fn beyond_chance(fall: f64, freedom: f64, lacking: &Node) -> bool {
    let chance = ChiSquared::new(freedom).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
    chance * candidates(lacking) < FALSE_CLAIM
}

/// Takes out, one by one, what the noise explains as well.
pub(crate) fn confirm<'a>(mut node: Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    while let Some(lacking) = least_useful(&node, noise)? {
        let freedom = (node.fit.parameters - lacking.fit.parameters).max(1) as f64;
        let fall = lacking.fit.deviance - node.fit.deviance;
        if node.gain_over(&lacking) > BIC_MARGIN && beyond_chance(fall, freedom, &lacking) {
            break;
        }
        node = lacking;
    }
    Ok(node)
}

/// The node without the effect whose loss costs least; `None` where it has none.
pub(crate) fn least_useful<'a>(
    node: &Node<'a>,
    noise: &ArModel,
) -> Result<Option<Node<'a>>, Error> {
    let lacking: Vec<Node<'a>> = (0..node.added.len())
        .into_par_iter()
        .map(|position| without(node, position, noise))
        .collect::<Result<_, _>>()?;
    Ok(lacking
        .into_iter()
        .min_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic())))
}

/// How many ways the search had to find something where there is nothing: every start of every candidate is one.
fn candidates(node: &Node) -> f64 {
    node.setup
        .structure
        .candidates()
        .into_iter()
        .map(|placed| {
            let parameters = node.setup.structure.effect_parameters(placed);
            parameters
                .iter()
                .map(|p| p.starts.len() as f64)
                .product::<f64>()
        })
        .sum()
}
