//! Starts from all over the plausible region.
//!
//! What a tank's record fixes well is its throughput in the mean; what it may be anything of is its time constants.
//! So time constants are drawn evenly on a logarithmic scale between the sampling interval and the record's length,
//! in either order for two tanks (which fit almost as well with their time constants swapped), and the rest of the
//! parameters follows from the mean of the record.

use plants::{Outlet, Plant};
use rand::RngExt;

use crate::{Setup, levenberg_marquardt::within};

/// One start for the plant's own parameters and the initial levels; effects start at their first start value.
#[must_use]
pub fn random_starts(setup: &Setup, n: usize, seed: u64) -> Vec<Vec<f64>> {
    use rand::SeedableRng;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let scales = &setup.structure.scales;
    let (shortest, longest) = (2.0 * scales.sample_interval, 0.5 * scales.duration);
    (0..n)
        .map(|_| {
            let mut tau = || shortest * (longest / shortest).powf(rng.random::<f64>());
            start(setup, [tau(), tau()])
        })
        .collect()
}

fn start(setup: &Setup, tau: [f64; 2]) -> Vec<f64> {
    let structure = &setup.structure;
    let scales = &structure.scales;
    let (mut u, mut y, mut uu, mut uy, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for record in setup.records {
        for (a, b) in record.input.values.iter().zip(&record.output.values) {
            u += a;
            y += b;
            uu += a * a;
            uy += a * b;
            count += 1.0;
        }
    }
    let (u, y) = (u / count, y / count);
    // A level cannot be negative where a square root is taken of it.
    let mean = if structure.plant.outlet() == Outlet::Torricelli {
        y.max(1e-3 * scales.largest_level())
    } else {
        y
    };
    // A mean of next to nothing says nothing.
    let largest = scales.input.0.abs().max(scales.input.1.abs());
    let driven = u.abs() > 1e-6 * largest;
    let drive = match (driven, largest > 0.0) {
        (true, _) => u,
        (false, true) => largest,
        (false, false) => 1.0,
    };
    // The static gain's sign and rough size, from the correlation of command and level.
    let slope = {
        let (variance, covariance) = (uu / count - u * u, uy / count - u * y);
        let (low, high) = scales.level[structure.plant.vessels() - 1];
        let span = scales.input.1 - scales.input.0;
        let size = if span > 0.0 { (high - low) / span } else { 0.0 };
        if variance > 0.0 && covariance < 0.0 {
            -size
        } else {
            size
        }
    };
    // Torricelli: tau = 2 S sqrt(H)/alpha, throughput = alpha sqrt(H).
    let flow = |area: f64| 2.0 * area * mean / tau[1];
    let mut x = match structure.plant {
        Plant::SingleTank => {
            let q = flow(scales.area[0]);
            vec![q / drive, q / mean.sqrt()]
        }
        Plant::CascadedTanks => {
            let q = flow(scales.area[1]);
            let upper = q * tau[0] / (2.0 * scales.area[0]);
            vec![q / drive, q / upper.sqrt(), q / mean.sqrt()]
        }
        Plant::SingleTankLinear => vec![slope, tau[1], y - slope * u],
        Plant::CascadedTanksLinear => vec![slope, tau[0], tau[1], y - slope * u],
        Plant::FirstOrder => vec![if driven { y / u } else { slope }, tau[1]],
    };
    let added = structure.parameters().split_off(x.len());
    x.extend(
        added
            .iter()
            .map(|p| p.starts.first().copied().unwrap_or(p.lower)),
    );
    extend_levels(setup, &mut x);
    x
}

/// Appends initial states: the measured level from the first reading, the upper one and lags at rest under the first
/// command, the controller's as they give the measured command.
pub(crate) fn extend_levels(setup: &Setup, x: &mut Vec<f64>) {
    for (r, record) in setup.records.iter().enumerate() {
        let (u0, y0) = (record.input.values[0], record.output.values[0]);
        match setup.structure.plant {
            Plant::CascadedTanks => x.push((x[0] * u0 / x[1]).powi(2)),
            Plant::CascadedTanksLinear => x.push(x[0] * u0),
            _ => {}
        }
        x.push(y0);
        x.extend(setup.structure.lags().iter().map(|_| 0.0));
        x.extend(setup.controller_states(r));
    }
}

/// Starts around a vector: the plant's own parameters and the initial levels are scaled by up to a factor of 1.2 either
/// way, an effect's parameters move by up to a tenth of their plausible range. What is not fitted stays.
#[must_use]
pub fn starts_around(setup: &Setup, x: &[f64], n: usize, seed: u64) -> Vec<Vec<f64>> {
    use rand::SeedableRng;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let own = setup
        .structure
        .plant
        .parameters(&setup.structure.scales)
        .len();
    let count = setup.parameter_count();
    (0..n)
        .map(|_| {
            x.iter()
                .zip(setup.bounds())
                .enumerate()
                .map(|(i, (value, &(lower, upper)))| {
                    let moved = if i < own || i >= count {
                        value * 1.2_f64.powf(rng.random_range(-1.0..1.0))
                    } else {
                        value + 0.1 * (upper - lower) * rng.random_range(-1.0..1.0)
                    };
                    if setup.free().contains(&i) {
                        within(moved, (lower, upper))
                    } else {
                        *value
                    }
                })
                .collect()
        })
        .collect()
}
