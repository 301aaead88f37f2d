//! What cannot be told apart: the effects that fit as well in the place of another.

use ct_signals::ArModel;
use rayon::prelude::*;

use crate::{Error, exchange::exchanges, node::Node};

/// What stands in for another lies within this of its criterion.
pub const GROUP_MARGIN: f64 = 6.0;

/// For every added effect, itself and all that fit as well in its place.
pub(crate) fn groups<'a>(
    last: &Node<'a>,
    metric: &ArModel,
    per_sample: f64,
    singles: Option<&[Node<'a>]>,
) -> Result<Vec<Vec<String>>, Error> {
    (0..last.added.len())
        .into_par_iter()
        .map(|position| {
            let mut group = vec![last.added[position].effect.id.to_string()];
            for node in exchanges(last, position, metric, singles)? {
                let stand_in = node.added.last().map_or("", |placed| placed.effect.id);
                // In the white metric a coloured residual counts each sample for less than one.
                let behind = (node.fit.bic() - last.fit.bic()) / per_sample;
                // A size at its edge speaks against a stand-in, but where the final model has it too.
                let plausible = node.added.iter().all(|placed| {
                    !node.at_the_edge(*placed)
                        || last.added.contains(placed) && last.at_the_edge(*placed)
                });
                if plausible && behind < GROUP_MARGIN && !group.iter().any(|g| g == stand_in) {
                    group.push(stand_in.to_string());
                }
            }
            Ok(group)
        })
        .collect()
}
