//! What each single effect of the catalogue does to the believed model, and what the data would show of it.

use ct_signals::ArModel;

use crate::{Score, search::Node, step};

/// Shown at 1 % false alarm with 90 % power, in standard errors.
const VISIBLE: f64 = 2.576 + 1.282;

/// The scores, in the order of `single`; `noise` is the metric in which both were fitted.
pub(crate) fn scores(base: &Node, single: &[Node], noise: &ArModel) -> Vec<Score> {
    single
        .iter()
        .filter_map(|node| {
            let placed = *node.added.last()?;
            let leading = node
                .setup
                .structure
                .effect_parameters(placed)
                .into_iter()
                .next()?;
            let name = format!("{}.{}", placed.effect.id, leading.name);
            let parameters = step::parameters(&node.setup, &node.fit, &node.fit.std_errors());
            let at = node.setup.names().iter().position(|known| *known == name)?;
            // What the data would show of it: at "absent", where that has a derivative.
            let mut x = node.fit.x.clone();
            let visible = leading.absent.is_finite().then(|| {
                for (name, value) in node.setup.names().iter().zip(&mut x) {
                    if let Some(known) = base.setup.names().iter().position(|known| known == name) {
                        *value = base.fit.x[known];
                    }
                }
                x[at] = leading.absent;
                node.setup.linearise(&x, noise)
            });
            let triangle = visible.flatten();
            let column = node.setup.free().iter().position(|&i| i == at)?;
            let projected = triangle.as_ref().map(|triangle| {
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
                (chosen.at(last, last).abs(), chosen.column_norm(last))
            });
            Some(Score {
                effect: placed.effect.id.to_string(),
                place: step::place_name(node, placed),
                bic_gain: node.gain_over(base),
                rmse: node.fit.rmse,
                visibility: projected.map_or(f64::NAN, |(p, j)| if j > 0.0 { p / j } else { 0.0 }),
                size: parameters.get(at).cloned(),
                smallest_visible: projected
                    .filter(|(p, j)| *p > 1e-6 * j)
                    .map(|(p, _)| VISIBLE * node.fit.variance().sqrt() / p),
            })
        })
        .collect()
}
