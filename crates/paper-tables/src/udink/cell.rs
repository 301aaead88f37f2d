//! A printed figure, compared with the same figure of many runs: median, 5 to 95 % range, and whether the printed one lies inside.

use serde::Serialize;
use statrs::statistics::{Data, OrderStatistics};

use crate::Printed;

/// Least share of cells inside for consistent tables: nine of ten are expected, minus a margin for chance.
const CONSISTENT: f64 = 0.85;

/// One figure of a table compared with many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Number of the table in the paper, 1 to 4.
    pub table: usize,
    /// Name of the cell, as in [`CELLS`](super::printed::CELLS).
    pub cell: &'static str,
    /// The printed figure, or a difference of two; its unit is that of the cell: 1 for K, s for tau, c and the criterion.
    pub paper: f64,
    /// Decimals of it, 0 to 6.
    #[serde(skip)]
    pub decimals: usize,
    /// Median of the runs; NaN (`null`) where all failed.
    pub median: f64,
    /// 5 % of the runs lie below.
    pub q05: f64,
    /// 5 % of the runs lie above.
    pub q95: f64,
    /// Share of the runs below the printed figure, 0 to 1.
    pub below: f64,
    /// Whether the printed figure, allowing for its rounding, is in the 5 to 95 % range.
    pub inside: bool,
}

impl Cell {
    /// A printed figure compared with `runs`; values that are not finite belong to failed runs, and are left out.
    pub(crate) fn new(
        table: usize,
        cell: &'static str,
        paper: Printed,
        runs: impl Iterator<Item = f64>,
    ) -> Self {
        let finite: Vec<f64> = runs.filter(|value| value.is_finite()).collect();
        let count = finite.len();
        let lower = finite.iter().filter(|&&value| value < paper.value).count();
        let below = lower as f64 / count as f64;
        let mut runs = Data::new(finite);
        let [q05, median, q95] = [0.05, 0.5, 0.95].map(|share| runs.quantile(share));
        Self {
            table,
            cell,
            paper: paper.value,
            decimals: paper.decimals,
            median,
            q05,
            q95,
            below,
            inside: paper.value + paper.rounding >= q05 && paper.value - paper.rounding <= q95,
        }
    }
}

/// Median of the finite values; NaN where there is none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// The quantile of the finite values for this share; NaN if there is none.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    Data::new(finite).quantile(share)
}

/// All figures of tables 1 to 4 compared with many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The figures, in the paper's order.
    pub tables: Vec<Cell>,
    /// Number of figures inside.
    pub inside: usize,
    /// Number of figures.
    pub of: usize,
    /// Figures outside, with the reason.
    pub outside: Vec<Outside>,
    /// Runs that failed, of all tables.
    pub failed: usize,
}

/// A figure outside its range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outside {
    /// Number of the table in the paper, 1 to 4.
    pub table: usize,
    /// The quantity, as in [`CELLS`](super::printed::CELLS).
    pub cell: &'static str,
    /// Known reason.
    pub why: &'static str,
}

impl Comparison {
    pub(crate) fn new(
        tables: Vec<Cell>,
        failed: usize,
        why: impl Fn(&Cell) -> &'static str,
    ) -> Self {
        let missed: Vec<&Cell> = tables.iter().filter(|cell| !cell.inside).collect();
        let outside: Vec<Outside> = missed
            .iter()
            .map(|cell| Outside {
                table: cell.table,
                cell: cell.cell,
                why: why(cell),
            })
            .collect();
        Self {
            inside: tables.len() - outside.len(),
            of: tables.len(),
            outside,
            tables,
            failed,
        }
    }

    /// Whether the expected number of figures is inside, at least 85 %, and no run failed, as none of the paper's did.
    #[must_use]
    pub fn consistent(&self) -> bool {
        self.failed == 0 && self.inside as f64 >= CONSISTENT * self.of as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_inside_with_its_rounding() {
        let runs = || (0..=100).map(f64::from);
        let cell = |value, decimals| Cell::new(1, "x", Printed::new(value, decimals), runs());
        let middle = cell(50.0, 0);
        assert_eq!(middle.median, 50.0);
        assert!(middle.inside && (middle.below - 0.495).abs() < 0.001);
        // quantiles without bias in the median: 0.05 (101 + 1/3) + 1/3 = 5.4, counted from 1
        assert!((middle.q05 - 4.4).abs() < 1e-9 && (middle.q95 - 95.6).abs() < 1e-9);
        let edge = middle.q95 + 0.3;
        assert!(cell(edge, 0).inside && !cell(edge, 1).inside);
        let edge = middle.q05 - 0.3;
        assert!(cell(edge, 0).inside && !cell(edge, 1).inside);
    }

    #[test]
    fn failed_runs_are_left_out_and_no_run_is_no_agreement() {
        let some = [1.0, f64::NAN, 2.0, 3.0, f64::INFINITY];
        assert_eq!(
            Cell::new(1, "x", Printed::new(2.0, 1), some.into_iter()).median,
            2.0
        );
        let none = Cell::new(1, "x", Printed::new(2.0, 1), [f64::NAN].into_iter());
        assert!(!none.inside && none.median.is_nan());
    }

    #[test]
    fn failed_runs_are_not_consistent() {
        let cells = || {
            let runs = (0..=100).map(f64::from);
            vec![Cell::new(1, "x", Printed::new(50.0, 0), runs)]
        };
        assert!(Comparison::new(cells(), 0, |_| "").consistent());
        assert!(!Comparison::new(cells(), 1, |_| "").consistent());
    }
}
