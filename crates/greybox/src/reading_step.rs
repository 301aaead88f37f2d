//! Whether the readings of records are whole multiples of one number, and of which: exactly, as after a converter, or with additional
//! noise.

use ct_signals::{Record, range_of};

use crate::reading_grid;

/// Least agreement of the readings with multiples: the mean of `cos(2 pi y/D)`, one for exact multiples. With white noise of a tenth of the
/// step, 0.82.
const ALIGNED: f64 = 0.8;
/// Least alignment of a possible step, in standard deviations of that of readings on no grid.
const NOTICED: f64 = 2.5;
/// The most steps between the least and the largest reading that are looked for.
const MOST_STEPS: f64 = 100.0;
/// The same for starts of fits, which a false step costs time only.
const MOST_POSSIBLE_STEPS: f64 = 1000.0;
/// The least number of steps: fewer distinct levels would always fit.
const FEWEST_STEPS: f64 = 4.0;
/// Number of readings in the first test.
const FIRST_LOOK: usize = 400;
/// The same for starts of fits: an alignment that much noise has lowered is above that of chance only over many readings.
const FIRST_LOOK_IN_NOISE: usize = 2000;
/// The most cosines of a first test, for its time.
const MOST_COSINES: usize = 40_000_000;

/// The largest `D` such that nearly all readings of an output are multiples of `D` \[output unit\], if it is larger than the last digit.
pub(crate) fn reading_step(records: &[Record], output: usize) -> Option<f64> {
    exact_reading_step(records, output).or_else(|| noisy_step(records, output))
}

/// Quantisation step if the readings themselves are exact multiples, as after an A/D converter.
#[must_use]
pub fn exact_reading_step(records: &[Record], output: usize) -> Option<f64> {
    let grid = reading_grid(records, output).filter(|grid| grid.is_coarse() && grid.has_zero());
    grid.map(|grid| grid.step)
}

/// Quantisation steps that the readings of an output suggest, the largest alignment first, at most `most` \[output unit\]; noise of up to 0.3
/// steps may be added after the quantisation. They are starts of fits: a fit has to show which of them is one.
#[must_use]
pub fn possible_reading_steps(records: &[Record], output: usize, most: usize) -> Vec<f64> {
    let all = readings(records, output);
    let Some(mut looked) = FirstLook::of(&all, MOST_POSSIBLE_STEPS, FIRST_LOOK_IN_NOISE) else {
        return Vec::new();
    };
    let chance = (2.0 * looked.readings as f64).sqrt().recip();
    looked
        .maxima
        .retain(|(alignment, _)| *alignment > NOTICED * chance);
    looked.maxima.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut steps: Vec<f64> = exact_reading_step(records, output).into_iter().collect();
    let best = looked.maxima.iter().take(most);
    steps.extend(best.map(|(_, steps)| 1.0 / climb(*steps, looked.grid, &all)));
    steps.truncate(most);
    steps
}

/// Quantisation step if noise is added after the quantisation.
fn noisy_step(records: &[Record], output: usize) -> Option<f64> {
    let all = readings(records, output);
    let looked = FirstLook::of(&all, MOST_STEPS, FIRST_LOOK)?;
    // Readings on multiples of D are also on multiples of D/2, so the first (largest) step is the result.
    let tried = looked
        .maxima
        .iter()
        .filter(|(alignment, _)| *alignment > 0.5 * ALIGNED)
        .map(|(_, steps)| climb(*steps, looked.grid, &all));
    let mut tried = tried.map(|steps| (aligned(steps, &all), steps));
    let first = tried.find(|(alignment, _)| *alignment > ALIGNED)?;
    // A neighbouring frequency with one step more or less over the range has a high alignment too, but a lower one.
    let nearby = tried.take_while(|(_, steps)| *steps < 1.5 * first.1);
    let best = nearby.fold(
        first,
        |best, next| if next.0 > best.0 { next } else { best },
    );
    Some(1.0 / best.1)
}

fn readings(records: &[Record], output: usize) -> Vec<f64> {
    let records = records.iter();
    let present = records.flat_map(|record| record.outputs[output].present());
    present.collect()
}

/// Alignment of some of the readings over the number of steps in one unit of the reading.
struct FirstLook {
    /// Number of readings.
    readings: usize,
    /// Distance of two numbers of steps.
    grid: f64,
    /// Maxima: the alignment, and the number of steps, which rises.
    maxima: Vec<(f64, f64)>,
}

impl FirstLook {
    /// For at most `most_steps` over the range of the readings, with at most `most_readings` of them; `None` if they have no range.
    fn of(all: &[f64], most_steps: f64, most_readings: usize) -> Option<Self> {
        let (low, high) = range_of(all);
        let (span, reach) = (high - low, low.abs().max(high.abs()));
        if !(span > 0.0 && reach.is_finite()) {
            return None;
        }
        let every = all.len().div_ceil(most_readings);
        let some: Vec<f64> = all.iter().copied().step_by(every).collect();
        // The phase of the largest reading changes by an eighth from one number of steps to the next, so no peak is missed.
        let grid = 0.125 / reach;
        let count = ((most_steps - FEWEST_STEPS) / span / grid) as usize;
        let count = count.min(MOST_COSINES / some.len());
        let at = |k: usize| FEWEST_STEPS / span + grid * k as f64;
        let coarse = alignments(at(0), grid, count, &some);
        let maxima = (1..count.saturating_sub(1))
            .filter(|&k| coarse[k] >= coarse[k - 1] && coarse[k] >= coarse[k + 1])
            .map(|k| (coarse[k], at(k)));
        Some(Self {
            readings: some.len(),
            grid,
            maxima: maxima.collect(),
        })
    }
}

/// Agreement of readings with multiples of one over `steps`.
fn aligned(steps: f64, readings: &[f64]) -> f64 {
    let turn = std::f64::consts::TAU * steps;
    let sum: f64 = readings.iter().map(|y| (turn * y).cos()).sum();
    sum / readings.len() as f64
}

/// Number of readings whose cosines are summed side by side.
const BESIDE: usize = 8;

/// Agreement of readings with multiples of one over `first`, `first + grid`, `first + 2 grid` and so on.
///
/// From one number to the next each reading's phase turns by the same angle: a rotation takes a tenth of the time of a cosine, and a million
/// of them add up to an error of 1e-10.
fn alignments(first: f64, grid: f64, count: usize, readings: &[f64]) -> Vec<f64> {
    let phases = |steps: f64| {
        readings
            .iter()
            .map(move |y| std::f64::consts::TAU * steps * y)
    };
    // Readings that fill the last group have no share in the sum.
    let none = || {
        std::iter::repeat_n(
            (0.0, 0.0),
            readings.len().next_multiple_of(BESIDE) - readings.len(),
        )
    };
    let of = |steps: f64| -> (Vec<f64>, Vec<f64>) {
        phases(steps)
            .map(|phase| (phase.cos(), phase.sin()))
            .chain(none())
            .unzip()
    };
    let (mut cosines, mut sines) = of(first);
    let (turn_cosines, turn_sines) = of(grid);
    let mut found = Vec::with_capacity(count);
    for _ in 0..count {
        let mut sums = [0.0; BESIDE];
        let now = cosines
            .chunks_exact_mut(BESIDE)
            .zip(sines.chunks_exact_mut(BESIDE));
        let turns = turn_cosines
            .chunks_exact(BESIDE)
            .zip(turn_sines.chunks_exact(BESIDE));
        for ((c, s), (turn_c, turn_s)) in now.zip(turns) {
            for i in 0..BESIDE {
                sums[i] += c[i];
                let next = c[i] * turn_c[i] - s[i] * turn_s[i];
                s[i] = c[i] * turn_s[i] + s[i] * turn_c[i];
                c[i] = next;
            }
        }
        found.push(sums.iter().sum::<f64>() / readings.len() as f64);
    }
    found
}

/// The best alignment near a number of steps, within `reach`.
fn climb(steps: f64, reach: f64, readings: &[f64]) -> f64 {
    let (mut steps, mut reach) = (steps, reach);
    while reach > 1e-9 * steps {
        let best = [-1.0, -0.5, 0.0, 0.5, 1.0]
            .map(|share| steps + share * reach)
            .map(|trial| (aligned(trial, readings), trial))
            .into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0));
        steps = best.map_or(steps, |(_, trial)| trial);
        reach *= 0.6;
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use ct_signals::{Channel, noise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn record(reading: impl Fn(f64) -> f64) -> Record {
        let y: Vec<f64> = (0..900)
            .map(|k| f64::from(k) / 30.0)
            .map(|t| reading(14.0 + 4.0 * t.sin() + 3.0 * (0.37 * t).cos()))
            .collect();
        Record {
            name: "wave".into(),
            time: (0..y.len()).map(|k| k as f64).collect(),
            inputs: vec![Channel::new("u", "V", vec![1.0; y.len()])],
            outputs: vec![Channel::new("y", "cm", y)],
            ..Record::default()
        }
    }

    #[test]
    fn steps_are_found_with_and_without_noise_on_them() {
        for step in [0.17, 0.5, 1.3] {
            for noise in [0.0, 0.07] {
                let jitter = |y: f64| noise * step * (977.0 * y).sin();
                let wave = record(|y| step * (y / step).round() + jitter(y));
                let found = reading_step(&[wave], 0).unwrap();
                assert!((found - step).abs() < 1e-3 * step, "{found} of {step}");
            }
        }
    }

    #[test]
    fn a_step_is_possible_in_noise_of_0_3_steps() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for step in [0.5, 1.3] {
            let mut wave = record(|y| step * (y / step).round());
            let noise = noise::white(wave.len(), 0.3 * step, &mut rng);
            for (y, e) in wave.outputs[0].values.iter_mut().zip(noise) {
                *y += e;
            }
            assert_eq!(reading_step(std::slice::from_ref(&wave), 0), None);
            let possible = possible_reading_steps(&[wave], 0, 4);
            let near = |found: &f64| (found - step).abs() < 0.02 * step;
            assert!(possible.iter().any(near), "{possible:?} without {step}");
        }
    }

    #[test]
    fn rotated_phases_agree_with_cosines() {
        let readings: Vec<f64> = (0..1003)
            .map(|k| 3.0 + (0.7 * f64::from(k)).sin())
            .collect();
        let (first, grid, count) = (2.0, 0.03, 20_000);
        let found = alignments(first, grid, count, &readings);
        for k in (0..count).step_by(97).chain([count - 1]) {
            let exact = aligned(first + grid * k as f64, &readings);
            assert!(
                (found[k] - exact).abs() < 1e-9,
                "{k}: {} of {exact}",
                found[k]
            );
        }
    }

    #[test]
    fn a_smooth_reading_and_a_fine_converter_have_none() {
        assert_eq!(reading_step(&[record(|y| y)], 0), None);
        assert_eq!(
            reading_step(&[record(|y| (y / 0.01).round() * 0.01)], 0),
            None
        );
        assert_eq!(reading_step(&[record(|_| 3.0)], 0), None);
        assert_eq!(reading_step(&[record(|_| f64::INFINITY)], 0), None);
    }
}
