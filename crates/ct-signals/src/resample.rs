//! Resampling of a record on an even grid: only on request, because it changes the data.

use crate::{Channel, Error, Hold, Record};

/// Most rows of a grid.
const MOST_ROWS: f64 = 1e7;
/// A held sample is valid for at most this number of sampling intervals: the command after it is not known.
const ACTS: f64 = 1.5;

impl Record {
    /// The record on an even grid of this interval \[s\] from its first instant on.
    ///
    /// Inputs and references that are held are averaged over each interval of the grid, as they act through it; those that run in lines,
    /// and outputs, are read at its instants, on the line between two samples that are no farther apart than the longer of 1.5 sampling
    /// intervals and one of the grid. Otherwise they are missing: a gap stays a gap.
    ///
    /// # Errors
    /// [`Error::Resampled`] where the grid would have more than ten million rows.
    pub fn resampled(&self, interval: f64) -> Result<Record, Error> {
        let (Some(&first), Some(&last)) = (self.time.first(), self.time.last()) else {
            return Ok(self.clone());
        };
        let rows = (last - first) / interval + 1.0;
        if rows.is_nan() || rows > MOST_ROWS {
            return Err(Error::Resampled {
                record: self.name.clone(),
                interval,
                rows,
                most: MOST_ROWS,
            });
        }
        let rows = ((last - first) / interval + 1e-9).floor() as usize + 1;
        let time: Vec<f64> = (0..rows).map(|k| first + interval * k as f64).collect();
        let apart = (1.5 * self.sample_interval()).max(interval);
        let held = |channel: &Channel| channel.with_values(self.means(channel, &time, interval));
        let read = |channel: &Channel| channel.with_values(self.readings(channel, &time, apart));
        let acting = |channel: &Channel| match channel.hold {
            Hold::Zero => held(channel),
            Hold::First => read(channel),
        };
        Ok(Record {
            name: self.name.clone(),
            inputs: self.inputs.iter().map(acting).collect(),
            outputs: self.outputs.iter().map(read).collect(),
            references: self.references.iter().map(acting).collect(),
            part: self.part,
            calendar: self.calendar.clone(),
            time,
        })
    }

    /// Means of a held channel over the intervals of a grid; missing if a part of an interval is missing.
    fn means(&self, channel: &Channel, grid: &[f64], interval: f64) -> Vec<f64> {
        let mut k = 0;
        let end = |k: usize| self.time.get(k + 1).copied().unwrap_or(f64::INFINITY);
        let acts = ACTS * self.sample_interval();
        let known = |k: usize, until: f64| {
            // The last sample is valid to the end of its interval of the grid.
            k + 1 >= self.len() || until - self.time[k] <= acts
        };
        grid.iter()
            .map(|&from| {
                let to = from + interval;
                while end(k) <= from {
                    k += 1;
                }
                let (mut at, mut sum, mut row) = (from, 0.0, k);
                loop {
                    let until = end(row).min(to);
                    if known(row, until) {
                        sum += channel.values[row] * (until - at);
                    } else {
                        sum = f64::NAN;
                    }
                    if until >= to {
                        break;
                    }
                    (at, row) = (until, row + 1);
                }
                sum / interval
            })
            .collect()
    }

    /// Linear interpolation of a channel.
    fn readings(&self, channel: &Channel, grid: &[f64], apart: f64) -> Vec<f64> {
        let present = (0..self.len()).filter(|&k| !channel.values[k].is_nan());
        let samples: Vec<(f64, f64)> = present.map(|k| (self.time[k], channel.values[k])).collect();
        let mut after = 0;
        grid.iter()
            .map(|&at| {
                while samples.get(after).is_some_and(|(t, _)| *t < at) {
                    after += 1;
                }
                let right = samples.get(after);
                if let Some((t, value)) = right
                    && *t == at
                {
                    return *value;
                }
                let left = after.checked_sub(1).and_then(|before| samples.get(before));
                match (left, right) {
                    (Some((t0, y0)), Some((t1, y1))) if t1 - t0 <= apart * (1.0 + 1e-9) => {
                        y0 + (y1 - y0) * (at - t0) / (t1 - t0)
                    }
                    _ => f64::NAN,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_inputs_are_averaged_and_outputs_read_on_lines() {
        let record = Record {
            time: vec![0.0, 1.0, 2.0, 3.0, 4.0, 8.0],
            inputs: vec![Channel::new("u", "", vec![1.0, 3.0, 5.0, 5.0, 2.0, 0.0])],
            outputs: vec![Channel::new(
                "y",
                "",
                vec![0.0, 1.0, f64::NAN, 3.0, 4.0, 8.0],
            )],
            ..Record::default()
        };
        let coarse = record.resampled(2.0).unwrap();
        assert_eq!(coarse.time, [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(coarse.inputs[0].values[..2], [2.0, 5.0]);
        // The command between 5.5 and 8 is not known.
        assert!(coarse.inputs[0].values[2..4].iter().all(|u| u.is_nan()));
        assert_eq!(coarse.inputs[0].values[4], 0.0);
        // There is no reading between 4 and 8.
        assert_eq!(coarse.outputs[0].values[..3], [0.0, 2.0, 4.0]);
        assert!(coarse.outputs[0].values[3].is_nan() && coarse.outputs[0].values[4] == 8.0);
        assert!(record.resampled(1e-9).is_err());
        let fine = record.resampled(0.5).unwrap();
        assert_eq!(fine.inputs[0].values[..5], [1.0, 1.0, 3.0, 3.0, 5.0]);
        assert_eq!(fine.outputs[0].values[1], 0.5);
    }
}
