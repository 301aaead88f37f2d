//! The single effects, best first, under either weighting of the residual.

use crate::{
    GROUP_MARGIN, Rankings, Score, Verdict,
    fit::{criterion::BIC_MARGIN, node::Node},
    search::find::Found,
};

/// The single effects under both weightings, those with a sufficient predicted reduction for a refit.
pub(crate) fn rankings(found: &Found, base: &Node) -> Rankings {
    let first_of_each = |nodes: &[Node]| {
        let mut ranked: Vec<String> = Vec::new();
        for placed in nodes.iter().filter_map(|node| node.added.last()) {
            if !ranked.iter().any(|known| known == placed.effect.id) {
                ranked.push(placed.effect.id.to_string());
            }
        }
        ranked
    };
    let white = found.grown.best_singles();
    let Some(grown) = &found.prewhitened else {
        return Rankings {
            white: first_of_each(&white),
            ..Rankings::default()
        };
    };
    let prewhitened = grown.best_singles();
    // A best effect of one weighting that is far from the best of the other weighting, or does not lower its criterion enough.
    let behind = |best: &[Node], others: &[Node], base: &Node| {
        let (Some(best), Some(first)) = (best.first(), others.first()) else {
            return false;
        };
        let own = others.iter().find(|other| other.added == best.added);
        first.gain_over(base) > BIC_MARGIN
            && own.is_none_or(|own| first.gain_over(own) > GROUP_MARGIN)
    };
    Rankings {
        disagree: behind(&white, &prewhitened, &found.base) && behind(&prewhitened, &white, base),
        white: first_of_each(&white),
        prewhitened: first_of_each(&prewhitened),
    }
}

/// The single effects best first, each once; `none` first where nothing is missing.
pub(crate) fn ranked(scores: &[Score], verdict: Verdict) -> Vec<String> {
    let mut ranked: Vec<String> = Vec::new();
    if verdict == Verdict::Adequate {
        ranked.push("none".to_string());
    }
    for score in scores {
        if !ranked.contains(&score.effect) {
            ranked.push(score.effect.clone());
        }
    }
    ranked
}
