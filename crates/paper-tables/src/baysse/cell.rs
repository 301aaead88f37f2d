//! A statistic of many runs, compared with the printed figure: its standard deviation by the jackknife, and the band of a reproduction.

use serde::Serialize;

use crate::Printed;

/// Number of runs for which the bands are valid.
pub(super) const BAND_RUNS: f64 = 100.0;

/// A statistic of many runs with its printed value and its permitted band.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Number of the table in the paper, 1 or 2.
    pub table: usize,
    /// Estimation method.
    pub method: &'static str,
    /// Method and statistic.
    pub cell: String,
    /// The statistic: of K (table II: cm/V) or tau (s), the distance D of equation (34), or the mean number of iterations.
    #[serde(skip)]
    pub of: &'static str,
    /// The printed figure, if any.
    pub paper: Option<f64>,
    /// Decimals of it, 0 to 6.
    #[serde(skip)]
    pub decimals: usize,
    /// The statistic of the runs; NaN (`null`) where a fit of it failed.
    pub mean: f64,
    /// Standard deviation between sets of this number of runs, by the jackknife.
    pub sd: f64,
    /// The permitted band of a reproduction; an end that is `null` is open. It is valid for 100 runs, and wider for fewer.
    pub band: Option<[f64; 2]>,
    /// Whether the figure is inside; `None` without a band.
    pub inside: Option<bool>,
    /// Distance of the printed figure, allowing for its rounding, from the band, as a share of the band's width; 0 if inside; `None`
    /// without a printed figure or without a band with two ends.
    pub paper_outside: Option<f64>,
}

/// Description of a cell, and its reference values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub table: usize,
    pub method: &'static str,
    pub of: &'static str,
    pub paper: Option<Printed>,
    pub band: Option<[f64; 2]>,
}

impl Cell {
    /// A statistic of all runs.
    pub(super) fn new<T: Copy>(asked: Asked, runs: &[T], statistic: impl Fn(&[T]) -> f64) -> Self {
        let mean = statistic(runs);
        let inside = asked.band.map(|[low, high]| low <= mean && mean <= high);
        Self {
            table: asked.table,
            method: asked.method,
            cell: format!("{} {}", asked.method, asked.of),
            of: asked.of,
            paper: asked.paper.map(|paper| paper.value),
            decimals: asked.paper.map_or(0, |paper| paper.decimals),
            mean,
            sd: jackknife(runs, statistic),
            band: asked.band,
            inside,
            paper_outside: asked
                .paper
                .zip(asked.band)
                .and_then(|(paper, band)| beyond(paper, band)),
        }
    }
}

/// Distance of a printed figure from a band, as a share of its width.
fn beyond(paper: Printed, [low, high]: [f64; 2]) -> Option<f64> {
    let off = (low - paper.value).max(paper.value - high) - paper.rounding;
    let width = high - low;
    width.is_finite().then(|| off.max(0.0) / width)
}

/// Standard deviation of a statistic by the jackknife: each run is left out once.
fn jackknife<T: Copy>(runs: &[T], statistic: impl Fn(&[T]) -> f64) -> f64 {
    let n = runs.len() as f64;
    let mut others = Vec::with_capacity(runs.len());
    let without = (0..runs.len()).map(|left_out| {
        others.clear();
        others.extend_from_slice(&runs[..left_out]);
        others.extend_from_slice(&runs[left_out + 1..]);
        statistic(&others)
    });
    let without: Vec<f64> = without.collect();
    (n - 1.0) * variance(&without).max(0.0).sqrt() / n.sqrt()
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Variance, divided by n - 1.
pub(super) fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)
}

/// A band for 100 runs, made wider for fewer.
pub(super) fn band_for(runs: usize, [low, high]: [f64; 2]) -> [f64; 2] {
    let wider = (BAND_RUNS / runs as f64).sqrt().max(1.0);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    [middle - wider * half, middle + wider * half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0];
        let error = (variance(&values) / 8.0).sqrt();
        assert!((jackknife(&values, mean) / error - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_printed_figure_is_outside_by_a_share_of_the_band() {
        let outside = |value, decimals, band| beyond(Printed::new(value, decimals), band);
        assert_eq!(outside(5.9, 2, [5.8, 6.0]), Some(0.0));
        let above = outside(6.1, 2, [5.8, 6.0]).unwrap();
        assert!((above - 0.095 / 0.2).abs() < 1e-9, "{above}");
        // Within rounding of its last digit, the figure is in the band.
        assert_eq!(outside(6.004, 2, [5.8, 6.0]), Some(0.0));
        assert_eq!(outside(3.0, 1, [7.5, f64::INFINITY]), None);
    }

    #[test]
    fn bands_grow_for_fewer_runs_only() {
        let near = |found: [f64; 2], low: f64, high: f64| {
            assert!((found[0] - low).abs() < 1e-12 && (found[1] - high).abs() < 1e-12);
        };
        near(band_for(400, [1.0, 3.0]), 1.0, 3.0);
        near(band_for(25, [1.0, 3.0]), 0.0, 4.0);
    }
}
