//! Records with missing rows or samples of an input ([`effect_search::mend`]), of a plant: a first fit determines the fastest time constant.

use ct_signals::{Record, parts};
use effect_search::{FIRST_HOLD, LONGEST_HOLD};

use super::{believed::base, control_loop::fastest_time_constant};
use crate::{Diagnosis, Error, MendedGaps, Options, Problem, Shown};

/// Share of the time limit for the first fit.
const FITTED: f64 = 0.1;

/// A problem whose records have no gaps.
pub(crate) struct Mended {
    pub problem: Problem,
    pub gaps: MendedGaps,
}

impl Mended {
    /// `None` if no record has a gap.
    pub fn of(problem: &Problem, options: &Options) -> Result<Option<Self>, Error> {
        let mut records = problem.records.iter().chain(&problem.test);
        let in_loop = problem.controller.is_some();
        let lacks_reference = |record: &Record| record.references.iter().any(|r| r.missing() > 0);
        if !records.any(|record| record.has_gaps() || in_loop && lacks_reference(record)) {
            return Ok(None);
        }
        let interval = problem.records.iter().map(Record::sample_interval);
        let first = FIRST_HOLD * interval.fold(0.0, f64::max);
        let trial = Problem {
            records: parts::without_gaps(&problem.records, |_| first.into())?.0,
            test: Vec::new(),
            ..problem.clone()
        };
        let (node, _) = base(&trial, options, FITTED)?;
        let time_constant = fastest_time_constant(&node)?;
        let limit = LONGEST_HOLD * time_constant;
        let (records, gaps) = parts::without_gaps(&problem.records, |_| limit.into())?;
        let (test, of_tests) = parts::without_gaps(&problem.test, |_| limit.into())?;
        Ok(Some(Self {
            problem: Problem {
                records,
                test,
                ..problem.clone()
            },
            gaps: MendedGaps {
                gaps: gaps.and(of_tests),
                time_constant,
                limit,
            },
        }))
    }

    /// Joins the results of the parts of a record, and reports the handling of gaps.
    pub fn report(&self, diagnosis: &mut Diagnosis) {
        let Problem { records, test, .. } = &self.problem;
        let all = [records.as_slice(), test].concat();
        let shown = |record: &Record, held_out| Shown::of(record, held_out);
        let fitted = parts::joined(records).into_iter();
        let fitted = fitted.map(|record| shown(&record, false));
        let held_out = parts::joined(test).into_iter();
        diagnosis.records = fitted
            .chain(held_out.map(|record| shown(&record, true)))
            .collect();
        let outputs = diagnosis.outputs.len();
        for step in &mut diagnosis.steps {
            step.simulated = parts::joined_series(&all, outputs, &step.simulated);
        }
        diagnosis.gaps = Some(self.gaps);
    }
}
