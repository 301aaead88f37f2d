//! Positions of the unknowns in the equations: first the unknowns that all records share, then the offset and the initial states of each
//! record. The parts of one record, between which the input is not known, share its offset.

use std::ops::Range;

use crate::Structure;

/// The places of all unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    shared: usize,
    /// For each record, the positions of its own columns.
    own: Vec<Vec<usize>>,
    /// Whether a record is a part of the one before.
    continues: Vec<bool>,
    unknowns: usize,
}

impl Layout {
    pub(crate) fn new(
        shared: usize,
        structure: &Structure,
        continues: impl Iterator<Item = bool>,
    ) -> Self {
        let mut layout = Self {
            shared,
            own: Vec::new(),
            continues: Vec::new(),
            unknowns: shared,
        };
        for continues in continues {
            let continues = continues && !layout.own.is_empty();
            let before = layout.own.last().filter(|_| continues && structure.offset);
            let mut places: Vec<usize> = before
                .and_then(|own| own.first())
                .copied()
                .into_iter()
                .collect();
            let new = structure.of_record() - places.len();
            places.extend(layout.unknowns..layout.unknowns + new);
            layout.unknowns += new;
            layout.own.push(places);
            layout.continues.push(continues);
        }
        layout
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Columns of a record's rows.
    pub(crate) fn columns(&self) -> usize {
        self.shared + self.own.first().map_or(0, Vec::len)
    }

    /// Position of column i of a record.
    pub(crate) fn place(&self, index: usize, i: usize) -> usize {
        match i.checked_sub(self.shared) {
            None => i,
            Some(own) => self.own[index][own],
        }
    }

    /// Each record's own unknowns; empty if it has none.
    pub(crate) fn of_records(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let own = self.own.iter().filter(|own| !own.is_empty());
        own.map(|own| own.iter().map(|place| x[*place]).collect())
            .collect()
    }

    /// The parts of each record.
    pub(crate) fn groups(&self) -> Vec<Range<usize>> {
        let mut groups: Vec<Range<usize>> = Vec::new();
        for (index, continues) in self.continues.iter().enumerate() {
            match groups.last_mut() {
                Some(group) if *continues => group.end = index + 1,
                _ => groups.push(index..index + 1),
            }
        }
        groups
    }
}
