//! Readings that are far from those before and after them: a code for a missing sample, such as -999, or a disturbed transmission.
//!
//! The difference of a reading and the mean of its neighbours is compared with the typical one of the column. A process moves to such a
//! value and back within one sampling interval only if an input does so. A code may also stand in many rows, one after the other: it is one
//! value far outside the range of the others.

use serde::Serialize;

use crate::{Channel, Record};

/// A reading is isolated if its distance from its neighbours is so many times the typical one, ...
const TYPICAL: f64 = 40.0;
/// ... this share of the range of most readings, ...
const OF_RANGE: f64 = 0.25;
/// ... and if its neighbours differ by less than this share of the distance.
const NEIGHBOURS: f64 = 0.2;
/// The range of most readings lies between this quantile and its complement.
const QUANTILE: f64 = 0.02;
/// Largest share of isolated readings: with more of them they are a property of the signal.
const MOST: f64 = 0.02;
/// A value that stands in several rows is a code if it is so many times the range of the middle readings away from that range.
const CODE: f64 = 3.0;
/// The middle readings lie between this quantile and its complement.
const MIDDLE: f64 = 0.15;
/// The fewest readings of a column.
const FEWEST: usize = 20;

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
    /// The nearest other values before and after it \[unit of the column\].
    pub neighbours: (f64, f64),
    /// All of them have one value.
    pub equal: bool,
}

/// The isolated readings of each output.
#[must_use]
pub fn isolated_readings(record: &Record) -> Vec<IsolatedReadings> {
    let of_inputs: Vec<Vec<bool>> = record.inputs.iter().map(|u| isolated(u, 0.0)).collect();
    let outputs = record.outputs.iter().filter_map(|channel| {
        if let Some(rows) = code(channel) {
            return said(record, channel, &rows);
        }
        // Of a signal that is constant but for a few readings nothing is known of what is typical.
        let mut rows = isolated(channel, f64::MIN_POSITIVE);
        for input in &of_inputs {
            for (k, row) in rows.iter_mut().enumerate() {
                // An input pulse of one row may move the reading of its row, or that of the next one.
                *row &= !(input[k] || k > 0 && input[k - 1]);
            }
        }
        let rows: Vec<usize> = (0..rows.len()).filter(|&k| rows[k]).collect();
        let most = MOST * channel.present().count() as f64;
        if rows.len() as f64 > most.max(1.0) {
            return None;
        }
        said(record, channel, &rows)
    });
    outputs.collect()
}

fn said(record: &Record, channel: &Channel, rows: &[usize]) -> Option<IsolatedReadings> {
    let &first = rows.first()?;
    let values = &channel.values;
    Some(IsolatedReadings {
        column: channel.name.clone(),
        unit: channel.unit.clone(),
        count: rows.len(),
        time: record.time[first],
        value: values[first],
        neighbours: neighbours(values, first, values[first])?,
        equal: rows.iter().all(|&k| values[k] == values[first]),
    })
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

/// The rows of one value far outside the range of the others, in two rows or more.
fn code(channel: &Channel) -> Option<Vec<usize>> {
    let sorted = sorted(channel)?;
    let (low, high) = (quantile(&sorted, MIDDLE), quantile(&sorted, 1.0 - MIDDLE));
    let far = CODE * (high - low);
    let is_far = |value: f64| far > 0.0 && (value < low - far || value > high + far);
    let (least, largest) = (sorted[0], sorted[sorted.len() - 1]);
    let value = [least, largest].into_iter().find(|value| is_far(*value))?;
    let values = &channel.values;
    let others_far = values.iter().any(|other| *other != value && is_far(*other));
    let rows: Vec<usize> = (0..values.len()).filter(|&k| values[k] == value).collect();
    (rows.len() > 1 && !others_far).then_some(rows)
}

/// The last reading before a row, and the first one after it; `but`: a value that is passed over.
fn neighbours(values: &[f64], row: usize, but: f64) -> Option<(f64, f64)> {
    let present = |value: &&f64| !value.is_nan() && **value != but;
    let before = values[..row].iter().rev().find(present)?;
    let after = values[row + 1..].iter().find(present)?;
    Some((*before, *after))
}

/// For each row whether its value is isolated; `scale`: the least typical distance.
fn isolated(channel: &Channel, scale: f64) -> Vec<bool> {
    let values = &channel.values;
    let Some(sorted) = sorted(channel) else {
        return vec![false; values.len()];
    };
    let range = quantile(&sorted, 1.0 - QUANTILE) - quantile(&sorted, QUANTILE);
    let distance = |k: usize| {
        let (before, after) = neighbours(values, k, f64::NAN).filter(|_| !values[k].is_nan())?;
        Some((values[k] - 0.5 * (before + after), (after - before).abs()))
    };
    let distances: Vec<Option<(f64, f64)>> = (0..values.len()).map(distance).collect();
    let mut sizes: Vec<f64> = distances.iter().flatten().map(|(d, _)| d.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let least = (TYPICAL * typical).max(OF_RANGE * range);
    if least < scale {
        return vec![false; values.len()];
    }
    let is_isolated = |found: &Option<(f64, f64)>| {
        found.is_some_and(|(d, apart)| d.abs() > least && apart < NEIGHBOURS * d.abs())
    };
    distances.iter().map(is_isolated).collect()
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
        assert!(only.equal && (only.neighbours.0 - 6.0).abs() < 0.1);
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
        // A pulse of an input causes the spike.
        let mut pulse = still.clone();
        pulse[199] = 10.0;
        assert!(found(pulse, spike).is_empty());
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
