//! The fitted plant linearised: its slowest time constant, and whether the loop that the model file describes can have
//! produced the record: an unstable one cannot.

use nalgebra::DMatrix;
use plants::{Command, Dual, MAX_VESSELS, Scalar, Simulator, controller::Pi};

use crate::{Error, search::Node};

/// A loop that grows e-fold so often over the longest record cannot have produced it.
const GROWTH: f64 = 1.0;

/// Refuses a controller that makes the fitted plant unstable at its operating point.
///
/// The sampled loop is linearised: levels over one sampling interval by duals, the command's effect by a central
/// difference, the integral exactly. What an effect adds as memory (dead time, lags) is left out.
pub(crate) fn check_stable(node: &Node, controller: &Pi) -> Result<(), Error> {
    let setup = &node.setup;
    let structure = &setup.structure;
    let n = structure.plant.vessels();
    let h = structure.scales.sample_interval;
    let theta = &node.fit.x[..setup.parameter_count()];
    let level = &structure.scales.operating_level[..n];
    let command = mean_command(node);
    let own = transition(node)?;
    let after = |u: f64| -> Result<[f64; MAX_VESSELS], Error> {
        let mut simulator = Simulator::new(structure, theta, level, u)?;
        simulator.advance(Command::held(u), h);
        Ok(simulator.levels())
    };
    let range = structure.scales.input_range;
    let step = 1e-4 * if range > 0.0 { range } else { 1.0 };
    let (more, less) = (after(command + step)?, after(command - step)?);

    // Levels, then the integral of the control error.
    let (gain, integral_time) = (controller.gain(), controller.integral_time());
    let mut a = DMatrix::<f64>::zeros(n + 1, n + 1);
    for i in 0..n {
        let by_command = (more[i] - less[i]) / (2.0 * step);
        for j in 0..n {
            a[(i, j)] = own[(i, j)];
        }
        a[(i, n - 1)] -= by_command * gain;
        a[(i, n)] = by_command * gain / integral_time;
    }
    a[(n, n - 1)] = -h;
    a[(n, n)] = 1.0;
    let radius = radius(&a);
    let samples = setup
        .records
        .iter()
        .map(|record| record.len())
        .max()
        .unwrap_or(0);
    if radius.ln() * samples as f64 > GROWTH {
        return Err(Error::UnstableLoop {
            gain,
            integral_time,
            radius,
        });
    }
    Ok(())
}

/// The slowest time constant of a fitted plant at its operating point \[s\]; infinite for one that integrates.
///
/// What an effect adds as memory is left out.
pub(crate) fn slowest_time_constant(node: &Node) -> Result<f64, Error> {
    let decay = -radius(&transition(node)?).ln();
    let interval = node.setup.structure.scales.sample_interval;
    Ok(if decay > 0.0 {
        interval / decay
    } else {
        f64::INFINITY
    })
}

/// What the levels at one sample do to those at the next, at the operating point.
fn transition(node: &Node) -> Result<DMatrix<f64>, Error> {
    let structure = &node.setup.structure;
    let n = structure.plant.vessels();
    let theta: Vec<_> = node.fit.x[..node.setup.parameter_count()]
        .iter()
        .map(|value| Dual::<MAX_VESSELS>::constant(*value))
        .collect();
    let level: Vec<_> = structure.scales.operating_level[..n]
        .iter()
        .enumerate()
        .map(|(i, value)| Dual::variable(*value, i))
        .collect();
    let command = mean_command(node);
    let mut simulator = Simulator::new(structure, &theta, &level, command)?;
    simulator.advance(Command::held(command), structure.scales.sample_interval);
    let next = simulator.levels();
    Ok(DMatrix::from_fn(n, n, |i, j| next[i].eps[j]))
}

fn mean_command(node: &Node) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for u in node
        .setup
        .records
        .iter()
        .flat_map(|record| &record.input.values)
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
