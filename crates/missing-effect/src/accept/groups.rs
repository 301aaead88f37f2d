//! Ambiguity: effects that fit as well in place of an accepted one.

use greybox::Noise;
use plants::Placed;
use rayon::prelude::*;

use crate::{
    Error, GROUP_MARGIN, PlaceScore,
    diagnostics::step::place_name,
    fit::node::{Node, ROUGH, best_first, fitted, refine},
    search::swap::{NEAR, swaps},
};

/// Largest ratio of the mean squared residual of an alternative to that of an effect that is a function of time.
pub(crate) const NEARLY: f64 = 1.05;

/// An effect, the alternatives that cannot be distinguished from it, and the places where it may act.
pub(crate) struct Group {
    /// Identifiers: the effect itself, then the alternatives, best first.
    pub members: Vec<String>,
    /// The places of the effect itself, most likely first, if there are several.
    pub places: Vec<PlaceScore>,
}

/// For every added effect: the effect, and all effects that fit as well in its place.
///
/// `searched`: sets that the search has fitted, among them alternatives that a new start may miss; `in_loop`: the records come from a loop
/// that is not simulated.
pub(crate) fn groups<'a>(
    last: &Node<'a>,
    metric: &Noise,
    per_sample: f64,
    singles: Option<&[Node<'a>]>,
    searched: &[&Node<'a>],
    in_loop: bool,
) -> Result<Vec<Group>, Error> {
    (0..last.added.len())
        .into_par_iter()
        .map(|position| {
            let own = last.added[position];
            let mut group = vec![own.effect.id.to_string()];
            let place_of = |placed: Placed| place_name(last, placed);
            let mut places: Vec<PlaceScore> = place_of(own)
                .map(|place| PlaceScore {
                    place,
                    relative_likelihood: 1.0,
                })
                .into_iter()
                .collect();
            // With white-noise weighting, each sample of a coloured residual counts for less than one.
            let behind = |node: &Node| (node.fit.bic() - last.fit.bic()) / per_sample;
            // A size at a bound is evidence against an alternative, unless the final model has it too.
            let possible = |node: &Node| {
                let narrow = in_loop && node.narrow_stiction().is_some();
                let at_the_edge = |placed: &Placed| {
                    node.at_the_edge(*placed)
                        && !(last.added.contains(placed) && last.at_the_edge(*placed))
                };
                !(narrow || node.added.iter().any(at_the_edge))
            };
            let mut nodes = swaps(last, position, metric, singles)?;
            let missed = |set: &&&Node| {
                let found = |other: Placed| {
                    let mut same = nodes.iter().filter(|node| node.added.contains(&other));
                    same.any(|node| behind(node) < GROUP_MARGIN && possible(node))
                };
                stand_in(set, last, position).is_some_and(|other| !found(other))
            };
            // For a single effect, all candidates are alternatives.
            let known = if last.added.len() == 1 && singles.is_some() || last.setup.out_of_time() {
                &[]
            } else {
                searched
            };
            let more: Vec<Node> = known
                .par_iter()
                .filter(missed)
                .filter_map(|set| {
                    let rough = fitted(set, metric, ROUGH, &[]).ok()?;
                    (rough.fit.bic() - last.fit.bic() < NEAR)
                        .then(|| refine(&rough, metric, &[]).ok())?
                })
                .collect();
            nodes.extend(more);
            for node in best_first(nodes) {
                let Some(other) = stand_in(&node, last, position) else {
                    continue;
                };
                let id = other.effect.id;
                if id == own.effect.id
                    && let Some(place) = place_of(other)
                {
                    if places.iter().any(|known| known.place == place) {
                        continue;
                    }
                    let deviance = (node.fit.deviance - last.fit.deviance) / per_sample;
                    places.push(PlaceScore {
                        place,
                        relative_likelihood: (-0.5 * deviance).exp(),
                    });
                    continue;
                }
                if !possible(&node) {
                    continue;
                }
                // A function of time with a fitted instant or course can follow any disturbance: an effect that depends on the plant's own
                // signals and explains nearly as much cannot be distinguished from it.
                let nearly = own.effect.by_clock
                    && node.added.iter().all(|placed| !placed.effect.by_clock)
                    && node.fit.cost < NEARLY * last.fit.cost;
                if (behind(&node) < GROUP_MARGIN || nearly) && !group.iter().any(|g| g == id) {
                    group.push(id.to_string());
                }
            }
            Ok(Group {
                members: group,
                places: relative(places),
            })
        })
        .collect()
}

/// Effect of a set in place of another set's effect at this position, if the sets differ only there.
fn stand_in(set: &Node, last: &Node, position: usize) -> Option<Placed> {
    let kept = last.added.iter().enumerate();
    let mut kept = kept.filter(|(k, _)| *k != position);
    let differs = set.added.len() == last.added.len()
        && !set.added.contains(&last.added[position])
        && kept.all(|(_, placed)| set.added.contains(placed));
    let new = |placed: &&Placed| !last.added.contains(placed);
    set.added.iter().find(new).filter(|_| differs).copied()
}

/// The places relative to the best one, most likely first.
fn relative(mut places: Vec<PlaceScore>) -> Vec<PlaceScore> {
    places.sort_by(|a, b| b.relative_likelihood.total_cmp(&a.relative_likelihood));
    let best = places.first().map_or(1.0, |best| best.relative_likelihood);
    for place in &mut places {
        place.relative_likelihood /= best;
    }
    places
}
