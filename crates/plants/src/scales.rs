//! Scales: the ranges of the data, which set plausible parameter ranges, start values and operating levels.

use serde::{Deserialize, Serialize};

use crate::limits::{MAX_VESSELS, SERIES};

/// A start value chosen from the data as the best of several alternatives; their number enters the multiple-testing correction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Picked {
    /// The best alternative.
    pub value: f64,
    /// Number of alternatives.
    pub alternatives: f64,
}

/// The ranges of the data: they set plausible parameter ranges, start values and operating levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Smallest and largest command \[input unit\].
    pub input: (f64, f64),
    /// Smallest and largest value of the second input: the command to the second pump or, if [`crate::Known::disturbance`] says so, the
    /// measured disturbance; `None` if there is no second input \[input unit\].
    pub input_2: Option<(f64, f64)>,
    /// Deciles of the commands, if known \[input unit\].
    #[serde(default)]
    pub input_deciles: [Option<Deciles>; 2],
    /// Range of the actuator: the known range, or zero to the largest command \[input unit\].
    pub input_range: f64,
    /// Number of vessels, set by [`crate::Structure::new`].
    pub vessels: usize,
    /// Smallest and largest level of each vessel, as far as they are known \[level unit\].
    pub level: [(f64, f64); MAX_VESSELS],
    /// Deciles of these levels, if known \[level unit\].
    #[serde(default)]
    pub level_deciles: [Option<Deciles>; MAX_VESSELS],
    /// Height of the tanks, if known, set by [`crate::Structure::new`] \[level unit\].
    #[serde(default)]
    pub tank_height: Option<f64>,
    /// Mean level of each vessel \[level unit\].
    pub operating_level: [f64; MAX_VESSELS],
    /// Area of each vessel; one if it is not known.
    pub area: [f64; MAX_VESSELS],
    /// The outputs in order, at least one, set by [`crate::Structure::new`].
    pub outputs: Vec<OutputScales>,
    /// Flow through a valve with a flow coefficient of one at one unit of head, if known \[level^2.5/s\].
    pub orifice: Option<f64>,
    /// Period of the strongest spectral line of the residual so far; zero if no period is searched \[s\].
    pub period: f64,
    /// Mean throughput \[area x level/s\].
    pub flow: f64,
    /// Median sampling interval \[s\].
    pub sample_interval: f64,
    /// Length of the longest record \[s\].
    pub duration: f64,
}

/// An output: a sensor and the properties of its readings.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OutputScales {
    /// The vessel whose level the sensor reads.
    pub vessel: usize,
    /// Quantisation step of the readings: all of them are integer multiples of it; zero if there is none \[level unit\].
    pub reading_step: f64,
    /// The quantisation step that explains most of the residual so far, if the readings themselves show no step; `None` if no step is
    /// searched \[level unit\].
    pub hidden_step: Option<Picked>,
}

/// The 10 %, 20 %, ... 90 % quantiles of a signal.
pub type Deciles = [f64; 9];

/// The quantile for a share, by linear interpolation between the deciles and the two ends; for a uniform distribution if the deciles are
/// not known.
pub(crate) fn quantile(share: f64, (low, high): (f64, f64), deciles: Option<&Deciles>) -> f64 {
    let Some(deciles) = deciles else {
        return low + share * (high - low);
    };
    let at = |i: usize| match i {
        0 => low,
        10 => high,
        _ => deciles[i - 1],
    };
    let place = 10.0 * share.clamp(0.0, 1.0);
    let below = (place as usize).min(9);
    at(below) + (place - below as f64) * (at(below + 1) - at(below))
}

/// The deciles of values; `None` if there are no values.
#[must_use]
pub fn deciles(mut values: Vec<f64>) -> Option<Deciles> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(std::array::from_fn(|i| {
        values[((i + 1) as f64 * last as f64 / 10.0).round() as usize]
    }))
}

impl Scales {
    /// Scales from the ranges of the command and of the reading, before any simulation.
    #[must_use]
    pub fn from_ranges(
        input: (f64, f64),
        output: (f64, f64),
        sample_interval: f64,
        duration: f64,
    ) -> Self {
        let middle = 0.5 * (output.0 + output.1);
        Self {
            input,
            input_2: None,
            input_deciles: [None; 2],
            input_range: input.0.abs().max(input.1.abs()),
            level: [output; MAX_VESSELS],
            level_deciles: [None; MAX_VESSELS],
            tank_height: None,
            operating_level: [middle; MAX_VESSELS],
            area: [1.0; MAX_VESSELS],
            vessels: 1,
            outputs: vec![OutputScales::default()],
            orifice: None,
            period: 0.0,
            flow: middle.abs() / (0.1 * duration),
            sample_interval,
            duration,
        }
    }

    /// The output that reads the lowest measured vessel: for joined vessels the last one in the row.
    #[must_use]
    pub fn lowest_output(&self) -> usize {
        let outputs = self.outputs.iter().enumerate();
        let lowest = outputs.max_by_key(|(_, output)| output.vessel);
        lowest.map_or(0, |(output, _)| output)
    }

    /// The largest level of any vessel, by magnitude.
    #[must_use]
    pub fn largest_level(&self) -> f64 {
        // The range of a vessel that does not exist is that of the reading.
        let levels = self.level.iter().take(self.vessels.max(SERIES));
        levels.fold(0.0, |most: f64, (low, high)| {
            most.max(low.abs()).max(high.abs())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_on_what_was_visited() {
        // Nine tenths of the samples are near the lower end.
        let values: Vec<f64> = (0..=1000)
            .map(|k| f64::from(k) / 1000.0)
            .map(|x| if x < 0.9 { x } else { 0.9 + 91.0 * (x - 0.9) })
            .collect();
        let known = deciles(values).unwrap();
        let at = |share| quantile(share, (0.0, 10.0), Some(&known));
        for (share, value) in [
            (0.0, 0.0),
            (0.25, 0.25),
            (0.9, 0.9),
            (0.95, 5.45),
            (1.0, 10.0),
        ] {
            assert!((at(share) - value).abs() < 1e-9, "{share}: {}", at(share));
        }
        assert_eq!(quantile(0.25, (2.0, 10.0), None), 4.0);
        assert_eq!(deciles(Vec::new()), None);
        assert_eq!(deciles(vec![3.0]), Some([3.0; 9]));
    }
}
