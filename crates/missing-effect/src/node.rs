//! A set of effects with its fit, and the fits of what it is changed to.

use ct_signals::ArModel;
use greybox::{Fit, Setup, Start, Stopping, fit_from, fit_onward};
use plants::{Outlet, ParameterInfo, Placed};

use crate::Error;

/// A first fit needs no more than this: its rank is sought, not its digits.
pub(crate) const ROUGH: Stopping = Stopping {
    evaluations: 20,
    cost: 1e-3,
};
/// Which of many are worth a first fit.
pub(crate) const QUICK: Stopping = Stopping {
    evaluations: 5,
    cost: 1e-3,
};
/// What a fit is taken to once its structure has a name.
pub(crate) const FINE: Stopping = Stopping {
    evaluations: 80,
    cost: 1e-8,
};
/// A level this many times the largest reading is not physical where the height of the tanks is not known, ...
const HIGHEST: f64 = 100.0;
/// ... and one this many times that height where it is: an area that is a little wrong shifts levels that nobody measures.
const ABOVE_RIM: f64 = 1.5;

/// A sensor at the end of its range: its reading is said to rise beyond from this correlation with the level on, over so many samples.
const LIMIT: &str = "sensor_saturation";
const RISES: f64 = 0.5;
const BEYOND: usize = 50;

/// What a valve does that sticks, and the width of its band, as a part of what the command moves over, below which a loop imitates it.
pub(crate) const STICTION: &str = "stiction_backlash";
const NARROW: f64 = 0.25;

/// What is nearer to a bound than this part of a range is at it.
const EDGE: f64 = 1e-6;

/// A structure with its fit.
#[derive(Debug, Clone)]
pub(crate) struct Node<'a> {
    pub setup: Setup<'a>,
    pub fit: Fit,
    /// What was added to the base, in order.
    pub added: Vec<Placed>,
}

impl Node<'_> {
    /// Fall of the criterion against another node in the same metric.
    pub fn gain_over(&self, other: &Node) -> f64 {
        other.fit.bic() - self.fit.bic()
    }

    /// The size of every added effect lies inside its plausible range, neither absent nor at the far end, and no level is beyond
    /// what is physical.
    pub fn plausible(&self) -> bool {
        !self.added.iter().any(|placed| self.at_the_edge(*placed))
            && self.physical()
            && !self.reads_beyond_limit()
    }

    /// No added effect is absent, and no level is beyond what is physical. While much is missing, a size may be driven to its far bound
    /// by what it stands in for beside itself.
    pub fn possible(&self) -> bool {
        let absent = |placed: &Placed| {
            self.size_of(*placed).is_some_and(|(size, at)| {
                (self.fit.x[at] - size.absent).abs() <= EDGE * (size.upper - size.lower)
            })
        };
        !self.added.iter().any(absent) && self.physical() && !self.reads_beyond_limit()
    }

    /// The reading still rises with the level where the model has it at the sensor's limit: then the limit is not the sensor's.
    fn reads_beyond_limit(&self) -> bool {
        let structure = &self.setup.structure;
        let Some(placed) = self.added.iter().find(|placed| placed.effect.id == LIMIT) else {
            return false;
        };
        let unlimited = || {
            let setup = self
                .setup
                .with_structure(structure.without(placed.effect))
                .ok()?;
            let level = setup.simulate(&transfer(self, &setup)).ok()?.output;
            let residual = self.setup.residuals(&self.fit.x).ok()?;
            let limit = self.fit.x[self.size_of(*placed)?.1];
            let beyond: Vec<(f64, f64)> = level
                .concat()
                .into_iter()
                .zip(residual.concat())
                .filter(|(level, _)| *level > limit)
                .collect();
            (beyond.len() >= BEYOND).then(|| correlation(&beyond))
        };
        unlimited().is_some_and(|correlation| correlation > RISES)
    }

    /// No level lies above the tank's rim where that is known, or so far above the readings that the model has lost its way.
    fn physical(&self) -> bool {
        let structure = &self.setup.structure;
        if structure.plant.outlet() != Outlet::Torricelli {
            return true;
        }
        let readings = self
            .setup
            .records
            .iter()
            .map(|record| record.output_range());
        let highest = readings.fold(0.0, |most: f64, (low, high)| {
            most.max(low.abs()).max(high.abs())
        });
        let most = structure
            .known
            .tank_height
            .map_or(HIGHEST * highest, |height| ABOVE_RIM * height.max(highest));
        self.setup.simulate(&self.fit.x).is_ok_and(|simulated| {
            let levels = &simulated.level[..structure.plant.vessels()];
            levels.iter().all(|(_, high)| *high <= most)
        })
    }

    /// The leading parameter of an added effect, its size, and where that stands in the vector.
    pub fn size_of(&self, placed: Placed) -> Option<(ParameterInfo, usize)> {
        let parameters = self.setup.structure.effect_parameters(placed);
        let leading = parameters.into_iter().next()?;
        let at = position_of(&self.setup, placed, leading.name)?;
        Some((leading, at))
    }

    /// The added stiction, where its band is narrower than [`NARROW`] of what the command moves over.
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

    /// The size of an added effect is absent or at the far end of its plausible range.
    pub fn at_the_edge(&self, placed: Placed) -> bool {
        let Some((leading, at)) = self.size_of(placed) else {
            return false;
        };
        let room = EDGE * (leading.upper - leading.lower);
        let size = self.fit.x[at];
        size <= leading.lower + room || size >= leading.upper - room
    }
}

/// Where a parameter of an effect stands in the vector.
pub(crate) fn position_of(setup: &Setup, placed: Placed, parameter: &str) -> Option<usize> {
    let name = format!("{}.{parameter}", placed.effect.id);
    setup.names().iter().position(|known| *known == name)
}

/// The parent's vector in the child's order; what the parent does not have is zero.
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

/// Fits a node's structure anew to the end, from where it is and from the given further starts.
pub(crate) fn refine<'a>(
    node: &Node<'a>,
    noise: &ArModel,
    more: &[Vec<f64>],
) -> Result<Node<'a>, Error> {
    fitted(node, noise, FINE, more)
}

pub(crate) fn fitted<'a>(
    node: &Node<'a>,
    noise: &ArModel,
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

/// The node without one of its effects, refitted from where it was.
pub(crate) fn without<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &ArModel,
) -> Result<Node<'a>, Error> {
    lacking(node, position, noise, FINE)
}

/// The same, to be extended.
pub(crate) fn roughly_without<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &ArModel,
) -> Result<Node<'a>, Error> {
    lacking(node, position, noise, ROUGH)
}

fn lacking<'a>(
    node: &Node<'a>,
    position: usize,
    noise: &ArModel,
    stopping: Stopping,
) -> Result<Node<'a>, Error> {
    let setup = node
        .setup
        .with_structure(node.setup.structure.without(node.added[position].effect))?;
    let start = transfer(node, &setup);
    let fit = fit_from(&setup, &[start], noise, stopping)?;
    let mut added = node.added.clone();
    added.remove(position);
    Ok(Node { setup, fit, added })
}

/// The node without its effects that follow the clock alone, refitted from where it was.
pub(crate) fn without_clock<'a>(node: &Node<'a>, noise: &ArModel) -> Result<Node<'a>, Error> {
    let mut node = node.clone();
    while let Some(position) = node.added.iter().position(|placed| placed.effect.by_clock) {
        node = without(&node, position, noise)?;
    }
    Ok(node)
}

/// By the criterion.
pub(crate) fn best_first(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
    nodes
}

fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (a, b) = pairs
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xx += (x - a) * (x - a);
        yy += (y - b) * (y - b);
        xy += (x - a) * (y - b);
    }
    xy / (xx * yy).sqrt().max(f64::MIN_POSITIVE)
}
