//! Whether the readings of records are on a grid, `y = offset + k D`, as after a converter or in a file with few digits.
//!
//! A converter rounds what the sensor says with its noise, so the readings themselves are the grid: it is seen without any model and
//! without any fit. Digits of a file are a grid too; whether a grid matters is a question of its step against the noise
//! ([`ReadingGrid::coarseness`]).
//!
//! # Method
//! Differences of neighbours among the sorted levels, and of readings that follow each other, are multiples of `D`. Quantiles of either,
//! and these over small whole numbers, are candidates. A candidate is refined by least squares, `d = k D`, over differences of levels that
//! stand 1, 2, 4, ... places apart: each doubling may trust its `k`, since the one before has made `D` as much more precise. The largest
//! candidate on whose grid nearly all readings lie is the answer, unless as many levels lie there by chance.

use ct_signals::Record;

/// A reading is on the grid if its distance is below this share of the step: one fifth of random readings are.
const NEAR: f64 = 0.1;
/// Share of the readings that must lie on the grid.
const MOST: f64 = 0.9;
/// Least range of the readings, in steps of the grid.
const FEWEST_STEPS: f64 = 3.0;
/// Largest number of steps for the search.
const MOST_STEPS: f64 = 2e4;
/// Fewest readings.
const FEWEST_READINGS: usize = 20;
/// Quantiles of the differences whose fractions are candidates, and the divisors of the differences.
const QUANTILES: [f64; 6] = [0.0, 0.02, 0.1, 0.25, 0.5, 0.75];
const DIVISORS: u32 = 12;
/// Two readings are the same level within this share of the largest reading.
const SAME: f64 = 1e-10;
/// Largest relative error of a candidate step before it is refined by least squares: readings in a file are rounded to their digits, and so are
/// their differences.
const PRINTED: f64 = 0.04;
/// A grid is coarse where its step is at least this part of the median change from one reading to the next. Rounding then adds
/// more than 1 % to the noise's variance.
const COARSE: f64 = 0.4;
/// Limit of the probability of a grid among random levels.
const CHANCE: f64 = 1e-3;

/// The grid that readings lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingGrid {
    /// Step `D` of the grid \[output unit\].
    pub step: f64,
    /// A point of the grid, the one nearest to zero \[output unit\].
    pub offset: f64,
    /// Share of the readings that lie on the grid, within a tenth of the step.
    pub share: f64,
    /// Median absolute difference of readings that follow each other: for white noise of standard deviation `s` before the rounding, and a
    /// slow process, `0.95 s`, and zero where the step is several times that \[output unit\].
    pub median_change: f64,
}

impl ReadingGrid {
    /// The step over the median change from one reading to the next; infinite where most readings repeat the one before.
    #[must_use]
    pub fn coarseness(&self) -> f64 {
        self.step / self.median_change
    }

    /// Whether the quantisation step is large compared with the noise, and not only the last digit of the file.
    #[must_use]
    pub fn is_coarse(&self) -> bool {
        self.coarseness() >= COARSE
    }

    /// Zero is a point of the grid.
    #[must_use]
    pub fn has_zero(&self) -> bool {
        self.offset.abs() <= NEAR * self.step
    }
}

/// The grid of the largest step on which nearly all readings of an output are, over all records; `None` if there is none.
#[must_use]
pub fn reading_grid(records: &[Record], output: usize) -> Option<ReadingGrid> {
    let mut sorted: Vec<f64> = records
        .iter()
        .flat_map(|record| record.outputs[output].present())
        .collect();
    if sorted.len() < FEWEST_READINGS || sorted.iter().any(|y| !y.is_finite()) {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    let (span, reach) = (high - low, low.abs().max(high.abs()));
    let levels = levels(&sorted, SAME * reach);
    let mut changes: Vec<f64> = records
        .iter()
        .flat_map(|record| record.outputs[output].values.windows(2))
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|change| !change.is_nan())
        .collect();
    changes.sort_by(f64::total_cmp);
    let median_change = *changes.get(changes.len() / 2)?;

    let mut gaps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    changes.retain(|change| *change > SAME * reach);
    let mut candidates: Vec<f64> = [gaps, changes]
        .iter()
        .filter(|sorted| !sorted.is_empty())
        .flat_map(|sorted| {
            QUANTILES.map(|share| sorted[(share * (sorted.len() - 1) as f64) as usize])
        })
        .flat_map(|gap| (1..=DIVISORS).map(move |divisor| gap / f64::from(divisor)))
        .filter(|step| span <= MOST_STEPS * step)
        .collect();
    candidates.sort_by(|a, b| b.total_cmp(a));
    candidates.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * *b);
    let tried = candidates.len() as f64;
    let largest = candidates
        .into_iter()
        .filter_map(|step| refined(step, &levels))
        .filter(|step| span <= MOST_STEPS * step)
        .find_map(|step| {
            let (offset, share, spread) = held_against(step, &sorted)?;
            // Two levels determine a step and an offset; each further level is this close by chance with the probability below.
            let chance = tried * (2.0 * spread).powi(levels.len() as i32 - 2);
            (share >= MOST && chance < CHANCE).then_some(ReadingGrid {
                step,
                offset,
                share,
                median_change,
            })
        });
    // A grid of too few steps is uncertain by half of its step. A span is a multiple of its own grid up to rounding.
    largest.filter(|grid| span >= (FEWEST_STEPS - NEAR) * grid.step)
}

/// The distinct readings; if most readings are repeated ones, only these.
fn levels(sorted: &[f64], same: f64) -> Vec<f64> {
    let mut counted: Vec<(f64, usize)> = Vec::new();
    for &y in sorted {
        match counted.last_mut() {
            Some((level, count)) if y - *level <= same => *count += 1,
            _ => counted.push((y, 1)),
        }
    }
    let often = |least: usize| counted.iter().filter(move |(_, count)| *count >= least);
    let repeated: usize = often(3).map(|(_, count)| count).sum();
    let least = if repeated as f64 >= MOST * sorted.len() as f64 {
        3
    } else {
        1
    };
    often(least).map(|(level, _)| *level).collect()
}

/// A step by least squares over differences of levels; `None` where too many are no multiples of it.
fn refined(mut step: f64, levels: &[f64]) -> Option<f64> {
    let n = levels.len();
    let mut places = 1;
    // Up to this number of steps, the number of steps in a difference is certain.
    let mut certain = 0.2 / PRINTED;
    while places < n {
        for _ in 0..2 {
            let (mut kd, mut kk, mut fit, mut all) = (0.0, 0.0, 0, 0);
            let mut largest = 0.0_f64;
            for (low, high) in levels.iter().zip(&levels[places..]) {
                let d = high - low;
                let k = (d / step).round();
                if k > certain {
                    continue;
                }
                all += 1;
                if k > 0.0 && (d - k * step).abs() <= 2.0 * NEAR * step {
                    fit += 1;
                    kd += k * d;
                    kk += k * k;
                    largest = largest.max(k);
                }
            }
            if all == 0 {
                break;
            }
            if 10 * fit < 6 * all {
                return None;
            }
            step = kd / kk;
            certain = certain.max(4.0 * largest);
        }
        places *= 2;
    }
    Some(step)
}

/// Offset of the grid of that step, share of the readings on it, and distance of nine tenths of these from it, in steps.
fn held_against(step: f64, readings: &[f64]) -> Option<(f64, f64, f64)> {
    let turn = std::f64::consts::TAU / step;
    let (sin, cos) = readings.iter().fold((0.0, 0.0), |(sin, cos), y| {
        let (s, c) = (turn * y).sin_cos();
        (sin + s, cos + c)
    });
    let beside = |offset: f64| move |y: &f64| (y - offset) - ((y - offset) / step).round() * step;
    let middle = sin.atan2(cos) / turn;
    // Readings outside the grid bias the mean angle, but not the median.
    let mut near: Vec<f64> = readings
        .iter()
        .map(beside(middle))
        .filter(|rest| rest.abs() <= 2.0 * NEAR * step)
        .collect();
    near.sort_by(f64::total_cmp);
    let offset = middle + near.get(near.len() / 2)?;
    let mut on: Vec<f64> = readings
        .iter()
        .map(beside(offset))
        .map(|rest| rest.abs() / step)
        .filter(|rest| *rest <= NEAR)
        .collect();
    on.sort_by(f64::total_cmp);
    let share = on.len() as f64 / readings.len() as f64;
    let spread = *on.get((0.9 * on.len() as f64) as usize)?;
    let offset = offset - (offset / step).round() * step;
    Some((offset, share, spread.max(1e-6)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ct_signals::{Channel, noise};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const SIGMA: f64 = 0.05;

    fn record(y: Vec<f64>) -> Record {
        Record {
            name: "wave".into(),
            time: (0..y.len()).map(|k| k as f64).collect(),
            inputs: vec![Channel::new("u", "V", vec![1.0; y.len()])],
            outputs: vec![Channel::new("y", "cm", y)],
            ..Record::default()
        }
    }

    /// A slow process with noise, as a converter reads it.
    fn noisy(seed: u64, n: usize, read: impl Fn(f64) -> f64) -> Record {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let e = noise::white(n, SIGMA, &mut rng);
        let level = |t: f64| 14.0 + 2.0 * (t / 90.0).sin() + 1.5 * (t / 243.0).cos();
        record((0..n).map(|k| read(level(k as f64) + e[k])).collect())
    }

    #[test]
    fn what_is_rounded_after_the_noise_is_found_with_its_offset() {
        for (seed, ratio) in [0.5, 1.0, 3.0, 10.0].into_iter().enumerate() {
            for offset in [0.0, 0.31, -0.45] {
                for n in [300, 900, 4000] {
                    let step = ratio * SIGMA;
                    let rounded = |y: f64| step * ((y / step - offset).round() + offset);
                    let grid = reading_grid(&[noisy(seed as u64, n, rounded)], 0).unwrap();
                    assert!((grid.step / step - 1.0).abs() < 1e-6, "{grid:?} {step}");
                    assert!(
                        (grid.offset / step - offset).abs() < 1e-3,
                        "{grid:?} {offset}"
                    );
                    assert_eq!(grid.share, 1.0);
                    assert!(grid.is_coarse(), "{ratio}: {grid:?}");
                    assert_eq!(grid.has_zero(), offset == 0.0);
                }
            }
        }
    }

    #[test]
    fn a_few_readings_off_the_grid_do_not_hide_it() {
        for (seed, ratio) in [0.5, 1.0, 3.0, 10.0].into_iter().enumerate() {
            let step = ratio * SIGMA;
            let mut wave = noisy(seed as u64, 900, |y| step * (y / step).round());
            for (k, y) in wave.outputs[0].values.iter_mut().enumerate().step_by(25) {
                *y += (0.2 + 0.5 * (k as f64).sin().abs()) * step;
            }
            let grid = reading_grid(&[wave], 0).unwrap();
            assert!((grid.step / step - 1.0).abs() < 1e-4, "{grid:?} {step}");
            assert!(grid.share > 0.93 && grid.share < 0.98, "{grid:?}");
        }
    }

    #[test]
    fn numbers_with_few_digits_of_a_binary_step_are_still_its_grid() {
        let step = 40.0 / 4096.0;
        for digits in [1e4, 1e5, 1e6] {
            let printed = |y: f64| ((y / step).round() * step * digits).round() / digits;
            let grid = reading_grid(&[noisy(7, 900, printed)], 0).unwrap();
            assert!((grid.step / step - 1.0).abs() < 1e-4, "{grid:?} {step}");
            assert!(grid.share > 0.99 && !grid.is_coarse(), "{grid:?}");
        }
        // Several hundred steps, and each as large as the noise.
        let step = SIGMA / 0.83;
        let wide = |y: f64| (((60.0 * (y - 14.0)) / step).round() * step * 1e4).round() / 1e4;
        let smooth = noisy(8, 1500, |y| y);
        let ramped: Vec<f64> = (0..1500)
            .map(|k| smooth.outputs[0].values[k] - smooth.outputs[0].values[0] + k as f64 * 0.02)
            .map(|y| wide(14.0 + y / 60.0))
            .collect();
        let grid = reading_grid(&[record(ramped)], 0).unwrap();
        assert!((grid.step / step - 1.0).abs() < 1e-4, "{grid:?} {step}");
        assert!(grid.is_coarse());
    }

    #[test]
    fn digits_of_a_file_are_a_grid_far_below_the_noise() {
        let printed = |y: f64| (20.0 * y * 100.0).round() / 100.0;
        let grid = reading_grid(&[noisy(3, 900, printed)], 0).unwrap();
        assert!((grid.step - 0.01).abs() < 1e-8, "{grid:?}");
        assert!(grid.has_zero() && !grid.is_coarse(), "{grid:?}");
        assert!(grid.coarseness() < 0.02);
    }

    #[test]
    fn noise_and_smooth_courses_have_no_grid() {
        for seed in 0..200 {
            let n = [25, 60, 300, 900][seed as usize % 4];
            assert_eq!(reading_grid(&[noisy(seed, n, |y| y)], 0), None, "{seed}");
        }
        let course = |read: fn(f64) -> f64| record((0..900).map(|k| read(f64::from(k))).collect());
        assert_eq!(reading_grid(&[course(|t| (t / 50.0).sin())], 0), None);
        assert_eq!(reading_grid(&[course(|_| 3.0)], 0), None);
        assert_eq!(reading_grid(&[course(|_| f64::NAN)], 0), None);
        // Two readings are no grid, however often they occur.
        assert_eq!(
            reading_grid(&[course(|t| if t < 300.0 { 1.0 } else { 2.7 })], 0),
            None
        );
    }
}
