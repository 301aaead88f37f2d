//! Readings that are not measurements: a spike of one row, or a code for a missing sample, such as -999.
//!
//! A spike is far from the readings before and after it, compared with the typical distance in the column. A code is one value far outside the
//! range of all others, in several rows. Neither is reported if an input moves shortly before each of them, as a process may follow it; usual
//! codes are.

use serde::Serialize;

use crate::{Channel, Record};

/// A reading is a spike if its distance from its neighbours is this many times the typical one, ...
const TYPICAL: f64 = 40.0;
/// ... this share of the range of most readings, ...
const OF_RANGE: f64 = 0.25;
/// ... and if its neighbours differ by less than this share of the distance.
const NEIGHBOURS: f64 = 0.2;
/// The range of most readings lies between this quantile and its complement.
const QUANTILE: f64 = 0.02;
/// Largest share of spikes: with more of them they are a property of the signal.
const MOST: f64 = 0.02;
/// The distance of a code from the other readings is this many times their range (once for the usual codes), ...
const CODE: f64 = 3.0;
/// ... and at most this share of the rows has it.
const MOST_OF_CODE: f64 = 0.5;
/// The fewest readings of a column.
const FEWEST: usize = 20;
/// An input moves if it changes by this share of its range, ...
const MOVES: f64 = 0.1;
/// ... within this number of readings before a spike or code.
const BEFORE: usize = 5;

/// Isolated readings of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IsolatedReadings {
    /// The column's name.
    pub column: String,
    /// Its unit.
    pub unit: String,
    /// Their number.
    pub count: usize,
    /// Time of the first of them \[s\].
    pub time: f64,
    /// The first of them \[unit of the column\].
    pub value: f64,
    /// The nearest other values before and after it \[unit of the column\]; NaN where there is none.
    pub neighbours: (f64, f64),
    /// All of them have one value, which stands in no other cell of the record.
    pub is_code: bool,
}

/// The isolated readings of each output, and the codes in each input.
#[must_use]
pub fn isolated_readings(record: &Record) -> Vec<IsolatedReadings> {
    let mut found = Vec::new();
    for channel in &record.inputs {
        for rows in codes(channel) {
            if is_usual_code(channel.values[rows[0]]) {
                found.push(said(record, channel, &rows));
            }
        }
    }
    for channel in &record.outputs {
        let codes = codes(channel);
        let rows: Vec<Vec<usize>> = if codes.is_empty() {
            vec![spikes(channel)]
        } else {
            codes
        };
        let rows = rows.into_iter().filter(|rows| !rows.is_empty());
        let unexplained = rows.filter(|rows| {
            let is_code = rows.len() > 1 && is_usual_code(channel.values[rows[0]]);
            is_code || !rows.iter().all(|&row| follows(record, channel, row))
        });
        found.extend(unexplained.map(|rows| said(record, channel, &rows)));
    }
    found
}

fn said(record: &Record, channel: &Channel, rows: &[usize]) -> IsolatedReadings {
    let first = rows[0];
    let values = &channel.values;
    let value = values[first];
    let other = |v: &&f64| !v.is_nan() && **v != value;
    let before = values[..first].iter().rev().find(other);
    let after = values[first + 1..].iter().find(other);
    let channels = record.inputs.iter().chain(&record.outputs);
    let all: usize = channels
        .map(|channel| channel.values.iter().filter(|v| **v == value).count())
        .sum();
    IsolatedReadings {
        column: channel.name.clone(),
        unit: channel.unit.clone(),
        count: rows.len(),
        time: record.time[first],
        value,
        neighbours: (
            before.copied().unwrap_or(f64::NAN),
            after.copied().unwrap_or(f64::NAN),
        ),
        is_code: rows.len() > 1 && rows.iter().all(|&k| values[k] == value) && all == rows.len(),
    }
}

/// Whether an input moves within a few readings before a row, or the row continues a value of the reading before, which is judged there. Of
/// what is before the first reading nothing is known.
fn follows(record: &Record, channel: &Channel, row: usize) -> bool {
    let values = &channel.values;
    let earlier = values[..row].iter().enumerate().rev();
    let mut earlier = earlier.filter(|(_, v)| !v.is_nan());
    let continues = earlier
        .clone()
        .next()
        .is_none_or(|(_, before)| *before == values[row]);
    let from = earlier.nth(BEFORE).map_or(0, |(from, _)| from);
    let moves = |input: &Channel| {
        let (low, high) = input.range();
        let window = input.values[from..=row].iter().filter(|v| !v.is_nan());
        let (least, most) = crate::range_of(window);
        high > low && most - least > MOVES * (high - low)
    };
    continues || record.inputs.iter().any(moves)
}

/// Whether loggers use a value as a code: digits of nine, the ends of the numbers of two bytes, or a number beyond all quantities.
fn is_usual_code(value: f64) -> bool {
    let size = value.abs();
    let nines = [
        99.0, 999.0, 9999.0, 99_999.0, 999_999.0, 99.99, 999.9, 999.99,
    ];
    let bytes = [32_767.0, 32_768.0, 65_535.0];
    nines.contains(&size) || bytes.contains(&size) || size >= 1e30
}

/// The readings of a column from the least to the largest; none if they are too few.
fn sorted(channel: &Channel) -> Option<Vec<f64>> {
    let mut sorted: Vec<f64> = channel.present().collect();
    sorted.sort_by(f64::total_cmp);
    (sorted.len() >= FEWEST).then_some(sorted)
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// The rows of each value far outside the range of the others, in two rows or more; at most one value below and one above.
fn codes(channel: &Channel) -> Vec<Vec<usize>> {
    let Some(sorted) = sorted(channel) else {
        return Vec::new();
    };
    let (least, largest) = (sorted[0], sorted[sorted.len() - 1]);
    for codes in [vec![least, largest], vec![least], vec![largest]] {
        let others = || sorted.iter().filter(|v| !codes.contains(v));
        let (low, high) = crate::range_of(others());
        let is_far = |code: &f64| {
            let gap = if *code < low { low - code } else { code - high };
            let times = if is_usual_code(*code) { 1.0 } else { CODE };
            gap > times * (high - low)
        };
        let share = 1.0 - others().count() as f64 / sorted.len() as f64;
        if high > low && share <= MOST_OF_CODE && codes.iter().all(is_far) {
            let values = &channel.values;
            let rows = |code: &f64| (0..values.len()).filter(|&k| values[k] == *code).collect();
            let rows = codes.iter().map(rows);
            return rows.filter(|rows: &Vec<usize>| rows.len() > 1).collect();
        }
    }
    Vec::new()
}

/// The rows of spikes.
fn spikes(channel: &Channel) -> Vec<usize> {
    let Some(sorted) = sorted(channel) else {
        return Vec::new();
    };
    let range = quantile(&sorted, 1.0 - QUANTILE) - quantile(&sorted, QUANTILE);
    let readings = channel.values.iter().enumerate();
    let readings: Vec<(usize, f64)> = readings
        .filter(|(_, v)| !v.is_nan())
        .map(|(row, v)| (row, *v))
        .collect();
    // The distance from the mean of both neighbours, and the difference of these.
    let distances = readings.windows(3).map(|three| {
        let [(_, before), (row, value), (_, after)] = [three[0], three[1], three[2]];
        let distance = (value - 0.5 * (before + after)).abs();
        (row, distance, (after - before).abs())
    });
    let distances: Vec<(usize, f64, f64)> = distances.collect();
    let mut sizes: Vec<f64> = distances.iter().map(|(_, d, _)| *d).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let least = (TYPICAL * typical).max(OF_RANGE * range);
    let is_spike = |(_, distance, apart): &&(usize, f64, f64)| {
        // Of a signal that is constant except for a few readings nothing is known of what is typical.
        least > 0.0 && *distance > least && *apart < NEIGHBOURS * distance
    };
    let rows: Vec<usize> = distances
        .iter()
        .filter(is_spike)
        .map(|(row, ..)| *row)
        .collect();
    let most = (MOST * readings.len() as f64).max(1.0);
    if rows.len() as f64 > most {
        return Vec::new();
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slow wave, its noise below 0.01.
    fn wave(rows: usize) -> Vec<f64> {
        let value = |k: usize| {
            let noise = ((k * 7919) % 101) as f64 / 101.0 - 0.5;
            5.0 + (k as f64 / 30.0).sin() + 0.02 * noise
        };
        (0..rows).map(value).collect()
    }

    fn found(input: Vec<f64>, output: Vec<f64>) -> Vec<IsolatedReadings> {
        let input = Channel::new("u", "V", input);
        let output = Channel::new("y", "bar", output);
        isolated_readings(&Record::sampled("a", 2.0, vec![input], vec![output]))
    }

    #[test]
    fn codes_and_spikes_are_found_and_the_rest_is_not() {
        let still = vec![0.0; 400];
        assert!(found(still.clone(), wave(400)).is_empty());
        let mut codes = wave(400);
        for k in [50, 51 + 70, 300, 301 + 7] {
            codes[k] = -999.0;
        }
        let of_codes = found(still.clone(), codes.clone());
        let [only] = &of_codes[..] else {
            panic!("{of_codes:?}")
        };
        assert_eq!((only.count, only.time, only.value), (4, 100.0, -999.0));
        assert!(only.is_code && (only.neighbours.0 - 6.0).abs() < 0.1);
        let mut spike = wave(400);
        spike[200] += 3.0;
        assert_eq!(found(still.clone(), spike.clone())[0].count, 1);
        // The first and the last reading have one neighbour.
        let mut ends = wave(400);
        (ends[0], ends[399]) = (-999.0, 1e9);
        assert!(found(still.clone(), ends).is_empty());
        // A code in many rows, one after the other.
        let mut off = wave(400);
        off[100..140].fill(65535.0);
        let off = found(still.clone(), off);
        assert_eq!((off[0].count, off[0].value), (40, 65535.0));
        // Two codes; a real excursion beside a code.
        let mut two = wave(400);
        two[100..110].fill(-999.0);
        two[200..205].fill(9999.0);
        two[300..330].fill(40.0);
        let two = found(still.clone(), two);
        assert_eq!(two.len(), 2, "{two:?}");
        assert!(two.iter().all(|one| one.is_code), "{two:?}");
        // A dropout to a value that other cells have too is no code.
        let mut zeros = wave(400);
        for k in [50, 80] {
            zeros[k] = 0.0;
        }
        let zeros = found(still.clone(), zeros);
        assert_eq!((zeros[0].count, zeros[0].is_code), (2, false));
        // A usual code that begins as an input moves.
        let mut steps = vec![0.0; 400];
        steps[100..].fill(1.0);
        let mut off = wave(400);
        off[100..110].fill(-999.0);
        assert_eq!(found(steps, off).len(), 1);
        // Of an input.
        let mut input: Vec<f64> = (0..400).map(|k| f64::from(k / 40 % 2)).collect();
        assert!(found(input.clone(), wave(400)).is_empty());
        input[77..90].fill(-999.0);
        assert_eq!(found(input, wave(400))[0].column, "u");
        // Levels of a slow peak, rounded, and pulses that an input causes.
        let peak = |k: usize| if (200..240).contains(&k) { 5.0 } else { 0.0 };
        let peak = (0..400).map(|k| 20.0 + 0.5 * (peak(k) + (k % 2) as f64));
        assert!(found(still.clone(), peak.collect()).is_empty());
        let pulses: Vec<f64> = (0..400).map(|k| f64::from(u8::from(k % 100 < 3))).collect();
        let driven = pulses
            .iter()
            .zip(wave(400))
            .map(|(u, y)| if *u > 0.0 { 1000.0 } else { y });
        assert!(found(pulses.clone(), driven.collect()).is_empty());
        // A pulse of an input causes the spike, also some rows later; an input that moves long before does not.
        for (row, spikes) in [(199, 0), (196, 0), (150, 1)] {
            let mut pulse = still.clone();
            pulse[row] = 10.0;
            assert_eq!(found(pulse, spike.clone()).len(), spikes, "{row}");
        }
        // A step is no spike, nor is a level of several rows.
        let mut steps = wave(400);
        steps[100..].iter_mut().for_each(|y| *y += 50.0);
        steps[300..305].fill(0.0);
        assert!(found(still.clone(), steps).is_empty());
        // Readings of white noise alone, and ones that are rounded to few values.
        let noise = (0..400).map(|k| ((k * 7919) % 997) as f64).collect();
        assert!(found(still.clone(), noise).is_empty());
        let rounded = wave(400).into_iter().map(|y| (2.0 * y).round() / 2.0);
        assert!(found(still, rounded.collect()).is_empty());
    }
}
