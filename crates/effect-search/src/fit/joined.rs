//! A candidate added to a set with known Jacobian.
//!
//! Where a candidate is absent the outputs and their derivatives by all that the set has are those of the set: only the derivatives by the
//! candidate's own entries have to be simulated, which is a small part of all. Elsewhere this is an approximation, with the right residual.

use estimation::{Prior, Residuals, Rows, Sample, rows};
use greybox::ModelSetup;

use crate::fit::node::{Context, Node};

/// Source of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Known(usize),
    Own(usize),
}

/// Columns of a candidate's model that belong to the set.
pub(crate) struct Columns {
    all: Vec<Column>,
    /// Entries of the vector that are the candidate's own.
    own: Vec<usize>,
}

impl Columns {
    /// Positions of the columns that belong to the set.
    pub fn known(&self) -> Vec<usize> {
        let all = self.all.iter().enumerate();
        all.filter_map(|(at, column)| matches!(column, Column::Known(_)).then_some(at))
            .collect()
    }
}

/// Rows of the candidate's model at a point.
pub(crate) struct Joined<'a> {
    setup: &'a ModelSetup<'a>,
    known: &'a Rows,
    own: Rows,
    columns: &'a [Column],
}

impl Context<'_> {
    /// Columns of a larger model that belong to a set.
    pub fn columns_beside(&self, set: &Node, own: &ModelSetup, larger: &ModelSetup) -> Columns {
        let (old, new) = (set.spec(), larger.model().spec());
        let (old_first, first) = (old.parameters.len(), new.parameters.len());
        let model_states = self.problem.spec.states.len();
        let place = |at: usize| -> Option<usize> {
            if at < first {
                let name = &new.parameters[at].about.name;
                return old.parameters.iter().position(|p| p.about.name == *name);
            }
            let (record, i) = (
                (at - first) / new.states.len(),
                (at - first) % new.states.len(),
            );
            let i = if i < model_states {
                i
            } else {
                let name = &new.states[i].about.name;
                old.states.iter().position(|s| s.about.name == *name)?
            };
            Some(old_first + record * old.states.len() + i)
        };
        let mut columns = Columns {
            all: Vec::new(),
            own: Vec::new(),
        };
        for &at in larger.free() {
            let known = place(at).and_then(|old| own.free().iter().position(|free| *free == old));
            columns.all.push(match known {
                Some(column) => Column::Known(column),
                None => {
                    columns.own.push(at);
                    Column::Own(columns.own.len() - 1)
                }
            });
        }
        columns
    }
}

impl<'a> Joined<'a> {
    /// The rows at a point; `None` where the simulation is not finite. `known`: those of the set.
    pub fn at(
        setup: &'a ModelSetup<'a>,
        known: &'a Rows,
        columns: &'a Columns,
        x: &[f64],
    ) -> Option<Self> {
        let own = rows(&setup.with_free(&columns.own), x)?;
        Some(Self {
            setup,
            known,
            own,
            columns: &columns.all,
        })
    }
}

impl Residuals for Joined<'_> {
    fn free(&self) -> &[usize] {
        self.setup.free()
    }

    fn bounds(&self) -> &[(f64, f64)] {
        self.setup.bounds()
    }

    fn samples(&self) -> &[usize] {
        self.setup.samples()
    }

    /// The rows at the given point, independent of the vector.
    fn each_row(&self, _: &[f64], mut each: impl FnMut(Sample, &mut [f64]) -> bool) -> Option<()> {
        let mut row = vec![0.0; self.columns.len() + 1];
        for ((output, known), (_, own)) in self.known.series().zip(self.own.series()) {
            let known = known.chunks_exact(self.known.columns);
            let own = own.chunks_exact(self.own.columns);
            for (k, (known, own)) in known.zip(own).enumerate() {
                for (value, column) in row.iter_mut().zip(self.columns) {
                    *value = match column {
                        Column::Known(at) => known[*at],
                        Column::Own(at) => own[*at],
                    };
                }
                let residual = own[self.own.columns - 1];
                row[self.columns.len()] = residual;
                let sample = Sample {
                    output,
                    first: k == 0,
                    missing: residual.is_nan(),
                };
                each(sample, &mut row).then_some(())?;
            }
        }
        Some(())
    }

    fn floor(&self, output: usize) -> f64 {
        self.setup.floor(output)
    }

    fn known_scales(&self) -> Option<&[f64]> {
        self.setup.known_scales()
    }

    fn priors(&self) -> &[Prior] {
        self.setup.priors()
    }
}
