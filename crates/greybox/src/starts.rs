//! Starts from all over the plausible region.
//!
//! What a tank's record fixes well is its throughput in the mean; what it may be anything of is its time constants.
//! So time constants are drawn evenly on a logarithmic scale between the sampling interval and the record's length,
//! in either order for two tanks (which fit almost as well with their time constants swapped), and the rest of the
//! parameters follows from the mean of the record.

use ct_signals::{Channel, Record};
use plants::{Outlet, Plant};
use rand::RngExt;

use crate::{Setup, at_rest, levenberg_marquardt::within};

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
            let tau = [tau(), tau()];
            // Heads of tanks that are joined, as shares of the measured level: nobody reads them all.
            let mut head = || 0.05_f64 * 40.0_f64.powf(rng.random::<f64>());
            let heads = if setup.structure.plant.joined() {
                [head(), head()]
            } else {
                [1.0; 2]
            };
            start(setup, tau, heads)
        })
        .collect()
}

fn start(setup: &Setup, tau: [f64; 2], heads: [f64; 2]) -> Vec<f64> {
    let structure = &setup.structure;
    let scales = &structure.scales;
    let (mut u, mut y, mut uu, mut uy, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for record in setup.records {
        for (a, b) in record.inputs[0]
            .values
            .iter()
            .zip(&record.outputs[0].values)
            .filter(|(_, reading)| !reading.is_nan())
        {
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
        let (low, high) = scales.level[scales.measured];
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
        Plant::ThreeTank => joined_tanks(setup, mean, flow(scales.area[scales.measured]), heads),
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

/// Pumps, valves and outlet of joined tanks that rest, the measured one at its mean level, with a throughput; `heads`: of the valves,
/// as shares of that level.
fn joined_tanks(setup: &Setup, mean: f64, flow: f64, heads: [f64; 2]) -> Vec<f64> {
    let scales = &setup.structure.scales;
    let second = scales.input_2.is_some();
    let middle = |signal: fn(&Record) -> Option<&Channel>| {
        let values = || {
            let signals = setup.records.iter().filter_map(signal);
            signals.flat_map(|signal| &signal.values)
        };
        values().map(|u| u.abs()).sum::<f64>() / values().count().max(1) as f64
    };
    let u = middle(|record| Some(&record.inputs[0]));
    let all = u + middle(|record| record.inputs.get(1));
    let gain = if all > 0.0 { flow / all } else { flow };
    // What goes through the valves comes from the first pump; where that hardly runs, any flow says as much.
    let through = (gain * u).max(0.1 * flow);
    let [d13, d32] = heads.map(|share| share * mean);
    // Levels in the row, T1, T3, T2, from the measured one.
    let outlet = match scales.measured {
        0 => mean - d13 - d32,
        1 => mean - d32,
        _ => mean,
    };
    let outlet = outlet.max(0.05 * mean);
    let orifice = scales.orifice.unwrap_or(1.0);
    let valve = |flow: f64, head: f64| flow / (orifice * head.sqrt());
    let mut x = vec![gain];
    if second {
        x.push(gain);
    }
    x.extend([
        valve(through, d13),
        valve(through, d32),
        valve(flow, outlet),
    ]);
    x
}

/// The levels at which joined tanks would rest under their first commands, but for the measured one, which is read.
fn joined_levels(setup: &Setup, x: &[f64], record: &Record) -> Vec<f64> {
    let scales = &setup.structure.scales;
    let orifice = scales.orifice.unwrap_or(1.0);
    let [u, u2] = at_rest(record);
    let pumps = if scales.input_2.is_some() { 2 } else { 1 };
    let first = x[0] * u;
    let all = first + if pumps > 1 { x[1] * u2 } else { 0.0 };
    let head = |flow: f64, az: f64| {
        let root = flow / (az * orifice);
        root * root.abs()
    };
    let h2 = head(all.max(0.0), x[pumps + 2]);
    let h3 = h2 + head(first, x[pumps + 1]);
    let mut levels = [h3 + head(first, x[pumps]), h3, h2];
    // They stand about the measured one as they would at rest.
    let shift = first_reading(record) - levels[scales.measured];
    for level in &mut levels {
        *level = (*level + shift).max(0.0);
    }
    levels[scales.measured] = first_reading(record);
    levels.to_vec()
}

/// The first reading that is there; zero of a record that has none.
fn first_reading(record: &Record) -> f64 {
    record.outputs[0].present().next().unwrap_or(0.0)
}

/// Appends initial states: the measured level from the first reading, the upper one and lags at rest under the first
/// command, the controller's as they give the measured command.
pub(crate) fn extend_levels(setup: &Setup, x: &mut Vec<f64>) {
    for (r, record) in setup.records.iter().enumerate() {
        let (u0, y0) = (record.inputs[0].values[0], first_reading(record));
        match setup.structure.plant {
            Plant::CascadedTanks => x.push((x[0] * u0 / x[1]).powi(2)),
            Plant::CascadedTanksLinear => x.push(x[0] * u0),
            _ => {}
        }
        if setup.structure.plant.joined() {
            let levels = joined_levels(setup, x, record);
            x.extend(levels);
        } else {
            x.push(y0);
        }
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
