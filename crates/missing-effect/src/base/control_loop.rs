//! Linearisation of the fitted plant: its slowest time constant, and whether the loop in the model file is stable; an unstable loop cannot
//! have produced the record.

use ct_signals::Record;
use greybox::{LinearPlant, spectral_radius};
use nalgebra::DMatrix;
use plants::controller::Controller;

use crate::{Error, fit::node::Node};

/// A loop that grows by this number of factors e over the longest record cannot have produced it.
const GROWTH: f64 = 1.0;

/// Rejects a controller that makes the fitted plant unstable at its operating point.
///
/// The sampled loop is linearised; what an effect adds as memory (dead time, lags) is left out.
pub(crate) fn check_stable(node: &Node, controller: &Controller) -> Result<(), Error> {
    let setup = &node.setup;
    let plant = linearised(node)?;
    let radius = plant.radius_in_loop(controller, setup.structure.scales.sample_interval);
    let samples = setup.records.iter().map(Record::len).max().unwrap_or(0);
    if radius.ln() * samples as f64 > GROWTH {
        return Err(Error::UnstableLoop {
            controller: controller.describe(),
            radius,
        });
    }
    Ok(())
}

/// The slowest time constant of a fitted plant at its operating point \[s\]; infinite for an integrating plant.
///
/// What an effect adds as memory is left out.
pub(crate) fn slowest_time_constant(node: &Node) -> Result<f64, Error> {
    let a = linearised(node)?.a;
    let decay = -spectral_radius(&DMatrix::from_fn(a.len(), a.len(), |i, j| a[i][j])).ln();
    let interval = node.setup.structure.scales.sample_interval;
    Ok(if decay > 0.0 {
        interval / decay
    } else {
        f64::INFINITY
    })
}

/// The fastest time constant of a fitted plant at its operating point \[s\], at least a tenth of a sampling interval.
pub(crate) fn fastest_time_constant(node: &Node) -> Result<f64, Error> {
    let a = linearised(node)?.a;
    let a = DMatrix::from_fn(a.len(), a.len(), |i, j| a[i][j]);
    let least = a
        .complex_eigenvalues()
        .iter()
        .map(|value| value.norm())
        .fold(f64::INFINITY, f64::min);
    let interval = node.setup.structure.scales.sample_interval;
    let decay = -least.clamp(f64::MIN_POSITIVE, 1.0).ln();
    Ok(if decay > 0.0 {
        interval / decay.min(10.0)
    } else {
        f64::INFINITY
    })
}

/// The plant at its operating point.
fn linearised(node: &Node) -> Result<LinearPlant, Error> {
    let theta = &node.fit.x[..node.setup.parameter_count()];
    let structure = &node.setup.structure;
    Ok(LinearPlant::at(structure, theta, mean_command(node))?)
}

fn mean_command(node: &Node) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for u in node
        .setup
        .records
        .iter()
        .flat_map(|record| &record.inputs[0].values)
    {
        sum += u;
        count += 1.0;
    }
    sum / count
}
