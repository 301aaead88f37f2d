//! Differences of the same cell in two of the paper's tables.
//!
//! Tables with the same noise differ by their settings alone, so that a difference of two cells varies much less from noise to noise than
//! either of them: it is much more informative than the single cells.

use serde::Serialize;

use super::printed::{CELLS, TABLES};
use super::{Cell, Tables};

/// Pairs of tables, and the relation of their noises; first the pair that surely has the same noise.
const PAIRS: [([usize; 2], &str); 3] = [
    (
        [2, 3],
        "the paper prints the same c^ for both, average and relative variance: they have the same noise",
    ),
    (
        [1, 2],
        "if they have the same noise, which the paper does not say",
    ),
    (
        [3, 4],
        "if they have the same noise, which the paper does not say",
    ),
];

/// The second table minus the first, cell by cell, each run of both with the same noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contrast {
    /// Numbers of the two tables, 1 to 4.
    pub between: [usize; 2],
    /// Relation of the two tables' noises.
    pub noise: &'static str,
    /// The differences; the table of each is the second one.
    pub cells: Vec<Cell>,
    /// Number of printed differences inside their range.
    pub inside: usize,
}

/// Whether a cell is neither computed from others nor a difference itself.
fn is_independent(name: &str) -> bool {
    !name.ends_with("rel.err") && !name.contains('-')
}

/// All pairs; `runs` contains the cells of every table, run by run.
pub(super) fn contrasts(runs: &[&Tables]) -> Vec<Contrast> {
    PAIRS
        .into_iter()
        .map(|([first, second], noise)| {
            let printed = [first, second].map(|number| TABLES[number - 1].cells());
            let cells: Vec<Cell> = (0..printed[0].len().min(printed[1].len()))
                .filter(|&place| is_independent(CELLS[place]))
                .map(|place| {
                    let differences = runs.iter().map(|run| {
                        let [a, b] = [first, second]
                            .map(|number| run[number - 1].map_or(f64::NAN, |cells| cells[place]));
                        b - a
                    });
                    let difference = printed[1][place].minus(printed[0][place]);
                    Cell::new(second, CELLS[place], difference, differences)
                })
                .collect();
            Contrast {
                between: [first, second],
                noise,
                inside: cells.iter().filter(|cell| cell.inside).count(),
                cells,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contrast_is_the_second_table_minus_the_first_of_the_same_run() {
        let runs: Vec<Tables> = (0..40)
            .map(|run| {
                let noise = f64::from(run);
                [1.0, 2.0, 4.0, 8.0].map(|of_table| Some([of_table + noise; CELLS.len()]))
            })
            .collect();
        let runs: Vec<&Tables> = runs.iter().collect();
        let found = contrasts(&runs);
        // Common terms cancel: the differences are constant.
        for (contrast, difference) in found.iter().zip([2.0, 1.0, 4.0]) {
            for cell in &contrast.cells {
                assert_eq!((cell.q05, cell.q95), (difference, difference));
                assert!(!cell.inside, "{cell:?}");
            }
        }
        let names: Vec<&str> = found[0].cells.iter().map(|cell| cell.cell).collect();
        assert!(names.contains(&"P11") && names.contains(&"E250"));
        assert!(!names.contains(&"K rel.err") && !names.contains(&"E500-E250"));
        assert!(!found[2].cells.iter().any(|cell| cell.cell == "P11"));
        let k = &found[0].cells[0];
        assert!((k.paper - (0.986 - 0.987)).abs() < 1e-12);
    }

    #[test]
    fn a_failed_run_has_no_difference() {
        let whole = [Some([1.0; CELLS.len()]); 4];
        let mut failed = whole;
        failed[2] = None;
        let found = contrasts(&[&whole, &failed, &whole]);
        assert_eq!(found[0].cells[0].median, 0.0);
        assert!(contrasts(&[&failed])[0].cells[0].median.is_nan());
    }
}
