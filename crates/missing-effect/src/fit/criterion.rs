//! Comparison of two sets of effects: by the criterion (BIC), and by significance over all trials.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::node::Node;

/// An effect is accepted if its criterion falls by more than this ...
pub(crate) const BIC_MARGIN: f64 = 6.0;
/// ... and if chance would cause such a fall less often than this, over all candidates.
const FALSE_CLAIM: f64 = 0.003;
/// Two effects are reported as alternatives if their BIC differs by less than this.
pub const GROUP_MARGIN: f64 = 6.0;

/// Whether a set of effects lowers the deviance significantly, both with the same weighting, or each with its own.
///
/// Chi-square test, corrected (Bonferroni) for the number of effects that the search tried, and within an effect for its number of starts: an
/// effect with a single start is not penalised for another one with many.
pub(crate) fn beyond_chance(gained: &Node, lacking: &Node) -> bool {
    let free = |node: &Node| node.setup.free().len();
    let freedom = free(gained).saturating_sub(free(lacking)).max(1);
    // The noise model of the larger set may have more coefficients, which lower the deviance too.
    let freedom = freedom.max(gained.fit.parameters.saturating_sub(lacking.fit.parameters));
    let fall = lacking.fit.deviance - gained.fit.deviance;
    let chance = ChiSquared::new(freedom as f64).map_or(1.0, |chi| chi.sf(fall.max(0.0)));
    chance_of(gained, lacking, chance)
}

/// Whether a p-value is small enough, corrected for all trials of the search, to accept the difference between two sets.
pub(crate) fn chance_of(gained: &Node, lacking: &Node, chance: f64) -> bool {
    let candidates = lacking.setup.structure.candidates().len() as f64;
    let looks: f64 = gained
        .added
        .iter()
        .filter(|placed| !lacking.added.contains(placed))
        .map(|placed| candidates * gained.setup.structure.alternatives(*placed))
        .product();
    chance * looks < FALSE_CLAIM
}
