//! Starts over the whole plausible region.
//!
//! What a tank's record fixes well is its throughput in the mean; what it may be anything of is its time constants.
//! So time constants are drawn evenly on a logarithmic scale between the sampling interval and the record's length,
//! in either order for two tanks (which fit almost as well with their time constants swapped), and the rest of the
//! parameters follows from the mean of the record. The gain of a measured disturbance, of either sign, starts at zero.

use ct_signals::{Channel, Record};
use plants::{Outlet, Plant};
use rand::RngExt;

use estimation::within;

use crate::{Setup, at_rest};

/// One start for the plant's own parameters and the initial levels; effects use their first start value.
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
            // Head differences of coupled tanks, as shares of the measured level: not all of them are measured.
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
    // The output furthest downstream, whatever its position among the outputs.
    let last = scales.lowest_output();
    let read = scales.outputs[last].vessel;
    let (mut u, mut y, mut uu, mut uy, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for record in setup.records {
        for (a, b) in record.inputs[0]
            .values
            .iter()
            .zip(&record.outputs[last].values)
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
    // A mean near zero contains no information.
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
        let (low, high) = scales.level[read];
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
            let upper = mean_level(setup, 0).unwrap_or(q * tau[0] / (2.0 * scales.area[0]));
            vec![q / drive, q / upper.sqrt(), q / mean.sqrt()]
        }
        Plant::SingleTankLinear => vec![slope, tau[1], y - slope * u],
        Plant::CascadedTanksLinear => vec![slope, tau[0], tau[1], y - slope * u],
        Plant::FirstOrder => vec![if driven { y / u } else { slope }, tau[1]],
        Plant::ThreeTank => joined_tanks(setup, (read, mean), flow(scales.area[read]), heads),
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

/// Pumps, valves and outlet of joined tanks at rest, a measured level at its mean, with a throughput; `heads`: of the valves, as shares of
/// that level.
fn joined_tanks(setup: &Setup, (read, mean): (usize, f64), flow: f64, heads: [f64; 2]) -> Vec<f64> {
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
    // The flow through the valves comes from the first pump; if that pump is nearly off, any flow is as good a guess.
    let through = (gain * u).max(0.1 * flow);
    let [d13, d32] = heads.map(|share| share * mean);
    // Levels in the row, T1, T3, T2, from the measured one.
    let outlet = match read {
        0 => mean - d13 - d32,
        1 => mean - d32,
        _ => mean,
    };
    let outlet = outlet.max(0.05 * mean);
    // Two measured levels determine the head between them.
    let known = [0, 1, 2].map(|vessel| mean_level(setup, vessel));
    let between = |a: usize, b: usize| Some((known[a]? - known[b]?).abs());
    let least = 1e-3 * mean;
    let d13 = between(0, 1).map_or(d13, |head| head.max(least));
    let d32 = between(1, 2).map_or(d32, |head| head.max(least));
    let outlet = known[2].map_or(outlet, |level| level.max(least));
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

/// The equilibrium levels of joined tanks under their first commands, except for the measured one, which is read.
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
    // Levels that are not measured start at the lowest measured one, as at rest.
    let read = scales.outputs[scales.lowest_output()].vessel;
    let shift = first_reading(setup, record, read).unwrap_or(0.0) - levels[read];
    for (vessel, level) in levels.iter_mut().enumerate() {
        let at_rest = (*level + shift).max(0.0);
        *level = first_reading(setup, record, vessel).unwrap_or(at_rest);
    }
    levels.to_vec()
}

/// The output that reads the level of a vessel, if there is one.
fn output_of(setup: &Setup, vessel: usize) -> Option<usize> {
    let mut outputs = setup.structure.scales.outputs.iter();
    outputs.position(|output| output.vessel == vessel)
}

/// The first reading of a vessel's level; `None` if it is not measured, or has no sample.
fn first_reading(setup: &Setup, record: &Record, vessel: usize) -> Option<f64> {
    let output = &record.outputs[output_of(setup, vessel)?];
    output.present().next()
}

/// The mean reading of a vessel's level, if it is above zero; `None` if it is not measured.
fn mean_level(setup: &Setup, vessel: usize) -> Option<f64> {
    let output = output_of(setup, vessel)?;
    let outputs = setup.records.iter().map(|record| &record.outputs[output]);
    let (sum, count) = outputs
        .flat_map(Channel::present)
        .fold((0.0, 0.0), |(sum, count), y| (sum + y, count + 1.0));
    Some(sum / count).filter(|mean| *mean > 0.0)
}

/// The initial states of the records of a setup from their first readings, for these parameters: levels that are not measured, and lags,
/// are at rest under the first command.
#[must_use]
pub fn levels_from_readings(setup: &Setup, parameters: &[f64]) -> Vec<f64> {
    let mut x = parameters.to_vec();
    extend_levels(setup, &mut x);
    x.split_off(parameters.len())
}

/// Appends initial states: a measured level from its first reading, an upper level that is not measured and lags at rest under the first
/// command, and the controller's from the measured command.
pub(crate) fn extend_levels(setup: &Setup, x: &mut Vec<f64>) {
    for (r, record) in setup.records.iter().enumerate() {
        let structure = &setup.structure;
        let [u0, d0] = at_rest(record);
        let mut inflow = x[0] * u0;
        if structure.known.disturbed_vessel(structure.plant) == Some(0)
            && structure.scales.input_2.is_some()
        {
            let own = structure.plant.parameters(&structure.scales).len();
            inflow = (inflow + x[own - 1] * d0).max(0.0);
        }
        let at_rest = match structure.plant {
            Plant::CascadedTanks => Some((inflow / x[1]).powi(2)),
            Plant::CascadedTanksLinear => Some(inflow),
            _ => None,
        };
        x.extend(at_rest.map(|level| first_reading(setup, record, 0).unwrap_or(level)));
        if setup.structure.plant.joined() {
            let levels = joined_levels(setup, x, record);
            x.extend(levels);
        } else {
            let last = setup.structure.plant.vessels() - 1;
            x.push(first_reading(setup, record, last).unwrap_or(0.0));
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
