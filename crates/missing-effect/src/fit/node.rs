//! A set of effects with its fit, and the fits of its extensions and reductions.

use greybox::{Fit, Noise, Setup, Start, Stopping, fit_from, fit_onward, random_starts};
use plants::{ParameterInfo, Placed};

use crate::Error;

/// Stopping criteria of the fit of a believed model.
pub(crate) const STOPPING: Stopping = Stopping {
    evaluations: 120,
    cost: 1e-9,
};

/// Stopping criteria of a first fit, which only has to give a rank.
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 20,
    cost: 1e-3,
};
/// Stopping criteria of a first fit of many candidates.
pub(crate) const QUICK: Stopping = Stopping {
    evaluations: 5,
    cost: 1e-3,
};
/// Stopping criteria of a final fit.
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 80,
    cost: 1e-8,
};
/// Random starts of a set without one of its effects, if it cannot be simulated with its present parameters.
const OTHER_STARTS: usize = 12;
/// Valve stiction, and the width of its band relative to the range of the command below which feedback resembles it.
pub(crate) const STICTION: &str = "stiction_backlash";
const NARROW: f64 = 0.25;

/// A structure with its fit.
#[derive(Debug, Clone)]
pub(crate) struct Node<'a> {
    pub setup: Setup<'a>,
    pub fit: Fit,
    /// Effects added to the base, in order.
    pub added: Vec<Placed>,
}

impl Node<'_> {
    /// Fall of the criterion against another node in the same metric.
    pub fn gain_over(&self, other: &Node) -> f64 {
        other.fit.bic() - self.fit.bic()
    }

    /// The leading parameter of an added effect (its size), and its position in the vector.
    pub fn size_of(&self, placed: Placed) -> Option<(ParameterInfo, usize)> {
        let parameters = self.setup.structure.effect_parameters(placed);
        let leading = parameters.into_iter().next()?;
        let at = position_of(&self.setup, placed, leading.name)?;
        Some((leading, at))
    }

    /// The added stiction, if its band is narrower than [`NARROW`] of the range of the command.
    ///
    /// In a loop that is not simulated, a disturbance comes back through the command with a delay, as if the valve had play: the model
    /// that runs on that command takes such a phase for a narrow band. A band that holds the valve over a wide part of the command's
    /// moves is no such thing.
    pub fn narrow_stiction(&self) -> Option<usize> {
        let position = self
            .added
            .iter()
            .position(|placed| placed.effect.id == STICTION)?;
        let (_, at) = self.size_of(self.added[position])?;
        let (low, high) = self.setup.structure.site(self.added[position]).input();
        (self.fit.x[at] < NARROW * (high - low)).then_some(position)
    }
}

/// Position of an effect's parameter in the vector.
pub(crate) fn position_of(setup: &Setup, placed: Placed, parameter: &str) -> Option<usize> {
    let name = format!("{}.{parameter}", placed.effect.id);
    setup.names().iter().position(|known| *known == name)
}

/// The parent's vector in the child's order; additional entries are zero.
pub(crate) fn transfer(parent: &Node, child: &Setup) -> Vec<f64> {
    child
        .names()
        .iter()
        .map(|name| {
            parent
                .setup
                .names()
                .iter()
                .position(|known| known == name)
                .map_or(0.0, |at| parent.fit.x[at])
        })
        .collect()
}

/// Fits a model's structure again to convergence, from its estimates and from the given further starts.
pub(crate) fn refine<'a>(
    node: &Node<'a>,
    noise: &Noise,
    more: &[Vec<f64>],
) -> Result<Node<'a>, Error> {
    fitted(node, noise, FINE, more)
}

pub(crate) fn fitted<'a>(
    node: &Node<'a>,
    noise: &Noise,
    stopping: Stopping,
    more: &[Vec<f64>],
) -> Result<Node<'a>, Error> {
    let mut starts = vec![Start::at_end(&node.fit, noise)];
    starts.extend(more.iter().cloned().map(Start::from));
    let fit = fit_onward(&node.setup, starts, noise, stopping)?;
    Ok(Node {
        setup: node.setup.clone(),
        fit,
        added: node.added.clone(),
    })
}

/// The model without one of its effects, refitted from its estimates.
pub(crate) fn without<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &Noise,
    stopping: Stopping,
) -> Result<Node<'a>, Error> {
    let setup = node
        .setup
        .with_structure(node.setup.structure.without(node.added[position].effect))?;
    let start = transfer(node, &setup);
    let fit = match fit_from(&setup, &[start], noise, stopping) {
        // Some parameters are valid only together with the effect.
        Err(greybox::Error::Estimation(greybox::NoFit::NoFiniteStart { .. })) => {
            let others = random_starts(&setup, OTHER_STARTS, 1);
            fit_from(&setup, &others, noise, stopping)?
        }
        fit => fit?,
    };
    let mut added = node.added.clone();
    added.remove(position);
    Ok(Node { setup, fit, added })
}

/// The model without its functions of time, refitted from its estimates.
pub(crate) fn without_clock<'a>(node: &Node<'a>, noise: &Noise) -> Result<Node<'a>, Error> {
    let mut node = node.clone();
    while let Some(position) = node.added.iter().position(|placed| placed.effect.by_clock) {
        node = without(&node, position, noise, FINE)?;
    }
    Ok(node)
}

/// Sorted by the criterion.
pub(crate) fn best_first(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
    nodes
}

/// Values of series in the order of the outputs of records, without missing samples: record by record, in the order of time, each times the
/// weight of its output.
pub(crate) fn in_time(setup: &Setup, series: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let (outputs, mut all) = (setup.outputs(), Vec::with_capacity(setup.samples()));
    for (record, series) in setup.records.iter().zip(series.chunks_exact(outputs)) {
        for k in 0..record.len() {
            let at_once = record.outputs.iter().zip(series).zip(weights);
            let present = at_once.filter(|((output, _), _)| !output.values[k].is_nan());
            all.extend(present.map(|((_, series), weight)| weight * series[k]));
        }
    }
    all
}
