//! Published tables, computed again: what a paper prints beside what many runs of the same experiment give.
//!
//! A paper prints one run of one noise. It is consistent with a computation where its figures lie among those of many runs; that is all
//! that can be said without its noise.

pub mod baysse;
pub mod baysse_text;
mod gain_bounds;
pub mod gains;
pub mod paper_baysse;
pub mod paper_udink;
pub mod udink;
pub mod udink_contrasts;
pub mod udink_power;
mod udink_run;
pub mod udink_text;

use serde::Serialize;
use statrs::statistics::{Data, OrderStatistics};

use crate::numbers;

/// A figure as it is printed: value and decimals, so that its rounding is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// The figure.
    pub value: f64,
    /// The rounding it may hide, either way.
    pub rounding: f64,
    /// Decimals.
    pub decimals: usize,
}

impl Printed {
    /// A figure with so many decimals.
    pub(crate) const fn new(value: f64, decimals: usize) -> Self {
        const HALF_DIGIT: [f64; 7] = [0.5, 0.05, 0.005, 5e-4, 5e-5, 5e-6, 5e-7];
        Self {
            value,
            rounding: HALF_DIGIT[decimals],
            decimals,
        }
    }

    /// The difference of two figures; both may be rounded.
    pub(crate) fn minus(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            rounding: self.rounding + other.rounding,
            decimals: self.decimals.max(other.decimals),
        }
    }
}

/// One figure of a table against many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Number of the table in the paper.
    pub table: usize,
    /// What it is of.
    pub cell: &'static str,
    /// The figure that is printed, or a difference of such.
    pub paper: f64,
    /// Decimals of it.
    #[serde(skip)]
    pub decimals: usize,
    /// Median of the runs; NaN (`null`) where none came to its end.
    pub median: f64,
    /// 5 % of the runs lie below.
    pub q05: f64,
    /// 5 % of the runs lie above.
    pub q95: f64,
    /// Share of the runs below the printed figure, 0 to 1.
    pub below: f64,
    /// Whether the printed figure, give or take its rounding, lies in the 5 to 95 % range.
    pub inside: bool,
}

impl Cell {
    /// A printed figure against `runs`; those that are not finite count as lost, and lie nowhere.
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

impl Cell {
    /// The 5 to 95 % range, both ends with the decimals that its width deserves: of 20 to 200 last digits.
    pub(crate) fn range(&self, between: &str) -> String {
        let width = self.q95 - self.q05;
        if !width.is_finite() {
            return "-".to_owned();
        }
        let places = (1 - numbers::exponent(0.5 * width)).max(0);
        let [low, high] = [self.q05, self.q95].map(|end| numbers::decimals(end, places));
        format!("{low}{between}{high}")
    }
}

/// Median of what is finite, NaN of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// What this share of the finite values lies below.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    Data::new(finite).quantile(share)
}

/// All figures of a paper against many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The figures, in the paper's order.
    pub tables: Vec<Cell>,
    /// How many of them lie inside.
    pub inside: usize,
    /// How many there are.
    pub of: usize,
    /// Those that do not, and why.
    pub outside: Vec<Outside>,
    /// Runs that did not come to their end, of all tables.
    pub failed: usize,
}

/// Share of cells inside from which on tables are called consistent.
const CONSISTENT: f64 = 0.85;

/// A figure that lies outside.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outside {
    /// Number of the table in the paper.
    pub table: usize,
    /// What it is of.
    pub cell: &'static str,
    /// What is known of the reason.
    pub why: &'static str,
}

impl Comparison {
    /// Whether so many lie inside as can be expected of figures of the same process: nine of ten, less
    /// what chance takes; and no run was lost, as none of the paper's was.
    #[must_use]
    pub fn consistent(&self) -> bool {
        self.failed == 0 && self.inside as f64 >= CONSISTENT * self.of as f64
    }

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
    fn lost_runs_lie_nowhere_and_no_run_is_no_agreement() {
        let some = [1.0, f64::NAN, 2.0, 3.0, f64::INFINITY];
        assert_eq!(
            Cell::new(1, "x", Printed::new(2.0, 1), some.into_iter()).median,
            2.0
        );
        let none = Cell::new(1, "x", Printed::new(2.0, 1), [f64::NAN].into_iter());
        assert!(!none.inside && none.median.is_nan());
    }

    #[test]
    fn lost_runs_are_not_consistent() {
        let cells = || {
            let runs = (0..=100).map(f64::from);
            vec![Cell::new(1, "x", Printed::new(50.0, 0), runs)]
        };
        assert!(Comparison::new(cells(), 0, |_| "").consistent());
        assert!(!Comparison::new(cells(), 1, |_| "").consistent());
    }

    #[test]
    fn a_difference_has_both_roundings() {
        let difference = Printed::new(371.18, 2).minus(Printed::new(369.8, 1));
        assert!((difference.value - 1.38).abs() < 1e-9);
        assert!((difference.rounding - 0.055).abs() < 1e-12);
    }
}
