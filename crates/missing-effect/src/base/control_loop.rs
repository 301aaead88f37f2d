//! Linearisation of the fitted plant: its slowest time constant, and whether the loop in the model file is stable; an unstable loop cannot
//! have produced the record.

use greybox::LinearPlant;
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
    let read = plant.outputs[controller.output()];
    let own = controller.linear(setup.structure.scales.sample_interval);
    let (n, m) = (plant.b.len(), own.b.len());
    // Levels x, then the controller's states z: e = -x_measured, u = c z + d e.
    let mut a = DMatrix::<f64>::zeros(n + m, n + m);
    for i in 0..n {
        for j in 0..n {
            a[(i, j)] = plant.a[i][j];
        }
        a[(i, read)] -= plant.b[i] * own.d;
        for j in 0..m {
            a[(i, n + j)] = plant.b[i] * own.c[j];
        }
    }
    for i in 0..m {
        // A constant for an operating point is not a part of the loop.
        let constant = own.b[i] == 0.0 && (0..m).all(|j| own.a[i][j] == f64::from(i == j));
        for j in 0..m {
            a[(n + i, n + j)] = if constant { 0.0 } else { own.a[i][j] };
        }
        a[(n + i, read)] = -own.b[i];
    }
    let radius = radius(&a);
    let samples = setup
        .records
        .iter()
        .map(|record| record.len())
        .max()
        .unwrap_or(0);
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
    let decay = -radius(&DMatrix::from_fn(a.len(), a.len(), |i, j| a[i][j])).ln();
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

/// Largest magnitude of the eigenvalues.
fn radius(a: &DMatrix<f64>) -> f64 {
    a.complex_eigenvalues()
        .iter()
        .map(|value| value.norm())
        .fold(0.0, f64::max)
}
