//! Rigs drawn at random, and effects in them whose size is set by what the believed model cannot follow.

mod path;

use std::{collections::BTreeMap, ops::RangeInclusive};

use ct_signals::{Channel, Record};
use greybox::{Fit, Setup, Stopping, fit_from, random_starts, weighted_rms};
use plants::{EffectInfo, Known, ParameterInfo, Placed, Plant};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use self::path::Path;
use crate::{Drive, Rig};

/// The plants that are drawn from.
pub const PLANTS: [Plant; 4] = [
    Plant::SingleTank,
    Plant::SingleTankLinear,
    Plant::CascadedTanks,
    Plant::CascadedTanksLinear,
];

/// Plants with two tanks, whose levels may both be measured.
pub const TWO_TANKS: [Plant; 2] = [Plant::CascadedTanks, Plant::CascadedTanksLinear];

/// Which levels are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Levels {
    /// The last one, of any plant.
    Last,
    /// Both, of two tanks.
    Both,
}

impl Levels {
    /// The plants that are drawn from.
    #[must_use]
    pub fn plants(self) -> &'static [Plant] {
        match self {
            Self::Last => &PLANTS,
            Self::Both => &TWO_TANKS,
        }
    }

    /// The rig with these levels measured.
    #[must_use]
    pub fn of(self, rig: Rig) -> Rig {
        match self {
            Self::Last => rig,
            Self::Both => Rig {
                measured: vec![0, 1],
                ..rig
            },
        }
    }
}

/// The command about which the rigs work \[V\].
const MIDDLE: f64 = 5.0;
/// The ratio is met within this part.
const MET: f64 = 0.03;
/// Number of drawn rigs before an effect counts as undetectable.
const DRAWS: usize = 12;
/// Starts with which the minimum is checked at the end.
const MORE: usize = 6;
const STOPPING: Stopping = Stopping {
    evaluations: 60,
    cost: 1e-9,
};

fn between(rng: &mut ChaCha8Rng, range: RangeInclusive<f64>) -> f64 {
    rng.random_range(range)
}

fn by_factor(rng: &mut ChaCha8Rng, range: RangeInclusive<f64>) -> f64 {
    between(rng, range.start().ln()..=range.end().ln()).exp()
}

/// A rig with levels of 12 to 20 cm, time constants of 60 to 240 s, of two tanks the upper one's 0.2 to 1.2 times the
/// lower one's; 20 to 60 samples in a time constant, steps of 0.3 to 1.5 of it; noise of 0.02 to 0.1 cm.
#[must_use]
pub fn rig(plant: Plant, drive: Drive, colour: f64, samples: usize, rng: &mut ChaCha8Rng) -> Rig {
    let level = between(rng, 12.0..=20.0);
    let lower = by_factor(rng, 60.0..=240.0);
    let upper = lower * by_factor(rng, 0.2..=1.2);
    let fineness = by_factor(rng, 20.0..=60.0);
    let swing = between(rng, 1.0..=2.0);
    let two = plant.vessels() > 1;
    let area: f64 = 154.0;
    // Torricelli: tau = 2 S H/Q.
    let flow = 2.0 * area * level / lower;
    let above = level * upper / lower;
    let (gain, alpha) = (flow / MIDDLE, |level: f64| flow / level.sqrt());
    let slope = between(rng, 2.0..=6.0);
    let offset = level - slope * MIDDLE;
    let (theta, levels) = match plant {
        Plant::CascadedTanks => (vec![gain, alpha(above), alpha(level)], vec![above, level]),
        Plant::SingleTankLinear => (vec![slope, lower, offset], vec![level]),
        Plant::CascadedTanksLinear => (
            vec![slope, upper, lower, offset],
            vec![slope * MIDDLE, level],
        ),
        _ => (vec![gain, alpha(level)], vec![level]),
    };
    let rise = match plant.outlet() {
        plants::Outlet::Torricelli => 2.0 * level / MIDDLE,
        plants::Outlet::Linear => slope,
    };
    let feedback = by_factor(rng, 0.8..=2.5) * if two { 0.5 } else { 1.0 };
    let slowest = if two { lower + upper } else { lower };
    let steps = |part: f64| ((part * fineness).round() as usize).max(2);
    Rig {
        plant,
        theta,
        levels,
        command: (MIDDLE - swing, MIDDLE + swing),
        noise: by_factor(rng, 0.02..=0.1),
        colour,
        drive,
        hold: (steps(0.3), steps(1.5)),
        pi: (feedback / rise, slowest * between(rng, 0.7..=1.2)),
        samples,
        interval: lower / fineness,
        ..Rig::single_tank()
    }
}

/// A rig with an effect whose structural error is `ratio` times the noise: the root mean square of what the believed model,
/// refitted to the record without noise, cannot follow.
///
/// The plant is drawn from those in which the effect may act, and the vessel from those of the plant. What is beside the size
/// (a height, a time, a time constant, a phase) is drawn from the range that the catalogue's starts cover. The
/// size goes from absent to the end of its plausible range until the ratio is met. One with which the level leaves 0.1 to 3 times the
/// level at rest is too large. Where the ratio is not met, another rig is drawn; `None` where none of twelve would do.
///
/// Coarse quantisation is a converter after the noise of the last output, as real ones are: its structural error is that of rounding, the
/// step over the square root of 12. Where several levels are measured the error is the root mean square over all of them.
#[must_use]
pub fn with_effect(
    effect: &'static EffectInfo,
    levels: Levels,
    ratio: f64,
    drive: Drive,
    colour: f64,
    samples: usize,
    seed: u64,
) -> Option<Rig> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sites = |plant: Plant| -> Vec<usize> {
        let known = Known {
            measured: levels.of(Rig::cascaded_tanks()).measured,
            ..Known::default()
        };
        effect.sites(plant, &known).collect()
    };
    let plants = levels.plants().iter().copied();
    let plants: Vec<Plant> = plants.filter(|plant| !sites(*plant).is_empty()).collect();
    if plants.is_empty() {
        return None;
    }
    (0..DRAWS).find_map(|_| {
        let plant = plants[rng.random_range(0..plants.len())];
        let vessels = sites(plant);
        let vessel = vessels[rng.random_range(0..vessels.len())];
        let rig = levels.of(rig(plant, drive, colour, samples, &mut rng));
        let placed = Placed { effect, vessel };
        built(rig, placed, ratio, seed, &mut rng)
    })
}

/// Effects that data of this kind can hardly split.
const FAMILIES: [&[&str]; 3] = [
    &["pump_lag", "sensor_lag", "transport_delay"],
    &["sensor_drift", "valve_drift", "pump_gain_drift"],
    &[
        "const_leak",
        "pipe_height",
        "laminar_outflow",
        "pump_deadzone",
        "pump_nonlinearity",
        "sensor_offset",
    ],
];

/// Two effects may make a pair: they act at different places of the chain, are not of one family that data can hardly split, and
/// at most one of them follows the clock.
#[must_use]
pub fn may_pair(one: &EffectInfo, other: &EffectInfo) -> bool {
    let both = |family: &&[&str]| family.contains(&one.id) && family.contains(&other.id);
    one.place != other.place && !(one.by_clock && other.by_clock) && !FAMILIES.iter().any(both)
}

/// A rig with two effects drawn from those that [`may_pair`], the structural error of each alone `ratio` times the noise; the rest
/// as [`with_effect`].
#[must_use]
pub fn with_pair(ratio: f64, drive: Drive, colour: f64, samples: usize, seed: u64) -> Option<Rig> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..2 * DRAWS).find_map(|_| {
        let plant = PLANTS[rng.random_range(0..PLANTS.len())];
        let rig = rig(plant, drive, colour, samples, &mut rng);
        let (one, other) = pair(plant, &mut rng);
        let mut alone = |effect: &'static EffectInfo| {
            let vessels: Vec<usize> = effect.sites(plant, &Known::default()).collect();
            let vessel = vessels[rng.random_range(0..vessels.len())];
            let placed = Placed { effect, vessel };
            built(rig.clone(), placed, ratio, seed, &mut rng)
        };
        let (one, other) = (alone(one)?, alone(other)?);
        let both = Rig {
            hidden: [one.hidden, other.hidden].concat(),
            converter: one.converter.max(other.converter),
            ..rig
        };
        misfit(&both, seed, None, 0).map(|_| both)
    })
}

fn pair(plant: Plant, rng: &mut ChaCha8Rng) -> (&'static EffectInfo, &'static EffectInfo) {
    let effects: Vec<&'static EffectInfo> = plants::CATALOGUE
        .iter()
        .copied()
        .filter(|effect| effect.sites(plant, &Known::default()).next().is_some())
        .collect();
    let mut one = || effects[rng.random_range(0..effects.len())];
    loop {
        let (a, b) = (one(), one());
        if may_pair(a, b) {
            return (a, b);
        }
    }
}

/// A rig whose converter rounds the noisy reading.
fn rounded(rig: Rig, ratio: f64, seed: u64) -> Option<Rig> {
    let converter = 12.0_f64.sqrt() * ratio * rig.noise;
    // The largest quantisation step of the catalogue is half of the level's range.
    let (low, high) = without_noise(&rig, seed).outputs[rig.outputs() - 1].range();
    (converter <= 0.5 * (high - low)).then_some(Rig { converter, ..rig })
}

fn built(rig: Rig, placed: Placed, ratio: f64, seed: u64, rng: &mut ChaCha8Rng) -> Option<Rig> {
    if placed.effect.id == "coarse_quantisation" {
        return rounded(rig, ratio, seed);
    }
    let path = Path::draw(&rig, placed, seed, rng)?;
    // The minimum from which the next size's is sought; at the end others are looked for.
    let mut near: Option<Vec<f64>> = None;
    for _ in 0..2 {
        // A rig with levels out of range has too large an effect.
        let mut at = |size: f64| {
            let with = path.at(&rig, size);
            let fit = misfit(&with, seed, near.as_deref(), 0);
            let reached = fit.as_ref().map_or(f64::INFINITY, |fit| error(&rig, fit));
            near = fit.map(|fit| fit.x).or_else(|| near.take());
            (with, reached)
        };
        // Outwards until the ratio lies between two sizes, then along the line through their logarithms.
        let mut below: Option<(f64, f64)> = None;
        let mut size = 1.0 / 1024.0;
        let mut found = at(size);
        while found.1 < ratio {
            if size >= 1.0 {
                return None;
            }
            below = Some((size, found.1));
            size = (2.0 * size).min(1.0);
            found = at(size);
        }
        let mut above = (size, found.1);
        for step in 0..20 {
            if (found.1 / ratio - 1.0).abs() < MET {
                break;
            }
            size = match below {
                // A threshold may leave nothing on one side: every other step halves the way.
                Some(below) if step % 2 == 0 && below.1 > 0.0 => {
                    let part = (ratio / below.1).ln() / (above.1 / below.1).ln();
                    below.0 * (above.0 / below.0).powf(part.clamp(0.02, 0.98))
                }
                Some(below) => (below.0 * above.0).sqrt(),
                None => 0.25 * above.0,
            };
            found = at(size);
            if found.1 < ratio {
                below = Some((size, found.1));
            } else {
                above = (size, found.1);
            }
        }
        let (with, _) = found;
        let best = misfit(&with, seed, near.as_deref(), MORE)?;
        let reached = error(&rig, &best);
        if (reached / ratio - 1.0).abs() < 2.0 * MET {
            return Some(with);
        }
        near = Some(best.x);
    }
    None
}

/// The record without noise.
#[must_use]
pub fn without_noise(rig: &Rig, seed: u64) -> Record {
    let silent = Rig {
        noise: 0.0,
        walk: 0.0,
        ..rig.clone()
    };
    silent.run(&mut ChaCha8Rng::seed_from_u64(seed))
}

/// The model without the effect, fitted to the record without noise; `None` if a level leaves its range.
fn misfit(rig: &Rig, seed: u64, near: Option<&[f64]>, more: usize) -> Option<Fit> {
    let records = [without_noise(rig, seed)];
    let read = rig.known().outputs(rig.plant);
    let sound = |(output, vessel): (&Channel, &usize)| {
        let level = rig.levels[*vessel];
        let within = |y: &f64| y.is_finite() && (0.1 * level..3.0 * level).contains(y);
        output.values.iter().all(within)
    };
    if !records[0].outputs.iter().zip(&read).all(sound) {
        return None;
    }
    let mut setup =
        Setup::from_records(rig.plant, rig.known(), &[], &records, BTreeMap::new()).ok()?;
    // Outputs are weighted by their noise, although there is none.
    setup.known_scales = Some(vec![rig.noise; rig.outputs()]);
    let mut starts = random_starts(&setup, more, seed);
    starts.push(near.map_or_else(
        || [rig.theta.as_slice(), &rig.levels].concat(),
        <[f64]>::to_vec,
    ));
    fit_from(&setup, &starts, &setup.white_noise(), STOPPING).ok()
}

/// Structural error of a fit to a record without noise, over the noise of a rig.
fn error(rig: &Rig, fit: &Fit) -> f64 {
    let scales = vec![rig.noise; fit.rmse.len()];
    weighted_rms(&fit.rmse, &scales, &fit.samples_per_output)
}

/// A parameter that is not the size: anywhere between its first and its last start, or within a factor of two of its only
/// one.
fn beside(parameter: &ParameterInfo, rng: &mut ChaCha8Rng) -> f64 {
    let least = parameter
        .starts
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let most = parameter
        .starts
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let value = if least == most {
        least * by_factor(rng, 0.5..=2.0)
    } else if least > 0.0 {
        by_factor(rng, least..=most)
    } else {
        between(rng, least..=most)
    };
    value.min(parameter.upper).max(parameter.lower)
}

#[cfg(test)]
mod tests;
