//! Starts of a fit with one more effect: the grid of the effect's starts, combined with other values of the plant if these matter.

use greybox::{Setup, with_other_speeds};
use plants::{Place, Placed, Plant, Unit};

use super::node::{Node, position_of, transfer};

/// Effects that the believed model of two tanks compensates for by too large a flow: coupled tanks, and additional outflow from the upper
/// tank.
const COUPLED: &str = "coupled_tank";
const LEAVES: [&str; 2] = ["overflow", "leak_at_height"];

/// Starts of an extended model: the vector of the model, with the new effect's parameters on the grid of its starts.
///
/// Parameters that the plant alone does not distinguish lie in one order or the other by chance. An effect in a vessel distinguishes them,
/// and from the wrong order no fit comes to the right one.
pub(crate) fn grid(from: &Node, child: &Setup, placed: Placed) -> Vec<Vec<f64>> {
    let mut begun = vec![transfer(from, child)];
    let less = with_less_throughput(&begun[0], child, placed);
    let structure = &child.structure;
    let pair = structure.plant.interchangeable(&structure.known);
    if let Some(pair) = pair.filter(|_| placed.effect.place == Place::Vessel) {
        let free = |name| {
            let at = child.names().iter().position(|known| known == name)?;
            child.free().contains(&at).then_some(at)
        };
        if let [Some(a), Some(b)] = pair.map(free) {
            let mut exchanged = begun[0].clone();
            exchanged.swap(a, b);
            begun.push(exchanged);
        }
    }

    begun.extend(with_other_speeds(child, placed, &begun[0]));
    let begun: Vec<(Vec<f64>, f64)> = begun.into_iter().map(|x| (x, 1.0)).chain(less).collect();

    let parameters = child.structure.effect_parameters(placed);
    let mut combinations: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in &parameters {
        combinations = combinations
            .iter()
            .flat_map(|begun| {
                parameter.starts.iter().map(|start| {
                    let mut longer = begun.clone();
                    longer.push(*start);
                    longer
                })
            })
            .collect();
    }
    combinations
        .into_iter()
        .flat_map(|values| begun.iter().map(move |x| (x.clone(), values.clone())))
        .map(|((mut x, levels), values)| {
            for (parameter, value) in parameters.iter().zip(values) {
                if let Some(at) = position_of(child, placed, parameter.name) {
                    let level = parameter.unit == Unit::LEVEL;
                    x[at] = if level { levels * value } else { value };
                }
            }
            x
        })
        .collect()
}

/// Fractions of the throughput, because a fit may have overestimated it several times.
const LESS_THROUGHPUT: [f64; 2] = [0.4, 0.2];

/// Two tanks with a fraction of their throughput, and the factor of the upper tank's levels: the lower level does not change, the upper
/// level falls accordingly.
///
/// Two tanks that push on each other have time constants far apart, and a tank that runs over passes on less the fuller it is. The model
/// without these imitates that by a high upper tank above a quick lower one, with several times the throughput, and from there a fit ends
/// at another minimum.
fn with_less_throughput(x: &[f64], child: &Setup, placed: Placed) -> Vec<(Vec<f64>, f64)> {
    let plant = child.structure.plant;
    let upper = placed.vessel == 0 && LEAVES.contains(&placed.effect.id);
    let imitated = plant == Plant::CascadedTanks && (placed.effect.id == COUPLED || upper);
    let at = |name| child.names().iter().position(|known| known == name);
    let (Some(gain), Some(lower)) = (at("pump_gain"), at("alpha_lower")) else {
        return Vec::new();
    };
    if !imitated || [gain, lower].iter().any(|at| !child.free().contains(at)) {
        return Vec::new();
    }
    let less = |part: f64| {
        let mut x = x.to_vec();
        x[gain] *= part;
        x[lower] *= part;
        for record in 0..child.records.len() {
            x[child.plant_states_of(record).start] *= part.powi(2);
        }
        (x, part.powi(2))
    };
    LESS_THROUGHPUT.map(less).to_vec()
}
