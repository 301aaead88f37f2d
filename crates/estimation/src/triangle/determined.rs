//! The parameters that the rows of an R factor determine, and their covariance.

use super::Triangle;

/// A column takes part in a combination if its share is more than this times the length of the combination's column: rounding errors of the
/// shares are smaller.
const COMBINED: f64 = 1e-6;

impl Triangle {
    /// Whether no column of J is a combination of earlier columns to within `1e-10` of its length: the rows determine all parameters.
    #[must_use]
    pub fn determined(&self) -> bool {
        (0..self.columns - 1).all(|j| self.independent(j))
    }

    /// Of these columns the independent ones, in the same order, and groups of columns with a combination that is zero to within `1e-10` of
    /// their length. Changed together, the parameters of a group leave all rows as they are: the rows do not determine them.
    #[must_use]
    pub fn independent_among(&self, columns: &[usize]) -> (Vec<usize>, Vec<Vec<usize>>) {
        let mut independent = columns.to_vec();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        loop {
            let system = self.select(&independent);
            let Some(dependent) = (0..independent.len()).find(|&i| !system.independent(i)) else {
                return (independent, groups);
            };
            // The combination of the columns before it that equals it.
            let mut shares = vec![0.0; dependent];
            for i in (0..dependent).rev() {
                let sum: f64 = (i + 1..dependent)
                    .map(|k| system.at(i, k) * shares[k])
                    .sum();
                shares[i] = (system.at(i, dependent) - sum) / system.at(i, i);
            }
            let least = COMBINED * system.column_norm(dependent);
            let mut group: Vec<usize> = (0..dependent)
                .filter(|&i| shares[i].abs() * system.column_norm(i) > least)
                .map(|i| independent[i])
                .collect();
            group.push(independent.remove(dependent));
            // Groups with a common column are one.
            let (joined, others): (Vec<_>, Vec<_>) = groups
                .into_iter()
                .partition(|known| known.iter().any(|column| group.contains(column)));
            group.extend(joined.into_iter().flatten());
            group.sort_unstable();
            group.dedup();
            groups = others;
            groups.push(group);
        }
    }

    fn independent(&self, j: usize) -> bool {
        let own = self.at(j, j);
        own.abs() > 1e-10 * self.column_norm(j) && own.is_finite()
    }

    /// The inverse of `J'J` over the `free` parameters, row by row; `None` where a column is a combination of the
    /// others to within `1e-10` of its length.
    #[must_use]
    pub fn covariance(&self, free: &[usize]) -> Option<Vec<Vec<f64>>> {
        let p = free.len();
        let system = self.select(free);
        let mut inverse = vec![vec![0.0; p]; p];
        for i in (0..p).rev() {
            if !system.independent(i) {
                return None;
            }
            let diagonal = system.at(i, i);
            inverse[i][i] = 1.0 / diagonal;
            let (above, below) = inverse.split_at_mut(i + 1);
            for (j, entry) in above[i].iter_mut().enumerate().skip(i + 1) {
                let sum: f64 = below
                    .iter()
                    .zip(i + 1..=j)
                    .map(|(row, k)| system.at(i, k) * row[j])
                    .sum();
                *entry = -sum / diagonal;
            }
        }
        Some(
            (0..p)
                .map(|i| {
                    (0..p)
                        .map(|j| (i.max(j)..p).map(|k| inverse[i][k] * inverse[j][k]).sum())
                        .collect()
                })
                .collect(),
        )
    }
}
